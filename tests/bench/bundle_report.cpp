// bundle_report MODEL [--truth DIR] [--known-lens]: what bundle adjustment makes of a COLMAP model,
// beside the model as it is. DIR holds NAME.camera files (Strecha et al. 2008) of images twice as
// large per axis. Errors after the best similarity between the camera centres: mean angle of the
// rotations (also by the turn that suits them best), mean distance of the centres as a share of the
// median neighbour baseline.
#include <time.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <map>

#include "calib/bundle/refine.h"
#include "calib/colmap/model_io.h"
#include "calib/similarity.h"
#include "dtr/base/error.h"

namespace {

namespace fs = std::filesystem;
using namespace dtr;         // NOLINT
using namespace dtr::calib;  // NOLINT

double CpuSeconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Truth {
  LensCamera lens;
  std::map<std::string, Pose> cam_from_world;
};

Truth ReadTruth(const fs::path& folder) {
  Truth truth;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::ifstream file(entry.path());
    double v[26];
    for (double& x : v) file >> x;
    if (!file) throw Error(entry.path().string() + ": expected 26 numbers");
    Eigen::Matrix3d world_from_cam;
    for (int i = 0; i < 9; ++i) world_from_cam(i / 3, i % 3) = v[12 + i];
    Pose pose;
    pose.rotation = Eigen::Quaterniond(Eigen::Matrix3d(world_from_cam.transpose())).normalized();
    pose.translation = -(pose.rotation * Eigen::Vector3d(v[21], v[22], v[23]));
    truth.cam_from_world[entry.path().stem().string()] = pose;
    // Half the size per axis; the truth's origin is the outer corner of the first pixel.
    truth.lens = {LensModel::kPinhole,
                  static_cast<int>(v[24]) / 2,
                  static_cast<int>(v[25]) / 2,
                  {v[0] / 2, v[4] / 2, v[2] / 2, v[5] / 2}};
  }
  return truth;
}

void PrintErrors(const SfmModel& model, const Truth& truth) {
  std::vector<Eigen::Vector3d> ours, theirs;
  std::vector<Pose> poses, true_poses;
  for (const SfmImage& image : model.images) {
    const auto found = truth.cam_from_world.find(image.name);
    if (found == truth.cam_from_world.end()) continue;
    poses.push_back(image.cam_from_world);
    true_poses.push_back(found->second);
    ours.push_back(poses.back().TargetOriginInSource());
    theirs.push_back(true_poses.back().TargetOriginInSource());
  }
  const Similarity world_from_ours = AlignPoints(ours, theirs);
  std::vector<double> baselines;
  for (size_t i = 0; i < theirs.size(); ++i) {
    double nearest = 1e300;
    for (size_t j = 0; j < theirs.size(); ++j) {
      if (i != j) nearest = std::min(nearest, (theirs[i] - theirs[j]).norm());
    }
    baselines.push_back(nearest);
  }
  std::sort(baselines.begin(), baselines.end());
  const double baseline = baselines[baselines.size() / 2];
  double turn = 0, shift = 0;
  for (size_t i = 0; i < ours.size(); ++i) {
    const Pose aligned = world_from_ours.CamFromB(poses[i]);
    turn += aligned.rotation.angularDistance(true_poses[i].rotation) * 180 / M_PI;
    shift += (world_from_ours * ours[i] - theirs[i]).norm();
  }
  // Rotations against rotations: the world turned so that they agree best (chordal mean), which the
  // centres, that err by themselves, have no part in.
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < ours.size(); ++i) {
    sum += (poses[i].rotation.conjugate() * true_poses[i].rotation).toRotationMatrix();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Quaterniond ours_from_theirs(
      Eigen::Matrix3d(svd.matrixU() * svd.matrixV().transpose()));
  double own_turn = 0;
  for (size_t i = 0; i < ours.size(); ++i) {
    own_turn +=
        (poses[i].rotation * ours_from_theirs).angularDistance(true_poses[i].rotation) * 180 / M_PI;
  }
  const auto count = static_cast<double>(ours.size());
  std::printf(" | %.4f | %.4f | %.3f", turn / count, own_turn / count,
              100 * shift / count / baseline);
}

void PrintLens(const SfmModel& model) {
  std::printf(" |");
  for (const double p : model.cameras.begin()->second.params) std::printf(" %.6g", p);
}

int Run(int argc, char** argv) {
  fs::path truth_folder;
  bool known = false;
  for (int i = 2; i < argc; ++i) {
    if (std::strcmp(argv[i], "--truth") == 0 && i + 1 < argc) truth_folder = argv[++i];
    if (std::strcmp(argv[i], "--known-lens") == 0) known = true;
  }
  const SfmModel model = colmap::ReadModel(argv[1]);
  const Truth truth = truth_folder.empty() ? Truth{} : ReadTruth(truth_folder);
  const auto row = [&](const char* name, const SfmModel& m, double cpu_s) {
    std::printf("| %s | %.2f", name, cpu_s);
    if (!truth_folder.empty()) PrintErrors(m, truth);
    PrintLens(m);
    std::printf(" |\n");
  };
  std::printf("| cameras | CPU s%s | lens |\n",
              truth_folder.empty() ? ""
                                   : " | mean rotation error, deg | by the best turn, deg | mean "
                                     "position error, % of baseline");
  row("COLMAP", model, 0);
  double start = CpuSeconds();
  const Refined refined = Refine(model, {});
  row("refined", refined.model, CpuSeconds() - start);
  std::printf("%s\n", ToJson(refined).c_str());
  for (const LensFreedom lens : {LensFreedom::kNoPrincipalPoint, LensFreedom::kAll}) {
    AdjustOptions options;
    options.lens = lens;
    start = CpuSeconds();
    const Adjusted a = Adjust(BundleOf(model), options);
    int dropped = 0;
    row(NameOf(lens), ModelOf(a.bundle, model, false, &dropped), CpuSeconds() - start);
  }
  if (known) {
    RefineOptions options;
    options.known_lenses.emplace();
    for (const auto& [id, camera] : model.cameras) options.known_lenses->emplace(id, truth.lens);
    start = CpuSeconds();
    const Refined with = Refine(model, options);
    row("known lens", with.model, CpuSeconds() - start);
    std::printf("%s\n", ToJson(with).c_str());
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  setvbuf(stdout, nullptr, _IONBF, 0);
  try {
    return Run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
