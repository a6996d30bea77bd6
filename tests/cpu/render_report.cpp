// render_report: leave-one-out PSNR and time of the reference renderer on a folder with
// cameras.json, images/ and depth/ (exact float depth), as data/plaza has. One line per
// configuration.
//
//   render_report ../shared/data/plaza [out-folder [view-step]]
//
// With an out-folder it writes the pictures of the default configuration to look at.
#include <OpenImageIO/imageio.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "dtr/base/error.h"
#include "dtr/cpu/renderer.h"
#include "dtr/render/geometry.h"

namespace {

using dtr::DtrSet;
using dtr::View;

template <typename T>
dtr::Grid<T> ReadGrid(const std::filesystem::path& path, int channels, OIIO::TypeDesc type) {
  const auto file = OIIO::ImageInput::open(path.string());
  if (!file) throw dtr::Error(path.string() + ": " + OIIO::geterror());
  dtr::Grid<T> grid(file->spec().width, file->spec().height, channels);
  if (!file->read_image(0, 0, 0, channels, type, grid.data().data())) {
    throw dtr::Error(path.string() + ": " + file->geterror());
  }
  return grid;
}

void WriteImage(const std::filesystem::path& path, const dtr::Grid<std::uint8_t>& image) {
  auto file = OIIO::ImageOutput::create(path.string());
  const OIIO::ImageSpec spec(image.width(), image.height(), image.channels(),
                             OIIO::TypeDesc::UINT8);
  if (!file || !file->open(path.string(), spec) ||
      !file->write_image(OIIO::TypeDesc::UINT8, image.data().data())) {
    throw dtr::Error(path.string() + ": cannot write");
  }
  file->close();
}

View ReadView(const std::filesystem::path& folder, const std::string& name,
              const dtr::PinholeCamera& camera, const dtr::Pose& cam_from_world) {
  View view;
  view.id = view.name = name;
  view.camera = camera;
  view.cam_from_world = cam_from_world;
  view.image = ReadGrid<std::uint8_t>(folder / "images" / name, 3, OIIO::TypeDesc::UINT8);
  view.depth = dtr::DepthImage(camera.width_px(), camera.height_px());
  view.depth.grid() =
      ReadGrid<float>(folder / "depth" / std::filesystem::path(name).replace_extension(".exr"), 1,
                      OIIO::TypeDesc::FLOAT);
  return view;
}

std::vector<View> ReadColmapText(const std::filesystem::path& folder) {
  std::map<int, dtr::PinholeCamera> cameras;
  std::string line, model, name;
  for (std::ifstream file(folder / "sparse" / "cameras.txt"); std::getline(file, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream fields(line);
    int id, width, height;
    double fx, fy, cx, cy;
    if (!(fields >> id >> model >> width >> height >> fx >> fy >> cx >> cy) || model != "PINHOLE") {
      throw dtr::Error("cameras.txt: expected PINHOLE cameras");
    }
    cameras.emplace(id, dtr::PinholeCamera(width, height, fx, fy, cx, cy));
  }
  std::vector<View> views;
  bool is_pose = true;
  for (std::ifstream file(folder / "sparse" / "images.txt"); std::getline(file, line);) {
    if (line.starts_with('#')) continue;
    if (is_pose) {
      std::istringstream fields(line);
      int image_id, camera_id;
      dtr::Pose pose;
      fields >> image_id >> pose.rotation.w() >> pose.rotation.x() >> pose.rotation.y() >>
          pose.rotation.z() >> pose.translation.x() >> pose.translation.y() >>
          pose.translation.z() >> camera_id >> name;
      pose.rotation.normalize();
      views.push_back(ReadView(folder, name, cameras.at(camera_id), pose));
    }
    is_pose = !is_pose;
  }
  return views;
}

std::vector<View> ReadCamerasJson(const std::filesystem::path& folder) {
  std::vector<View> views;
  nlohmann::json json;
  std::ifstream(folder / "cameras.json") >> json;
  for (const auto& entry : json.at("views")) {
    Eigen::Matrix3d rotation;
    dtr::Pose pose;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) rotation(r, c) = entry.at("cam_from_world")[r][c];
      pose.translation[r] = entry.at("cam_from_world")[r][3];
    }
    pose.rotation = Eigen::Quaterniond(rotation).normalized();
    const dtr::PinholeCamera camera(entry.at("width"), entry.at("height"), entry.at("fx"),
                                    entry.at("fy"), entry.at("cx"), entry.at("cy"));
    views.push_back(ReadView(folder, entry.at("name"), camera, pose));
  }
  return views;
}

