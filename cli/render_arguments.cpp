#include "cli/render_arguments.h"

#include <fmt/format.h>

#include <optional>

#include "dtr/render/degrees.h"
#include "dtr/render/option_names.h"

namespace dtr::cli {
namespace {

/// Collects "--flag VALUE" of what differs.
class Arguments {
 public:
  template <typename T>
  void Add(const char* flag, const T& value, const T& by_default) {
    if (value != by_default) Append(flag, fmt::format("{}", value));
  }
  void Add(const char* flag, const std::optional<double>& value,
           const std::optional<double>& by_default) {
    if (value != by_default) Append(flag, fmt::format("{}", value.value_or(0)));
  }
  void Append(const char* flag, std::string value) {
    arguments_.emplace_back(flag);
    arguments_.push_back(std::move(value));
  }
  void Flag(const char* flag) { arguments_.emplace_back(flag); }
  std::vector<std::string> Take() { return std::move(arguments_); }

 private:
  std::vector<std::string> arguments_;
};

}  // namespace

std::vector<std::string> RenderOptionArguments(const RenderOptions& options,
                                               const RenderOptions& base) {
  Arguments arguments;
  // Asking for splats alone would change the method, too.
  const bool primitive = options.primitive != base.primitive;
  if (options.method != base.method || (primitive && options.primitive == Primitive::kSplat)) {
    arguments.Append("--method", NameOf(options.method));
  }
  if (primitive) arguments.Append("--primitive", NameOf(options.primitive));
  if (options.blend != base.blend) arguments.Append("--blend", NameOf(options.blend));
  arguments.Add("--views", options.views, base.views);
  arguments.Add("--resolution", options.resolution, base.resolution);
  arguments.Add("--point-size", options.point_size, base.point_size);
  arguments.Add("--exponent", options.exponent, base.exponent);
  arguments.Add("--falloff", options.falloff, base.falloff);
  arguments.Add("--blend-k", options.blend_k, base.blend_k);
  if (options.max_angle_rad != base.max_angle_rad) {
    arguments.Append("--max-angle", fmt::format("{}", DegreesOf(options.max_angle_rad)));
  }
  arguments.Add("--delta", options.delta_px, base.delta_px);
  arguments.Add("--depth-break", options.depth_break_px, base.depth_break_px);
  arguments.Add("--mesh-tolerance", options.mesh_tolerance_px, base.mesh_tolerance_px);
  arguments.Add("--absolute-delta", options.absolute_delta, base.absolute_delta);
  arguments.Add("--absolute-depth-break", options.absolute_depth_break, base.absolute_depth_break);
  if (options.blend_in_linear_light != base.blend_in_linear_light) {
    arguments.Flag(options.blend_in_linear_light ? "--blend-linear" : "--blend-srgb");
  }
  if (options.fill_holes != base.fill_holes) {
    arguments.Flag(options.fill_holes ? "--fill-holes" : "--fill-holes=false");
  }
  if (options.smooth_edges != base.smooth_edges) {
    arguments.Flag(options.smooth_edges ? "--smooth-edges" : "--smooth-edges=false");
  }
  return arguments.Take();
}

}  // namespace dtr::cli
