// bundle_report MODEL [--truth CAMERAS_JSON] [--known-lens] [--beside NAME=MODEL]...: what bundle
// adjustment makes of a COLMAP model, beside the model as it is and others. Errors after the best
// similarity between the camera centres: mean angle of the rotations (also by the turn that suits
// them best), mean distance of the centres as a share of the median neighbour baseline. The truth
// is of the same photos, by their names.
#include <time.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <map>
#include <optional>

#include "calib/bundle/refine.h"
#include "calib/colmap/model_io.h"
#include "calib/similarity.h"
#include "dtr/base/error.h"
#include "dtr/io/formats/cameras_json.h"

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
  std::optional<LensCamera> lens;  // that all photos share
  std::map<std::string, Pose> cam_from_world;
};

Truth ReadTruth(const fs::path& file) {
  Truth truth;
  for (const io::NamedCamera& named : io::ReadCamerasJson(file).cameras) {
    const PinholeCamera& c = named.camera;
    truth.cam_from_world[named.name] = named.cam_from_world;
    truth.lens = {CameraModel::kPinhole,
                  c.width_px(),
                  c.height_px(),
                  {c.fx_px(), c.fy_px(), c.cx_px(), c.cy_px()}};
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
  std::printf(" | %zu | %.4f | %.4f | %.3f", ours.size(), turn / count, own_turn / count,
              100 * shift / count / baseline);
}

void PrintLens(const SfmModel& model) {
  std::printf(" |");
  for (const double p : model.cameras.begin()->second.params) std::printf(" %.6g", p);
}

int Run(int argc, char** argv) {
  fs::path truth_file;
  bool known = false;
  std::vector<std::pair<std::string, fs::path>> beside;
  for (int i = 2; i < argc; ++i) {
    if (std::strcmp(argv[i], "--truth") == 0 && i + 1 < argc) truth_file = argv[++i];
    if (std::strcmp(argv[i], "--known-lens") == 0) known = true;
    if (std::strcmp(argv[i], "--beside") == 0 && i + 1 < argc) {
      const std::string given = argv[++i];
      const size_t equals = given.find('=');
      if (equals == std::string::npos) throw Error("--beside: expected NAME=MODEL");
      beside.emplace_back(given.substr(0, equals), given.substr(equals + 1));
    }
  }
  const SfmModel model = colmap::ReadModel(argv[1]);
  const Truth truth = truth_file.empty() ? Truth{} : ReadTruth(truth_file);
  const auto row = [&](const char* name, const SfmModel& m, double cpu_s) {
    std::printf("| %s | %.2f", name, cpu_s);
    if (!truth_file.empty()) PrintErrors(m, truth);
    PrintLens(m);
    std::printf(" |\n");
  };
  std::printf("| cameras | CPU s%s | lens |\n",
              truth_file.empty() ? ""
                                 : " | photos | mean rotation error, deg | by the best turn, deg | "
                                   "mean position error, % of baseline");
  std::printf("|---|---|%s---|\n", truth_file.empty() ? "" : "---|---|---|---|");
  row("COLMAP", model, 0);
  for (const auto& [name, folder] : beside) row(name.c_str(), colmap::ReadModel(folder), 0);
  double start = CpuSeconds();
  const Refined refined = Refine(model, {});
  row("refined", refined.model, CpuSeconds() - start);
  for (const LensFreedom lens : {LensFreedom::kNoPrincipalPoint, LensFreedom::kAll}) {
    AdjustOptions options;
    options.lens = lens;
    start = CpuSeconds();
    const Adjusted a = Adjust(BundleOf(model), options);
    int dropped = 0;
    row(NameOf(lens), ModelOf(a.bundle, model, false, &dropped), CpuSeconds() - start);
  }
  if (known && truth.lens) {
    RefineOptions options;
    options.known_lenses.emplace();
    for (const auto& [id, camera] : model.cameras) options.known_lenses->emplace(id, *truth.lens);
    start = CpuSeconds();
    const Refined with = Refine(model, options);
    row("known lens", with.model, CpuSeconds() - start);
    std::printf("\nknown lens: %s\n", ToJson(with).c_str());
  }
  std::printf("\nrefined: %s\n", ToJson(refined).c_str());
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