DtrSet ReadSet(const std::filesystem::path& folder) {
  DtrSet set;
  set.frames.resize(1);
  set.frames[0].views = std::filesystem::exists(folder / "cameras.json") ? ReadCamerasJson(folder)
                                                                         : ReadColmapText(folder);
  dtr::FinishGeometry(set);
  return set;
}

/// 8-bit sRGB, over the pixels where `counts` says so.
template <typename Predicate>
double Psnr(const dtr::RenderResult& result, const dtr::ImageRgb8& truth, Predicate counts) {
  double sum = 0, count = 0;
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      if (!counts(x, y)) continue;
      for (int c = 0; c < 3; ++c) {
        const double difference = double{1} * result.image(x, y, c) - truth(x, y, c);
        sum += difference * difference;
        ++count;
      }
    }
  }
  return 10 * std::log10(255.0 * 255.0 * count / sum);
}

/// Share of the pixels with true depth that were covered.
double CoverageOfTruth(const dtr::RenderResult& result, const dtr::DepthImage& truth) {
  double seen = 0, count = 0;
  for (size_t i = 0; i < truth.grid().data().size(); ++i) {
    if (dtr::DepthImage::IsHole(truth.grid().data()[i])) continue;
    ++count;
    seen += result.coverage.data()[i] != 0;
  }
  return seen / count;
}

struct Scope {
  int step = 1;
  std::string name;
  std::filesystem::path out;
};

void Report(const DtrSet& set, const std::string& label, dtr::RenderOptions options,
            const Scope& scope, bool write) {
  double covered = 0, valid = 0, frame = 0, coverage = 0, seconds = 0;
  int count = 0;
  options.fill_holes = true;
  const std::vector<View>& views = set.frames[0].views;
  for (size_t i = 0; i < views.size(); i += static_cast<size_t>(scope.step)) {
    const View& view = views[i];
    if (!scope.name.empty() && view.name != scope.name) continue;
    const dtr::RenderScene scene = dtr::MakeRenderScene(set, std::span(&view.name, 1));
    const auto start = std::chrono::steady_clock::now();
    const dtr::RenderResult result =
        dtr::cpu::Render(scene, view.camera, view.cam_from_world, options);
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    covered += Psnr(result, view.image, [&](int x, int y) { return result.coverage(x, y) != 0; });
    valid += Psnr(result, view.image,
                  [&](int x, int y) { return !dtr::DepthImage::IsHole(view.depth(x, y)); });
    frame += Psnr(result, view.image, [](int, int) { return true; });
    coverage += CoverageOfTruth(result, view.depth);
    ++count;
    if (!write || scope.out.empty()) continue;
    const std::string stem = std::filesystem::path(view.name).stem().string();
    WriteImage(scope.out / (stem + "_filled.png"), result.image);
    dtr::ImageRgb8 image = result.image;
    for (size_t p = 0; p < result.coverage.data().size(); ++p) {
      if (result.coverage.data()[p] == 0) std::fill_n(&image.data()[3 * p], 3, std::uint8_t{0});
    }
    WriteImage(scope.out / (stem + ".png"), image);
  }
  std::printf(
      "%-18s psnr_covered_db %6.2f  on_true_depth_db %6.2f  psnr_db %6.2f  "
      "coverage_of_truth %.4f  s_per_frame %.2f\n",
      label.c_str(), covered / count, valid / count, frame / count, coverage / count,
      seconds / count);
  std::fflush(stdout);
}

