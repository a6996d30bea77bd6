// parity_report SET.dtr: how far dtr/simd and the reference are apart from the set's held-out
// views, or from each view that is left out in turn where none is held out; by the deferred method,
// holes not filled, every pixel counted.
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "dtr/cpu/renderer.h"
#include "dtr/io/set_io.h"
#include "dtr/render/scene.h"
#include "dtr/simd/renderer.h"
#include "tests/simd/whole_comparison.h"

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "parity_report SET.dtr\n");
    return 2;
  }
  dtr::io::LoadOptions load;
  load.completed = true;
  load.held_out = true;
  const dtr::DtrSet set = dtr::io::LoadSet(argv[1], load);
  const std::vector<dtr::View>& views = set.frames[0].views;
  const bool holds_out = std::any_of(views.begin(), views.end(), [](const dtr::View& view) {
    return view.role == dtr::ViewRole::kHeldOut;
  });
  const dtr::RenderOptions options;
  dtr::simd::Renderer renderer;
  dtr::testing::WholeComparison all;
  for (const dtr::View& view : views) {
    if (holds_out && view.role != dtr::ViewRole::kHeldOut) continue;
    dtr::RenderScene scene = dtr::MakeRenderScene(set);
    std::erase(scene.views, &view);
    const auto expected = dtr::cpu::Render(scene, view.camera, view.cam_from_world, options);
    const auto found = renderer.Render(scene, view.camera, view.cam_from_world, options);
    const auto c = dtr::testing::CompareWhole(expected, found);
    std::printf("%-24s %s\n", view.name.c_str(), c.Text().c_str());
    all.Add(c);
  }
  std::printf("%-24s %s\n", "all", all.Text().c_str());
  return 0;
}
