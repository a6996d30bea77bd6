// A program of dtr/simd and nothing else: draws a plane from a view beside it. What it is linked
// with is tested, too (links_no_opengl.cmake).
#include <cstdio>

#include "dtr/render/scene.h"
#include "dtr/simd/renderer.h"
#include "dtr/types/dtr_set.h"

int main() {
  constexpr int kWidth = 64, kHeight = 48;
  constexpr float kDepth = 8;
  dtr::DtrSet set;
  set.frames.resize(1);
  dtr::View view;
  view.id = view.name = "plane";
  view.camera = dtr::PinholeCamera(kWidth, kHeight, 60, 60, kWidth / 2.0, kHeight / 2.0);
  view.image = dtr::ImageRgb8(kWidth, kHeight, 3, 200);
  view.depth = dtr::DepthImage(kWidth, kHeight);
  for (float& z : view.depth.grid().data()) z = kDepth;
  view.reference_baseline = 1;
  set.frames[0].views.push_back(view);
  dtr::simd::Renderer renderer;
  const dtr::RenderResult image =
      renderer.Render(dtr::MakeRenderScene(set), view.camera, dtr::Pose{}, dtr::RenderOptions{});
  std::printf("%s: %.1f %% seen\n", dtr::simd::Description().c_str(), 100 * image.coverage_share);
  return image.coverage_share == 1 && image.image(kWidth / 2, kHeight / 2, 0) == 200 ? 0 : 1;
}
