#include "cli/render_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <optional>
#include <string>

#include "cli/number_checks.h"
#include "dtr/io/pruned.h"
#include "dtr/render/degrees.h"
#include "dtr/render/option_names.h"
#include "dtr/render/stored_options.h"

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

/// A threshold in scene units; 0 is none.
void AddAbsolute(CLI::App& command, const std::string& flag, std::optional<double>& target,
                 const std::string& description) {
  command
      .add_option_function<double>(
          flag,
          [&target](double value) { target = value > 0 ? std::optional(value) : std::nullopt; },
          description)
      ->check(kNonNegative)
      ->type_name("UNITS");
}

// The flag that sets a field: --max-angle for max_angle_deg.
std::string FlagOf(std::string field) {
  for (const std::string unit : {"_deg", "_px"}) {
    if (field.ends_with(unit)) field.resize(field.size() - unit.size());
  }
  std::replace(field.begin(), field.end(), '_', '-');
  return "--" + field;
}

}  // namespace

void UseStoredOptions(const CLI::App& command, const DtrSet& set, RenderOptions& options) {
  const auto given = [&](const std::string& flag) {
    const CLI::Option* option = command.get_option_no_throw(flag);
    return option != nullptr && option->count() > 0;
  };
  const auto by_user = [&](const std::string& field) {
    if (field == "blend_in_linear_light") return given("--blend-linear") || given("--blend-srgb");
    return given(FlagOf(field));
  };
  const auto [json, where] = io::RenderOptionsOf(set);
  options = WithStoredOptions(options, json, where, by_user);
}

RenderOptions StoredRenderOptions(const DtrSet& set, const RenderOptions& defaults) {
  const auto [json, where] = io::RenderOptionsOf(set);
  return WithStoredOptions(defaults, json, where);
}

std::shared_ptr<RenderOptions> AddRenderOptions(CLI::App& command, const RenderOptions& defaults) {
  auto shared = std::make_shared<RenderOptions>(defaults);
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
      ->check(kPositive)
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
      ->check(kPositive)
      ->type_name("PX");
  command
      .add_option("--depth-break", options.depth_break_px,
                  "Triangles across larger depth steps are dropped, in pixels of disparity")
      ->check(kPositive)
      ->type_name("PX");
  command
      .add_option("--mesh-tolerance", options.mesh_tolerance_px,
                  fmt::format("deferred: how far the reduced mesh may lie off the depth, in pixels "
                              "of disparity [{}]",
                              RenderOptions{}.mesh_tolerance_px))
      ->check(kNonNegative)
      ->type_name("PX");
  AddAbsolute(command, "--absolute-delta", options.absolute_delta,
              "Delta in scene units instead, as in the founding report [0: not]");
  AddAbsolute(command, "--absolute-depth-break", options.absolute_depth_break,
              "Depth break in scene units instead, as in the founding report (3.5 there) [0: not]");
  command.add_flag_callback(
      "--blend-linear", [&options] { options.blend_in_linear_light = true; },
      "Blend linear light instead of sRGB values");
  command.add_flag_callback(
      "--blend-srgb", [&options] { options.blend_in_linear_light = false; },
      "Blend sRGB values, the default");
  command.add_flag("--fill-holes", options.fill_holes,
                   defaults.fill_holes
                       ? "Fill pixels that no view sees, the default; --fill-holes=false leaves "
                         "them black"
                       : "Fill pixels that no view sees from those around them");
  command.add_flag("--smooth-edges", options.smooth_edges,
                   defaults.smooth_edges
                       ? "No stairs at depth edges, the default; --smooth-edges=false leaves them"
                       : "No stairs at depth edges");
  return shared;
}

}  // namespace dtr::cli
