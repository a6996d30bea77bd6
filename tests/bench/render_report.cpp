// render_report: which rendering options suit a set? PSNR on photos it was not rendered from, one
// line for every combination of the values given; docs/accuracy/RENDERING.md has the figures.
//
//   render_report SET.dtr [held-out] [KEY=VALUE[,VALUE...]]...
//   render_report sceaux.dtr views=1,2,4,8 exponent=8,64 linear=0,1
//
// KEY is one of those in Keys() below; `blend` and `splat` take the number of the enumerator
// (dtr/render/options.h). Without `held-out` every source view is left out in turn.
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/cpu/renderer.h"
#include "dtr/eval/held_out.h"
#include "dtr/io/set_io.h"

namespace {

using dtr::RenderOptions;
using Setter = std::function<void(RenderOptions&, double)>;

const std::map<std::string, Setter>& Keys() {
  static const std::map<std::string, Setter> keys = {
      {"views", [](auto& o, double v) { o.views = static_cast<int>(v); }},
      {"exponent", [](auto& o, double v) { o.exponent = v; }},
      {"falloff", [](auto& o, double v) { o.falloff = v; }},
      {"blend", [](auto& o, double v) { o.blend = static_cast<dtr::BlendWeight>(v); }},
      {"blend_k", [](auto& o, double v) { o.blend_k = static_cast<int>(v); }},
      {"splat", [](auto& o, double v) { o.primitive = static_cast<dtr::Primitive>(v); }},
      {"method", [](auto& o, double v) { o.method = static_cast<dtr::RenderMethod>(v); }},
      {"delta", [](auto& o, double v) { o.delta_px = v; }},
      {"break", [](auto& o, double v) { o.depth_break_px = v; }},
      {"resolution", [](auto& o, double v) { o.resolution = static_cast<int>(v); }},
      {"linear", [](auto& o, double v) { o.blend_in_linear_light = v != 0; }},
  };
  return keys;
}

/// One line's options and what it is called.
struct Row {
  std::string label;
  RenderOptions render;
};

std::vector<Row> Expand(const std::vector<Row>& rows, const std::string& argument) {
  const size_t equals = argument.find('=');
  const std::string key = argument.substr(0, equals);
  if (equals == std::string::npos || !Keys().contains(key)) {
    throw dtr::UsageError(argument + ": expected KEY=VALUE[,VALUE...] with a known KEY");
  }
  std::vector<Row> expanded;
  for (const Row& row : rows) {
    for (size_t begin = equals + 1; begin <= argument.size();) {
      const size_t end = std::min(argument.find(',', begin), argument.size());
      const std::string value = argument.substr(begin, end - begin);
      Row next = row;
      Keys().at(key)(next.render, std::stod(value));
      next.label += " " + key + "=" + value;
      expanded.push_back(next);
      begin = end + 1;
    }
  }
  return expanded;
}

void Report(const dtr::DtrSet& set, const Row& row, bool leave_one_out) {
  dtr::SilentProgress progress;
  dtr::eval::EvaluateOptions options;
  options.leave_one_out = leave_one_out;
  options.render = row.render;
  const auto report = dtr::eval::EvaluateHeldOut(set, options, &dtr::cpu::Render, progress);
  const dtr::eval::ViewScore& mean = report.mean;
  std::printf("%-44s psnr %6.2f covered %6.2f own-depth %6.2f ssim %.4f coverage %.4f ms %.0f\n",
              row.label.empty() ? " default" : row.label.c_str(), mean.psnr_db.value_or(NAN),
              mean.psnr_covered_db.value_or(NAN), mean.psnr_own_depth_db.value_or(NAN),
              mean.ssim.value_or(NAN), mean.coverage, mean.render_ms);
  std::fflush(stdout);
}

int Main(const std::vector<std::string>& arguments) {
  if (arguments.empty()) throw dtr::UsageError("render_report SET.dtr [held-out] [KEY=VALUE,...]");
  bool leave_one_out = true;
  std::vector<Row> rows(1);
  for (size_t i = 1; i < arguments.size(); ++i) {
    if (arguments[i] == "held-out") {
      leave_one_out = false;
    } else {
      rows = Expand(rows, arguments[i]);
    }
  }
  dtr::io::LoadOptions load;
  load.completed = true;
  load.held_out = true;
  const dtr::DtrSet set = dtr::io::LoadSet(arguments[0], load);
  for (const Row& row : rows) Report(set, row, leave_one_out);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Main({argv + 1, argv + argc});
  } catch (const dtr::UsageError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
