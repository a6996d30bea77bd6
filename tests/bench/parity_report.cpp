// parity_report SET.dtr [VIEW]...: how far dtr/simd and the reference are apart from the set's
// held-out views (or the named ones), by the deferred method, holes not filled, every pixel counted.
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
    std::fprintf(stderr, "parity_report SET.dtr [VIEW]...\n");
    return 2;
  }
  dtr::io::LoadOptions load;
  load.held_out = true;
  const dtr::DtrSet set = dtr::io::LoadSet(argv[1], load);
  const std::vector<std::string> names(argv + 2, argv + argc);
  const dtr::RenderScene scene = dtr::MakeRenderScene(set);
  const dtr::RenderOptions options;
  dtr::simd::Renderer renderer;
  dtr::testing::WholeComparison all;
  for (const dtr::View& view : set.frames[0].views) {
    const bool named = std::find(names.begin(), names.end(), view.name) != names.end();
    if (!(names.empty() ? view.role == dtr::ViewRole::kHeldOut : named)) continue;
    const auto expected = dtr::cpu::Render(scene, view.camera, view.cam_from_world, options);
    const auto found = renderer.Render(scene, view.camera, view.cam_from_world, options);
    const auto c = dtr::testing::CompareWhole(expected, found);
    std::printf("%-24s %s\n", view.name.c_str(), c.Text().c_str());
    all.Add(c);
  }
  std::printf("%-24s %s\n", "all", all.Text().c_str());
  return 0;
}
