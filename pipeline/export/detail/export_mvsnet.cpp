// Cameras, pairs and depth as MVSNet (Yao et al. 2018) and its successors read them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "dtr/base/durable.h"
#include "dtr/base/files.h"
#include "dtr/base/lower_case.h"
#include "dtr/io/formats/pfm.h"
#include "dtr/io/image_io.h"
#include "dtr/render/geometry.h"
#include "pipeline/export/detail/coloured_points.h"
#include "pipeline/export/detail/common.h"
#include "pipeline/export/detail/depth_file.h"
#include "pipeline/export/detail/fuse.h"
#include "pipeline/export/export.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kDepthNum = 192;  // hypotheses, as MVSNet's own converter writes
constexpr size_t kMostPairs = 10;

fs::path Numbered(const fs::path& folder, size_t number, const char* end) {
  fs::create_directories(folder);
  return folder / fmt::format("{:08}{}", number, end);
}

std::string CamText(const View& view) {
  std::string text = "extrinsic\n";
  const Eigen::Matrix3d r = view.cam_from_world.rotation.toRotationMatrix();
  const Eigen::Vector3d& t = view.cam_from_world.translation;
  for (int i = 0; i < 3; ++i) {
    text += fmt::format("{} {} {} {}\n", r(i, 0), r(i, 1), r(i, 2), t[i]);
  }
  text += "0 0 0 1\n\nintrinsic\n";
  const PinholeCamera& camera = view.camera;
  text += fmt::format("{} 0 {}\n0 {} {}\n0 0 1\n\n", camera.fx_px(), camera.cx_px(), camera.fy_px(),
                      camera.cy_px());
  return text + fmt::format("{} {} {} {}\n", view.near_z,
                            (view.far_z - view.near_z) / (kDepthNum - 1), kDepthNum, view.far_z);
}

// The weight of a point for two views that see it under an angle (Yao et al. 2018, eq. in
// sec. 5.1).
double PairWeight(double angle_deg) {
  constexpr double kBest = 5, kBelow = 1, kAbove = 10;
  const double width = angle_deg <= kBest ? kBelow : kAbove;
  return std::exp(-(angle_deg - kBest) * (angle_deg - kBest) / (2 * width * width));
}

// `numbers`: of the views that are written, in their order.
std::string PairsText(SurfaceViews& surfaces, const std::vector<int>& numbers) {
  const std::vector<View>& views = surfaces.set().frames.front().views;
  std::string text = fmt::format("{}\n", numbers.size());
  for (size_t i = 0; i < numbers.size(); ++i) {
    const std::vector<Eigen::Vector3d> points = CoarsePoints(*surfaces.Get(numbers[i]));
    const Eigen::Vector3d centre = views[static_cast<size_t>(numbers[i])].CenterInWorld();
    std::vector<std::pair<double, size_t>> scores;  // negative
    for (size_t j = 0; j < numbers.size(); ++j) {
      if (j == i) continue;
      const View& other = views[static_cast<size_t>(numbers[j])];
      double score = 0;
      for (const Eigen::Vector3d& p : points) {
        const auto pixel = other.camera.PixelFromCam(other.cam_from_world * p);
        if (!pixel || !other.camera.Contains(*pixel)) continue;
        score += PairWeight(AngleBetween(centre - p, other.CenterInWorld() - p) * 180 / M_PI);
      }
      if (score > 0) scores.emplace_back(-score, j);
    }
    std::sort(scores.begin(), scores.end());
    if (scores.size() > kMostPairs) scores.resize(kMostPairs);
    text += fmt::format("{}\n{}", i, scores.size());
    for (const auto& [score, j] : scores) text += fmt::format(" {} {:.4f}", j, -score);
    text += "\n";
  }
  return text;
}

void WriteJpg(const ExportRequest& request, const View& view, const fs::path& file) {
  const fs::path stored = request.set / view.image_file->path;
  if (LowerExtension(stored) == ".jpg") {
    CopyFileAtomically(stored, file);
  } else {
    io::WriteImage(file, ImageOf(request.set, view));
  }
}

Json Sidecar(const DtrSet& set) {
  Json json = SetFacts(set);
  json["pixels"] =
      "the centre of pixel (i, j) is (i + 0.5, j + 0.5), as MVSNet's own sampling has it; for "
      "programs whose first pixel has its centre at 0 subtract 0.5 from cx and cy";
  json["depth"] = "z in scene units, 0 a hole; depth_scale: the map is 1 / so much of the image";
  json["views"] = Json::array();
  return json;
}

}  // namespace

ExportReport ExportMvsnet(const ExportRequest& request, Progress& progress) {
  return ExportFolder(request, "mvsnet", progress, [&](const DtrSet& set, const fs::path& folder) {
    SurfaceViews surfaces(request.set, set, SurfaceOptions(request));
    Json sidecar = Sidecar(set);
    ForEachDepth(surfaces, progress, [&](size_t i, const View& view, const SurfaceView& surface) {
      WriteJpg(request, view, Numbered(folder / "images", i, ".jpg"));
      WriteFileAtomically(Numbered(folder / "cams", i, "_cam.txt"), CamText(view));
      const DepthPlanes planes = PlanesOf(surface, DepthKind::kPlaneZ);
      io::WritePfm(Numbered(folder / "depths", i, ".pfm"), planes.depth.grid());
      io::WritePfm(Numbered(folder / "depths", i, "_sigma.pfm"), planes.sigma);
      sidecar["views"].push_back(
          {{"number", i}, {"photo", view.name}, {"depth_scale", view.depth_scale}});
    });
    const std::vector<int> numbers = surfaces.WithDepth();
    WriteFileAtomically(folder / "pair.txt", PairsText(surfaces, numbers));
    WriteJson(folder / "dtr.json", sidecar);
    return ExportReport{.images = numbers.size(), .depth_maps = numbers.size()};
  });
}

}  // namespace dtr::pipeline
