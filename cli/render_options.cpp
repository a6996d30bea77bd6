#include "cli/render_options.h"

#include <map>
#include <numbers>
#include <string>

namespace dtr::cli {
namespace {

const std::map<std::string, RenderMethod> kMethods{{"two-pass", RenderMethod::kTwoPass},
                                                   {"deferred", RenderMethod::kDeferred}};
const std::map<std::string, Primitive> kPrimitives{{"mesh", Primitive::kMesh},
                                                   {"splat", Primitive::kSplat}};
const std::map<std::string, BlendWeight> kBlends{{"cosine", BlendWeight::kCosine},
                                                 {"exponential", BlendWeight::kExponential},
                                                 {"angle", BlendWeight::kAngle},
                                                 {"inverse-angle", BlendWeight::kInverseAngle},
                                                 {"k-nearest", BlendWeight::kKNearest}};

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

}  // namespace

std::shared_ptr<RenderOptions> AddRenderOptions(CLI::App& command) {
  auto shared = std::make_shared<RenderOptions>();
  RenderOptions& options = *shared;
  AddChoice(command, "--method", options.method, kMethods,
            "Algorithm [deferred; with --primitive splat two-pass]");
  AddChoice(command, "--primitive", options.primitive, kPrimitives,
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
          "--max-angle",
          [&options](double degrees) { options.max_angle_rad = degrees * std::numbers::pi / 180; },
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
                  "deferred: how far the reduced mesh may lie off the depth, in pixels of "
                  "disparity [0.5]")
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
