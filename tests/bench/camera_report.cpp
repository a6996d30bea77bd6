// camera_report MODEL TRUTH.json: errors of a COLMAP model's cameras against true ones of the same
// photos, by their names, as a line of JSON.
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "calib/colmap/model_io.h"
#include "calib/similarity.h"
#include "dtr/base/error.h"
#include "dtr/io/formats/cameras_json.h"

namespace {

using namespace dtr;         // NOLINT
using namespace dtr::calib;  // NOLINT

/// Cameras that both have, photo by photo.
struct Cameras {
  std::vector<Pose> found, exact;  // cam from world
};

Cameras CamerasOfBoth(const SfmModel& model, const std::filesystem::path& truth_file) {
  std::map<std::string, Pose> truth;
  for (const io::NamedCamera& named : io::ReadCamerasJson(truth_file).cameras) {
    truth[named.name] = named.cam_from_world;
  }
  Cameras both;
  for (const SfmImage& image : model.images) {
    const auto exact = truth.find(image.name);
    if (exact == truth.end()) continue;
    both.found.push_back(image.cam_from_world);
    both.exact.push_back(exact->second);
  }
  if (both.found.size() < 3) throw Error("fewer than three photos of the model have true cameras");
  return both;
}

std::vector<Eigen::Vector3d> Centres(const std::vector<Pose>& poses) {
  std::vector<Eigen::Vector3d> centres;
  for (const Pose& pose : poses) centres.push_back(pose.TargetOriginInSource());
  return centres;
}

/// Median over the cameras of the distance to the nearest other one.
double MedianBaseline(const std::vector<Eigen::Vector3d>& centres) {
  std::vector<double> nearest;
  for (const Eigen::Vector3d& a : centres) {
    double least = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& b : centres) {
      if (&a != &b) least = std::min(least, (a - b).norm());
    }
    nearest.push_back(least);
  }
  std::ranges::sort(nearest);
  return nearest[nearest.size() / 2];
}

/// Rotation of the world with which rotations agree best (chordal mean).
Eigen::Quaterniond BestRotation(const Cameras& cameras) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < cameras.found.size(); ++i) {
    sum += (cameras.found[i].rotation.conjugate() * cameras.exact[i].rotation).toRotationMatrix();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * svd.matrixV().transpose()));
}

void Report(const char* model_folder, const char* truth_file) {
  constexpr double kDegrees = 180 / M_PI;
  const Cameras cameras = CamerasOfBoth(colmap::ReadModel(model_folder), truth_file);
  const std::vector<Eigen::Vector3d> found = Centres(cameras.found), exact = Centres(cameras.exact);
  const Similarity exact_from_found = AlignPoints(found, exact);
  const Eigen::Quaterniond found_from_exact = BestRotation(cameras);
  double by_centres = 0, by_rotations = 0, position = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    const Eigen::Quaterniond& truth = cameras.exact[i].rotation;
    by_centres +=
        exact_from_found.CamFromB(cameras.found[i]).rotation.angularDistance(truth) * kDegrees;
    by_rotations +=
        (cameras.found[i].rotation * found_from_exact).angularDistance(truth) * kDegrees;
    position += (exact_from_found * found[i] - exact[i]).norm();
  }
  const auto count = static_cast<double>(found.size());
  const nlohmann::ordered_json line = {
      {"photos", found.size()},
      {"rotation_deg_aligned_by_centres", by_centres / count},
      {"rotation_deg_aligned_by_rotations", by_rotations / count},
      {"position_share_of_baseline", position / count / MedianBaseline(exact)}};
  std::cout << line.dump() << "\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: camera_report MODEL TRUTH.json\n";
    return 2;
  }
  try {
    Report(argv[1], argv[2]);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "camera_report: " << error.what() << "\n";
    return 1;
  }
}
