// cli/osg_bench.h -- what a frame takes as a node of OpenSceneGraph, beside the same frame by
// dtr/gl alone: the founding report's table "D+TR on OSG", which it left empty.
#pragma once
#include <string>
#include <vector>

#include "cli/console.h"
#include "dtr/base/progress.h"
#include "dtr/eval/bench_json.h"
#include "dtr/eval/timed_renderer.h"
#include "dtr/render/camera_path.h"
#include "dtr/render/options.h"
#include "dtr/types/dtr_set.h"

namespace dtr::cli {

/// One line: how a set is drawn, and the times of both.
struct OsgRow {
  bool read_back = false;  ///< the report's own path; then there are no times of dtr/gl
  RenderOptions options;
  int views_used = 0;  ///< most of any frame
  eval::Times gl, gl_cpu, osg, osg_cpu;
};

struct OsgBench {
  std::string renderer;  ///< as the driver calls itself
  int width_px = 0, height_px = 0, frames = 0;
  bool drawn_by_processor = true;  ///< its time then is what frames cost, else the wall's
  std::vector<OsgRow> rows;
  double RatioOsgOverGl(const OsgRow& row) const {
    return drawn_by_processor ? row.osg_cpu.median_ms / row.gl_cpu.median_ms
                              : row.osg.median_ms / row.gl.median_ms;
  }
};

/// Draws the cameras of `path` one after the other, every frame once by a viewer with the set as
/// its scene and once by a gl::FittingRenderer of its own, in the same graphics context, in turns,
/// after one lap that is not counted. A
/// frame is finished when its pixels are. `variants` give a row each; the first also one by the
/// read-back path, of a few frames. The window is one in memory. Throws Error, one line, where no
/// display can be opened.
OsgBench MeasureOnOsg(DtrSet set, const std::vector<NovelCamera>& path,
                      const std::vector<RenderOptions>& variants, const Progress& progress);

/// For people.
void SayOsgTable(const OsgBench& bench, const eval::BenchMachine& machine, Console& console);

/// {table:"osg",width_px,height_px,frames,rows:[{path,method,views_used,resolution,
///  seconds_per_frame,ms,spread_ms,cpu_ms,gl_ms,gl_cpu_ms,ratio_osg_over_gl}],
///  largest_ratio_osg_over_gl,machine}; `path`: "gpu", or "read-back", which has no gl_... and no
/// ratio (null).
std::string OsgJson(const OsgBench& bench, const eval::BenchMachine& machine);

}  // namespace dtr::cli
