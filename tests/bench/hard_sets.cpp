// hard_sets list | make SET FOLDER | judge MODEL CAMERAS_JSON: sets of photos that structure from
// motion fails at (datasets/hard), and a COLMAP model of one against its exact cameras. `judge`
// prints the cells of a Markdown row: photos with a camera; median and largest rotation error, deg,
// after the turn that suits the rotations best; RMS distance of the centres as a share of that of
// the true ones from their mean, %, after the shift and scale that fit best; error of the focal
// length that is furthest off, %.
#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <iostream>
#include <map>

#include "calib/colmap/model_io.h"
#include "calib/similarity.h"
#include "datasets/hard/hard_sets.h"
#include "dtr/base/error.h"
#include "dtr/io/formats/cameras_json.h"

namespace {

using namespace dtr;  // NOLINT
using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Cameras {
  std::vector<Matrix3d> found, exact;  // cam_from_world
  std::vector<Vector3d> found_centres, exact_centres;
  double focal_share = 0;

  Cameras(const calib::SfmModel& model, const io::CameraList& list) {
    std::map<std::string, const io::NamedCamera*> named;
    for (const io::NamedCamera& camera : list.cameras) named[camera.name] = &camera;
    for (const calib::SfmImage& image : model.images) {
      const auto at = named.find(std::filesystem::path(image.name).filename().string());
      if (at == named.end()) throw Error(image.name + ": expected photos of the set only");
      found.push_back(image.cam_from_world.rotation.toRotationMatrix());
      exact.push_back(at->second->cam_from_world.rotation.toRotationMatrix());
      found_centres.push_back(image.cam_from_world.TargetOriginInSource());
      exact_centres.push_back(at->second->cam_from_world.TargetOriginInSource());
      const double focal_px = model.cameras.at(image.camera_id).params.front();
      const double share = focal_px / at->second->camera.fx_px() - 1;
      if (std::abs(share) > std::abs(focal_share)) focal_share = share;
    }
  }
};

std::vector<double> AnglesDeg(const Cameras& cameras, const Matrix3d& exact_from_found) {
  std::vector<double> angles;
  for (size_t i = 0; i < cameras.found.size(); ++i) {
    const Matrix3d off = cameras.exact[i] * exact_from_found * cameras.found[i].transpose();
    angles.push_back(Eigen::AngleAxisd(off).angle() * 180 / M_PI);
  }
  std::sort(angles.begin(), angles.end());
  return angles;
}

double Sum(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum;
}

// The chordal mean, or the turn by one camera where that leaves clearly less: a mean of two groups
// suits neither.
Matrix3d BestTurn(const Cameras& cameras) {
  Matrix3d sum = Matrix3d::Zero();
  for (size_t i = 0; i < cameras.found.size(); ++i) {
    sum += cameras.exact[i].transpose() * cameras.found[i];
  }
  const Eigen::JacobiSVD<Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  Matrix3d best = svd.matrixU() * Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
  for (size_t i = 0; i < cameras.found.size(); ++i) {
    const Matrix3d turn = cameras.exact[i].transpose() * cameras.found[i];
    if (Sum(AnglesDeg(cameras, turn)) < 0.7 * Sum(AnglesDeg(cameras, best))) best = turn;
  }
  return best;
}

double PositionShare(const Cameras& cameras, const Matrix3d& exact_from_found) {
  const Vector3d mean = calib::MeanOf(cameras.exact_centres);
  const Vector3d found_mean = exact_from_found * calib::MeanOf(cameras.found_centres);
  double across = 0, squares = 0, spread = 0, error = 0;
  const auto found = [&](size_t i) -> Vector3d {
    return exact_from_found * cameras.found_centres[i] - found_mean;
  };
  for (size_t i = 0; i < cameras.found.size(); ++i) {
    across += found(i).dot(cameras.exact_centres[i] - mean);
    squares += found(i).squaredNorm();
    spread += (cameras.exact_centres[i] - mean).squaredNorm();
  }
  const double scale = squares > 0 ? across / squares : 0;
  for (size_t i = 0; i < cameras.found.size(); ++i) {
    error += (scale * found(i) - (cameras.exact_centres[i] - mean)).squaredNorm();
  }
  return spread > 0 ? std::sqrt(error / spread) : 0;
}

int Judge(const char* model, const char* truth) {
  const Cameras cameras(colmap::ReadModel(model), io::ReadCamerasJson(truth));
  if (cameras.found.size() < 2) throw Error("expected a model of two photos or more");
  const Matrix3d turn = BestTurn(cameras);
  const auto angles = AnglesDeg(cameras, turn);
  fmt::print("{} | {:.3f} | {:.2f} | {:.2f} | {:+.1f}\n", angles.size(), angles[angles.size() / 2],
             angles.back(), 100 * PositionShare(cameras, turn), 100 * cameras.focal_share);
  return 0;
}

int Run(int argc, char** argv) {
  const std::string task = argc > 1 ? argv[1] : "";
  if (task == "judge" && argc == 4) return Judge(argv[2], argv[3]);
  const auto sets = datasets::HardSets();
  for (const datasets::HardSet& set : sets) {
    if (task == "list") fmt::print("{}\t{}\n", set.name, set.what);
    if (task != "make" || argc != 4 || set.name != argv[2]) continue;
    datasets::WriteHardSet(set, argv[3]);
    return 0;
  }
  if (task == "list") return 0;
  throw UsageError("expected: hard_sets list | make SET FOLDER | judge MODEL CAMERAS_JSON");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "hard_sets: " << error.what() << "\n";
    return 2;
  }
}
