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
#include <nlohmann/json.hpp>

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

DtrSet ReadSet(const std::filesystem::path& folder) {
  nlohmann::json json;
  std::ifstream(folder / "cameras.json") >> json;
  DtrSet set;
  set.frames.resize(1);
  for (const auto& entry : json.at("views")) {
    View view;
    view.id = view.name = entry.at("name").get<std::string>();
    view.camera = dtr::PinholeCamera(entry.at("width"), entry.at("height"), entry.at("fx"),
                                     entry.at("fy"), entry.at("cx"), entry.at("cy"));
    Eigen::Matrix3d rotation;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) rotation(r, c) = entry.at("cam_from_world")[r][c];
      view.cam_from_world.translation[r] = entry.at("cam_from_world")[r][3];
    }
    view.cam_from_world.rotation = Eigen::Quaterniond(rotation).normalized();
    view.image = ReadGrid<std::uint8_t>(folder / "images" / view.name, 3, OIIO::TypeDesc::UINT8);
    view.depth = dtr::DepthImage(view.camera.width_px(), view.camera.height_px());
    view.depth.grid() = ReadGrid<float>(folder / "depth" / entry.at("depth").get<std::string>(), 1,
                                        OIIO::TypeDesc::FLOAT);
    set.frames[0].views.push_back(std::move(view));
  }
  dtr::FinishGeometry(set);
  return set;
}

/// 8-bit sRGB, over the pixels some view saw.
double CoveredPsnr(const dtr::RenderResult& result, const dtr::ImageRgb8& truth) {
  double sum = 0, count = 0;
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      if (result.coverage(x, y) == 0) continue;
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

void Report(const DtrSet& set, const std::string& label, const dtr::RenderOptions& options,
            int step, const std::filesystem::path& out) {
  double psnr = 0, coverage = 0, seconds = 0;
  int count = 0;
  const std::vector<View>& views = set.frames[0].views;
  for (size_t i = 0; i < views.size(); i += static_cast<size_t>(step)) {
    const std::string name = views[i].name;
    const dtr::RenderScene scene = dtr::MakeRenderScene(set, std::span(&name, 1));
    const auto start = std::chrono::steady_clock::now();
    const dtr::RenderResult result =
        dtr::cpu::Render(scene, views[i].camera, views[i].cam_from_world, options);
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    psnr += CoveredPsnr(result, views[i].image);
    coverage += CoverageOfTruth(result, views[i].depth);
    ++count;
    if (out.empty()) continue;
    const std::string stem = std::filesystem::path(name).stem().string();
    WriteImage(out / (stem + "_" + label + ".png"), result.image);
    dtr::Grid<std::uint8_t> counts = result.view_count;
    for (auto& value : counts.data()) value = static_cast<std::uint8_t>(value * 30);
    WriteImage(out / (stem + "_" + label + "_count.png"), counts);
  }
  std::printf("%-28s psnr_covered_db %6.2f  coverage_of_truth %.4f  s_per_frame %.2f\n",
              label.c_str(), psnr / count, coverage / count, seconds / count);
  std::fflush(stdout);
}

int Main(int argc, char** argv) {
  if (argc < 2) throw dtr::UsageError("render_report FOLDER [OUT [VIEW-STEP]]");
  const DtrSet set = ReadSet(argv[1]);
  const std::filesystem::path out = argc > 2 ? argv[2] : "";
  const int step = argc > 3 ? std::stoi(argv[3]) : 1;
  dtr::RenderOptions base;
  base.threads = 1;
  Report(set, "default", base, step, out);
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
    Report(set, label, options, step, {});
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
