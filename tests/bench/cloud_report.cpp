// cloud_report: an exported cloud or mesh (.ply) against true depth. The truth is a set of the same
// scene, with views that have the names of the cloud's set, to which the cloud's world is fitted by
// a similarity of camera centres. docs/EXPORT.md has the figures.
//
//   cloud_report SET.dtr CLOUD.ply TRUTH.dtr
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "dtr/io/set_io.h"
#include "tests/pipeline/read_ply.h"

namespace {

constexpr double kSameDepth = 0.01, kFineDepth = 0.003;  // of the depth
constexpr double kReachPx = 1.5;  // around a point that counts as covered by it

std::string StemOf(const dtr::View& view) {
  return std::filesystem::path(view.name).stem().string();
}

// Umeyama's fit of the views that both have.
Eigen::Matrix4d TruthFromSet(const dtr::DtrSet& set, const dtr::DtrSet& truth) {
  std::map<std::string, Eigen::Vector3d> true_centres;
  for (const dtr::View& view : truth.frames.at(0).views) {
    true_centres[StemOf(view)] = view.CenterInWorld();
  }
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> both;
  for (const dtr::View& view : set.frames.at(0).views) {
    const auto found = true_centres.find(StemOf(view));
    if (found != true_centres.end()) {
      both.emplace_back(view.CenterInWorld() + set.world_origin, found->second);
    }
  }
  if (both.size() < 3) throw std::runtime_error("the sets have fewer than 3 views in common");
  Eigen::Matrix3Xd from(3, both.size()), to(3, both.size());
  for (size_t i = 0; i < both.size(); ++i) {
    from.col(static_cast<Eigen::Index>(i)) = both[i].first;
    to.col(static_cast<Eigen::Index>(i)) = both[i].second;
  }
  return Eigen::umeyama(from, to);
}

class TrueViews {
 public:
  explicit TrueViews(const dtr::DtrSet& truth) : views_(truth.frames.at(0).views) {
    for (const dtr::View& view : views_) {
      covered_.emplace_back(view.depth.width(), view.depth.height());
    }
  }

  // The least error of its depth in any view that shows the place, as a share of depth; negative
  // where none does. Marks what it covers.
  double ErrorOf(const Eigen::Vector3d& p) {
    double least = -1;
    for (size_t k = 0; k < views_.size(); ++k) {
      const Eigen::Vector3d in_cam = views_[k].cam_from_world * p;
      const dtr::PinholeCamera camera = views_[k].DepthCamera();
      const auto pixel = camera.PixelFromCam(in_cam);
      if (!pixel || !camera.Contains(*pixel)) continue;
      const double z = views_[k].depth(static_cast<int>(pixel->x()), static_cast<int>(pixel->y()));
      if (!(z > 0)) continue;
      const double error = std::abs(in_cam.z() / z - 1);
      if (least < 0 || error < least) least = error;
      Cover(k, *pixel, in_cam.z());
    }
    return least;
  }

  double Completeness() const {
    double covered = 0, all = 0;
    for (size_t k = 0; k < views_.size(); ++k) {
      const auto& depth = views_[k].depth.grid().data();
      for (size_t i = 0; i < depth.size(); ++i) {
        if (!(depth[i] > 0)) continue;
        ++all;
        covered += covered_[k].data()[i] != 0;
      }
    }
    return covered / all;
  }

 private:
  void Cover(size_t k, const Eigen::Vector2d& pixel, double z) {
    const int left = static_cast<int>(pixel.x()), top = static_cast<int>(pixel.y());
    for (int y = top - 2; y <= top + 2; ++y) {
      for (int x = left - 2; x <= left + 2; ++x) {
        if (!covered_[k].Contains(x, y)) continue;
        if (std::hypot(x + 0.5 - pixel.x(), y + 0.5 - pixel.y()) > kReachPx) continue;
        const double there = views_[k].depth(x, y);
        if (there > 0 && std::abs(z / there - 1) < kSameDepth) covered_[k](x, y) = 1;
      }
    }
  }

  const std::vector<dtr::View>& views_;
  std::vector<dtr::Mask> covered_;
};

int Run(const std::string& folder, const std::string& file, const std::string& truth_folder) {
  const dtr::testing::Ply ply = dtr::testing::ReadPly(file);
  dtr::io::LoadOptions load;
  load.images = false;
  const dtr::DtrSet truth = dtr::io::LoadSet(truth_folder, load);
  const Eigen::Matrix4d fit = TruthFromSet(dtr::io::ReadSet(folder), truth);
  TrueViews views(truth);
  double judged = 0, same = 0, fine = 0;
  for (size_t i = 0; i < ply.count; ++i) {
    const Eigen::Vector3d p(ply["x"][i], ply["y"][i], ply["z"][i]);
    const double error = views.ErrorOf((fit * p.homogeneous()).head<3>());
    if (error < 0) continue;
    ++judged;
    same += error < kSameDepth;
    fine += error < kFineDepth;
  }
  std::printf(
      "%zu points, %.0f where true depth is known: %.1f %% within 1 %% of it, %.1f %% within "
      "0.3 %%; completeness %.1f %%\n",
      ply.count, judged, 100 * same / judged, 100 * fine / judged, 100 * views.Completeness());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: cloud_report SET.dtr CLOUD.ply TRUTH.dtr\n");
    return 2;
  }
  try {
    return Run(argv[1], argv[2], argv[3]);
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "cloud_report: %s\n", failure.what());
    return 1;
  }
}