void Set(dtr::RenderOptions& options, const std::string& key, double value) {
  const int whole = static_cast<int>(value);
  if (key == "views")
    options.views = whole;
  else if (key == "exponent")
    options.exponent = value;
  else if (key == "falloff")
    options.falloff = value;
  else if (key == "blend")
    options.blend = static_cast<dtr::BlendWeight>(whole);
  else if (key == "blend_k")
    options.blend_k = whole;
  else if (key == "splat")
    options.primitive = static_cast<dtr::Primitive>(whole);
  else if (key == "method")
    options.method = static_cast<dtr::RenderMethod>(whole);
  else if (key == "delta")
    options.delta_px = value;
  else if (key == "break")
    options.depth_break_px = value;
  else if (key == "resolution")
    options.resolution = whole;
  else if (key == "linear")
    options.blend_in_linear_light = value != 0;
  else
    throw dtr::UsageError(key + ": not an option of render_report");
}

int Main(int argc, char** argv) {
  if (argc < 2) throw dtr::UsageError("render_report FOLDER [OUT [STEP | NAME]]");
  const DtrSet set = ReadSet(argv[1]);
  Scope scope;
  if (argc > 2) scope.out = argv[2];
  if (argc > 3 && std::isdigit(static_cast<unsigned char>(*argv[3])) &&
      std::string(argv[3]).find('.') == std::string::npos) {
    scope.step = std::stoi(argv[3]);
  } else if (argc > 3) {
    scope.name = argv[3];
  }
  dtr::RenderOptions base;
  base.threads = 1;
  std::string given;
  for (int i = 4; i < argc; ++i) {
    const std::string argument = argv[i];
    const size_t equals = argument.find('=');
    if (equals == std::string::npos) throw dtr::UsageError(argument + ": expected KEY=NUMBER");
    Set(base, argument.substr(0, equals), std::stod(argument.substr(equals + 1)));
    given += (given.empty() ? "" : " ") + argument;
  }
  Report(set, given.empty() ? "default" : given, base, scope, true);
  if (!given.empty()) return 0;
  using Change = std::function<void(dtr::RenderOptions&)>;
  const std::pair<const char*, Change> changes[] = {
      {"views 1", [](auto& o) { o.views = 1; }},
      {"views 2", [](auto& o) { o.views = 2; }},
      {"views 4", [](auto& o) { o.views = 4; }},
      {"splat", [](auto& o) { o.primitive = dtr::Primitive::kSplat; }},
      {"exponential 8", [](auto& o) { o.blend = dtr::BlendWeight::kExponential; }},
      {"angle", [](auto& o) { o.blend = dtr::BlendWeight::kAngle; }},
      {"inverse-angle 3", [](auto& o) { o.blend = dtr::BlendWeight::kInverseAngle; }},
      {"k-nearest 3", [](auto& o) { o.blend = dtr::BlendWeight::kKNearest; }},
      {"srgb", [](auto& o) { o.blend_in_linear_light = false; }},
      {"delta 0.5", [](auto& o) { o.delta_px = 0.5; }},
      {"delta 2", [](auto& o) { o.delta_px = 2; }},
      {"depth-break 1", [](auto& o) { o.depth_break_px = 1; }},
      {"depth-break 4", [](auto& o) { o.depth_break_px = 4; }},
      {"resolution 2", [](auto& o) { o.resolution = 2; }},
  };
  for (const auto& [label, change] : changes) {
    dtr::RenderOptions options = base;
    change(options);
    Report(set, label, options, scope, false);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Main(argc, argv);
  } catch (const dtr::UsageError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
