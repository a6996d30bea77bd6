#include "cli/render_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <string_view>

#include "dtr/base/error.h"
#include "dtr/render/option_names.h"

namespace dtr::cli {
namespace {

template <typename T, size_t N>
std::map<std::string, T> ByName(const std::array<T, N>& values) {
  std::map<std::string, T> by_name;
  for (const T value : values) by_name[NameOf(value)] = value;
  return by_name;
}

const std::map<std::string, RenderMethod> kMethods = ByName(kRenderMethods);
const std::map<std::string, Primitive> kPrimitiveNames = ByName(kPrimitives);
const std::map<std::string, BlendWeight> kBlends = ByName(kBlendWeights);

// An option whose value is one of the names of `values`.
template <typename T>
void AddChoice(CLI::App& command, const std::string& flag, T& target,
               const std::map<std::string, T>& values, const std::string& description) {
  std::string names;
  for (const auto& [name, value] : values) names += (names.empty() ? "" : "|") + name;
  command
      .add_option_function<std::string>(
          flag, [&target, &values](const std::string& name) { target = values.at(name); },
          description)
      ->check(CLI::IsMember(values))
      ->type_name(names);
}

double RadiansOf(double degrees) { return degrees * std::numbers::pi / 180; }

/// Degrees with as few digits as come back as the same bits.
std::string DegreesOf(double radians) {
  constexpr int kMostDigits = 17;
  const double degrees = radians * 180 / std::numbers::pi;
  for (int digits = 1; digits <= kMostDigits; ++digits) {
    const double rounded = std::stod(fmt::format("{:.{}g}", degrees, digits));
    if (RadiansOf(rounded) == radians) return fmt::format("{}", rounded);
  }
  // The way back rounds, too: the neighbours are what is left.
  const double above = std::nextafter(degrees, HUGE_VAL);
  return fmt::format("{}", RadiansOf(above) == radians ? above : std::nextafter(degrees, 0));
}

/// Collects "--flag VALUE" of what is not the default.
class Arguments {
 public:
  template <typename T>
  void Add(const char* flag, const T& value, const T& by_default) {
    if (value != by_default) Append(flag, fmt::format("{}", value));
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

// What RenderOptionArguments writes, and nothing else: a set comes from anywhere, and must not set
// what files a command writes.
constexpr std::array<std::string_view, 17> kStored{
    "--method",         "--primitive",      "--blend",
    "--views",          "--resolution",     "--point-size",
    "--exponent",       "--falloff",        "--blend-k",
    "--max-angle",      "--delta",          "--depth-break",
    "--mesh-tolerance", "--absolute-delta", "--absolute-depth-break",
    "--blend-linear",   "--fill-holes"};

std::vector<std::string> RenderOptionArguments(const RenderOptions& options) {
  const RenderOptions usual;
  Arguments arguments;
  // Asking for splats alone would change the method, too.
  const bool splats = options.primitive == Primitive::kSplat;
  if (splats || options.method != usual.method)
    arguments.Append("--method", NameOf(options.method));
  if (splats) arguments.Append("--primitive", NameOf(options.primitive));
  if (options.blend != usual.blend) arguments.Append("--blend", NameOf(options.blend));
  arguments.Add("--views", options.views, usual.views);
  arguments.Add("--resolution", options.resolution, usual.resolution);
  arguments.Add("--point-size", options.point_size, usual.point_size);
  arguments.Add("--exponent", options.exponent, usual.exponent);
  arguments.Add("--falloff", options.falloff, usual.falloff);
  arguments.Add("--blend-k", options.blend_k, usual.blend_k);
  if (options.max_angle_rad != usual.max_angle_rad) {
    arguments.Append("--max-angle", DegreesOf(options.max_angle_rad));
  }
  arguments.Add("--delta", options.delta_px, usual.delta_px);
  arguments.Add("--depth-break", options.depth_break_px, usual.depth_break_px);
  arguments.Add("--mesh-tolerance", options.mesh_tolerance_px, usual.mesh_tolerance_px);
  if (options.absolute_delta) arguments.Add("--absolute-delta", *options.absolute_delta, 0.0);
  if (options.absolute_depth_break) {
    arguments.Add("--absolute-depth-break", *options.absolute_depth_break, 0.0);
  }
  if (options.blend_in_linear_light) arguments.Flag("--blend-linear");
  if (options.fill_holes) arguments.Flag("--fill-holes");
  return arguments.Take();
}

void UseStoredArguments(CLI::App& command, const std::vector<std::string>& arguments) {
  const auto is_flag = [](const std::string& text) { return text.rfind("--", 0) == 0; };
  for (size_t i = 0; i < arguments.size(); ++i) {
    const bool has_value = i + 1 < arguments.size() && !is_flag(arguments[i + 1]);
    const std::string value = has_value ? arguments[i + 1] : "true";
    const std::string& name = arguments[i];
    i += has_value;
    if (std::find(kStored.begin(), kStored.end(), name) == kStored.end()) {
      throw Error("set.json: pruned.render_arguments: expected options of rendering, found " +
                  name);
    }
    CLI::Option* option = command.get_option_no_throw(name);
    if (option == nullptr || option->count() > 0) continue;
    try {
      option->add_result(value);
      option->run_callback();
    } catch (const CLI::ParseError& error) {
      throw Error(std::string("set.json: pruned.render_arguments: ") + error.what());
    }
  }
}

std::shared_ptr<RenderOptions> AddRenderOptions(CLI::App& command) {
  auto shared = std::make_shared<RenderOptions>();
  RenderOptions& options = *shared;
  AddChoice(command, "--method", options.method, kMethods,
            "Algorithm [deferred; with --primitive splat two-pass]");
  AddChoice(command, "--primitive", options.primitive, kPrimitiveNames,
            "What two-pass draws; deferred knows meshes only [mesh]");
  command.parse_complete_callback([&command, &options] {
    if (options.primitive == Primitive::kSplat && command.count("--method") == 0) {
      options.method = RenderMethod::kTwoPass;
    }
  });
  AddChoice(command, "--blend", options.blend, kBlends,
            "Weight of a view by angle [inverse-angle]");
  command.add_option("--views", options.views, "Blend at most the K nearest valid views [8]")
      ->check(CLI::Range(1, 1024))
      ->type_name("K");
  command.add_option("--resolution", options.resolution, "Take every R-th depth pixel [1]")
      ->check(CLI::Range(1, 64))
      ->type_name("R");
  command.add_option("--point-size", options.point_size, "Splats: factor on the footprint [1]")
      ->check(CLI::PositiveNumber)
      ->type_name("S");
  command.add_option("--exponent", options.exponent, "cosine: exponent [8]")
      ->check(CLI::Range(0.0, 1000.0))
      ->type_name("N");
  command.add_option("--falloff", options.falloff, "exponential: fall-off per radian [8]")
      ->check(CLI::Range(0.0, 1e6))
      ->type_name("C");
  command.add_option("--blend-k", options.blend_k, "k-nearest: K; inverse-angle: power [2]")
      ->check(CLI::Range(1, 64))
      ->type_name("K");
  command
      .add_option_function<double>(
          "--max-angle", [&options](double degrees) { options.max_angle_rad = RadiansOf(degrees); },
          "Views farther than this angle at the scene centre are not valid [60]")
      ->check(CLI::Range(0.0, 180.0))
      ->type_name("DEG");
  command
      .add_option("--delta", options.delta_px,
                  "Delta of the two-pass method, in pixels of disparity")
      ->check(CLI::PositiveNumber)
      ->type_name("PX");
  command
      .add_option("--depth-break", options.depth_break_px,
                  "Triangles across larger depth steps are dropped, in pixels of disparity")
      ->check(CLI::PositiveNumber)
      ->type_name("PX");
  command
      .add_option("--mesh-tolerance", options.mesh_tolerance_px,
                  fmt::format("deferred: how far the reduced mesh may lie off the depth, in pixels "
                              "of disparity [{}]",
                              RenderOptions{}.mesh_tolerance_px))
      ->check(CLI::NonNegativeNumber)
      ->type_name("PX");
  command
      .add_option("--absolute-delta", options.absolute_delta,
                  "Delta in scene units instead, as in the founding report")
      ->check(CLI::PositiveNumber)
      ->type_name("UNITS");
  command
      .add_option("--absolute-depth-break", options.absolute_depth_break,
                  "Depth break in scene units instead, as in the founding report (3.5 there)")
      ->check(CLI::PositiveNumber)
      ->type_name("UNITS");
  command.add_flag_callback(
      "--blend-linear", [&options] { options.blend_in_linear_light = true; },
      "Blend linear light instead of sRGB values");
  command.add_flag_callback(
      "--blend-srgb", [&options] { options.blend_in_linear_light = false; },
      "Blend sRGB values, the default");
  command.add_flag("--fill-holes", options.fill_holes, "Fill unseen pixels from the background");
  return shared;
}

}  // namespace dtr::cli
