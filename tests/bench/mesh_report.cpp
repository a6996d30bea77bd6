// mesh_report SET.dtr [TOLERANCE_PX]...: how many triangles the reduced meshes of SPEC 5.1 have
// against the full grid with its closed cells, means over the source views, and the CPU time to
// make one.
#include <time.h>

#include <cstdio>
#include <cstdlib>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/gl/view_mesh.h"
#include "dtr/io/set_io.h"
#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/scene.h"

namespace {

double CpuMilliseconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  dtr::io::LoadOptions load;
  load.completed = true;
  load.images = false;
  const dtr::DtrSet set = dtr::io::LoadSet(argv[1], load);
  std::vector<double> tolerances;
  for (int i = 2; i < argc; ++i) tolerances.push_back(std::atof(argv[i]));
  dtr::RenderOptions options;
  if (tolerances.empty()) tolerances.push_back(options.mesh_tolerance_px);
  double full = 0;
  for (const dtr::View& view : set.frames[0].views) {
    full += double(dtr::gl::MakeViewMesh(view, options).indices.size()) / 3;
  }
  const double views = double(set.frames[0].views.size());
  std::printf("full grid: %.0f triangles a view\n", full / views);
  for (const double tolerance : tolerances) {
    options.mesh_tolerance_px = tolerance;
    double triangles = 0, cells = 0, ms = 0;
    for (const dtr::View& view : set.frames[0].views) {
      const double start = CpuMilliseconds();
      std::string unfit;
      const dtr::AdaptiveMesh mesh = dtr::MakeAdaptiveMesh(view, options, unfit);
      ms += CpuMilliseconds() - start;
      triangles += double(mesh.indices.size()) / 3;
      cells += double(mesh.cells.size());
    }
    // A cell is a square on the screen: two triangles.
    std::printf("tolerance %.2f px: %.0f triangles and %.0f cells, %.1fx fewer; %.1f CPU ms\n",
                tolerance, triangles / views, cells / views, full / (triangles + 2 * cells),
                ms / views);
  }
  return 0;
}
