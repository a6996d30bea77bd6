// gps_report MODEL PHOTOS [FOLDS]: how well places on Earth that nobody gave are met by a COLMAP
// model that was carried to the other places as a whole, and by one that was adjusted to them. The
// places of photos i, i + FOLDS, ... are left out by turns (3 folds). The places' own errors are in
// every figure.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>

#include "calib/bundle/metric_refine.h"
#include "calib/colmap/model_io.h"
#include "calib/similarity.h"
#include "pipeline/core/photo_positions.h"

namespace {

using namespace dtr;         // NOLINT
using namespace dtr::calib;  // NOLINT

struct Sums {
  double flat = 0, up = 0;
  int count = 0;
  void Add(const Eigen::Vector3d& miss) {
    flat += miss.head<2>().squaredNorm();
    up += miss.z() * miss.z();
    ++count;
  }
  void Print(const char* name) const {
    std::printf("| %s | %.2f | %.2f |\n", name, std::sqrt(flat / count), std::sqrt(up / count));
  }
};

Eigen::Vector3d CentreOf(const SfmModel& model, int image) {
  return model.images[static_cast<size_t>(image)].cam_from_world.TargetOriginInSource();
}

// Carries the model to the places that were held, and asks for the others.
void AddAsAWhole(const SfmModel& model, const std::vector<PositionPrior>& held,
                 const KnownMetres& asked, Sums& sums) {
  std::vector<Eigen::Vector3d> centres, positions;
  for (const PositionPrior& p : held) {
    centres.push_back(CentreOf(model, p.image));
    positions.push_back(p.centre);
  }
  const Similarity fit = AlignPoints(centres, positions);
  for (const KnownPlace& place : asked.places) {
    sums.Add(fit * CentreOf(model, place.image) - place.position_m);
  }
}

int Run(const std::string& folder, const std::string& photos, int folds) {
  const SfmModel model = colmap::ReadModel(folder);
  std::vector<std::string> names;
  for (const SfmImage& image : model.images) names.push_back(image.name);
  const pipeline::PhotoPositions places = pipeline::ReadPhotoPositions(photos, names);
  const std::vector<Eigen::Vector3d> positions_m = places.EastNorthUp();
  KnownMetres all;
  for (size_t i = 0; i < positions_m.size(); ++i) {
    const auto image = std::find(names.begin(), names.end(), places.names[i]) - names.begin();
    all.places.push_back({static_cast<int>(image), positions_m[i], 0, 0});
  }
  const Refined free = Refine(model, {});
  Sums whole, refined_whole, adjusted;
  for (int fold = 0; fold < folds; ++fold) {
    KnownMetres given, asked;
    for (size_t i = 0; i < all.places.size(); ++i) {
      const bool out = static_cast<int>(i) % folds == fold;
      (out ? asked : given).places.push_back(all.places[i]);
    }
    MetricStart start = StartInMetres(model, given, {});
    const Refined refined = RefineInMetres(given, start);
    for (const KnownPlace& place : asked.places) {
      adjusted.Add(CentreOf(refined.model, place.image) - place.position_m);
    }
    AddAsAWhole(model, start.options.positions, asked, whole);
    AddAsAWhole(free.model, start.options.positions, asked, refined_whole);
    std::fprintf(stderr,
                 "fold %d: lenses %s, %zu positions do not agree, taken to err by %.2f, %.2f m\n",
                 fold, NameOf(*refined.lens), start.report.left_out.size(),
                 start.report.sigma_flat_m, start.report.sigma_up_m);
  }
  std::printf(
      "| model | positions not given: on the map, m RMS | in height, m RMS |\n|---|---|---|\n");
  whole.Print("carried as a whole");
  refined_whole.Print("refined without positions, carried as a whole");
  adjusted.Print("adjusted to the others");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  try {
    return Run(argv[1], argv[2], argc > 3 ? std::atoi(argv[3]) : 3);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
