// tests/simd/parity_matrix.h -- the renderers of one scene against each other by every option that
// changes what is drawn.
#pragma once
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "dtr/cpu/renderer.h"
#include "tests/simd/comparison.h"
#include "tests/simd/exact_scenes.h"
#include "tests/simd/whole_comparison.h"

namespace dtr::testing {

/// The reference against another renderer (gl::Renderer, simd::Renderer).
template <typename Renderer>
Comparison ExpectParity(Renderer& renderer, const NamedScene& scene, const RenderOptions& options) {
  const RenderScene views = MakeRenderScene(scene.set);
  const auto& [name, set, novel] = scene;
  const RenderResult expected = cpu::Render(views, novel.camera, novel.cam_from_world, options);
  const RenderResult found = renderer.Render(views, novel.camera, novel.cam_from_world, options);
  EXPECT_EQ(found.views_used, expected.views_used);
  if (options.method == RenderMethod::kDeferred) {
    const WholeComparison whole = CompareWhole(expected, found);
    EXPECT_TRUE(whole.Holds()) << scene.name << ": " << whole.Text();
  }
  return Compare(expected, found, StrictestBreaks(views, options));
}

/// Resolutions 1, 2, 4 x all weights of one method and primitive, `views` blended; every one must
/// hold, and their sum. Prints a line.
template <typename Renderer>
void ExpectParityOf(Renderer& renderer, const NamedScene& scene, RenderMethod method,
                    Primitive primitive, int views) {
  const std::string what = std::string(method == RenderMethod::kTwoPass ? "two-pass" : "deferred") +
                           (primitive == Primitive::kMesh ? " mesh" : " splat");
  Comparison all;
  for (const int resolution : {1, 2, 4}) {
    for (const BlendWeight blend : kAllWeights) {
      RenderOptions options = OptionsOf(method);
      options.primitive = primitive;
      options.resolution = resolution;
      options.blend = blend;
      options.views = views;
      const Comparison c = ExpectParity(renderer, scene, options);
      EXPECT_TRUE(c.Holds()) << scene.name << " " << what << " R" << resolution << " weight "
                             << static_cast<int>(blend) << ": " << c.Text();
      all.Add(c);
    }
  }
  std::printf("%-18s %-14s %s\n", scene.name.c_str(), what.c_str(), all.Text().c_str());
  EXPECT_TRUE(all.Holds()) << scene.name << " " << what;
  // Enough is evaluated: a measure that leaves out everything holds always.
  EXPECT_GT(all.compared, all.total / 4) << scene.name << " " << what;
}

/// The deferred method, which knows no primitive (SPEC 5.1): its image must be the same, to the
/// bit, for another one.
template <typename Renderer>
void ExpectParityOfDeferred(Renderer& renderer, const NamedScene& scene, int views) {
  ExpectParityOf(renderer, scene, RenderMethod::kDeferred, Primitive::kMesh, views);
  RenderOptions options = OptionsOf(RenderMethod::kDeferred);
  const RenderScene loaded = MakeRenderScene(scene.set);
  const auto draw = [&] {
    return renderer.Render(loaded, scene.novel.camera, scene.novel.cam_from_world, options);
  };
  const RenderResult mesh = draw();
  options.primitive = Primitive::kSplat;
  options.point_size = 2;
  ExpectSameBytes(mesh, draw());
}

/// Both methods x both primitives.
template <typename Renderer>
void ExpectParityOfAll(Renderer& renderer, const NamedScene& scene, int views) {
  ExpectParityOf(renderer, scene, RenderMethod::kTwoPass, Primitive::kMesh, views);
  ExpectParityOf(renderer, scene, RenderMethod::kTwoPass, Primitive::kSplat, views);
  ExpectParityOfDeferred(renderer, scene, views);
}

}  // namespace dtr::testing
