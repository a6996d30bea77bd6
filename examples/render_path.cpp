// render_path SET.dtr FOLDER -- renders a path along the set's own cameras to FOLDER/000000.png,
// ...
#include <dtr/cpu/renderer.h>
#include <pipeline/render/render.h>

#include <iostream>

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: render_path SET.dtr FOLDER\n";
    return 2;
  }
  dtr::pipeline::RenderRequest request;
  request.set = argv[1];
  request.output = argv[2];
  request.cameras.fly_through_frames = 12;
  request.cameras.size = "320x0";  // 0: in proportion
  request.render.views = 4;        // blend the four nearest of the views that see a point
  request.render.fill_holes = true;
  try {
    dtr::SilentProgress nobody;
    const auto report = dtr::pipeline::Render(
        request, [] { return dtr::cpu::Render; }, nobody);
    for (const dtr::pipeline::RenderedFile& frame : report.frames) {
      std::cout << frame.file << ": " << 100 * frame.coverage << " % seen, by "
                << frame.views_used.size() << " views, " << frame.render_ms << " ms\n";
    }
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
