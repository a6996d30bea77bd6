#include "pipeline/validate/validate.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <nlohmann/json.hpp>

#include "calib/validation/conclusion.h"
#include "calib/validation/report_json.h"
#include "dtr/base/memory_budget.h"
#include "dtr/eval/cross_depth.h"
#include "dtr/eval/report_json.h"
#include "dtr/io/set_io.h"
#include "pipeline/core/cameras/given_cameras.h"
#include "pipeline/core/cameras/sfm_doubt.h"
#include "pipeline/core/set_rig.h"

namespace dtr::pipeline {

namespace {

struct Cameras {
  std::vector<PinholeCamera> cameras;
  std::vector<Pose> poses;
  std::vector<std::string> names;
  std::vector<bool> held_out;
};

Cameras CamerasOf(const DtrSet& set) {
  Cameras of;
  for (const View& view : set.frames.front().views) {
    of.cameras.push_back(view.camera);
    of.poses.push_back(view.cam_from_world);
    of.names.push_back(view.name);
    of.held_out.push_back(view.role == ViewRole::kHeldOut);
  }
  return of;
}

// Appends what depth says, where two views or more have any.
void AddCrossDepth(const std::filesystem::path& folder, const DtrSet& set, const SetLimits& limits,
                   SetValidation& report, Progress& progress) {
  std::vector<const View*> with_depth;
  for (const View& view : set.frames.front().views) {
    if (view.depth_file) with_depth.push_back(&view);
  }
  if (with_depth.size() < 2) return;
  eval::CrossDepthOptions options;
  options.max_cross_px = limits.max_cross_px;
  options.max_view_cross_px = 2 * limits.max_cross_px;
  options.memory_bytes = static_cast<size_t>(limits.memory_gb * kBytesPerGigabyte);
  options.scene_center = set.scene_center;
  progress.Stage("depth across views", static_cast<int>(with_depth.size()));
  std::atomic<int> brought = 0;  // some more than once, where memory is short
  auto cross = eval::CrossDepth(with_depth, options, [&](const View& view) {
    progress.ThrowIfInterrupted();
    View loaded = view;
    loaded.mesh_file.reset();  // renderers' alone
    io::LoadOptions load;
    load.images = false;
    io::LoadPixels(folder, loaded, load);
    progress.Update(std::min(++brought, static_cast<int>(with_depth.size())));
    return std::move(loaded.depth);
  });
  report.tests.insert(report.tests.end(), cross.tests.begin(), cross.tests.end());
  report.cross_depth = std::move(cross);
}

// Fewer points in common leave the scale of what hangs on them open.
constexpr int kMinJoiningPoints = 50;

// Images that free cameras would join: from the two that share the most points on, always the one
// that sees the most points of two images before it, as long as these are enough.
std::vector<bool> JoinedByPoints(const calib::Bundle& bundle) {
  const size_t images = bundle.images.size();
  std::vector<std::vector<int>> points_of(images), images_of(bundle.points.size());
  for (const calib::BundleObservation& o : bundle.observations) {
    points_of[static_cast<size_t>(o.image)].push_back(o.point);
    images_of[static_cast<size_t>(o.point)].push_back(o.image);
  }
  std::map<std::pair<int, int>, int> shared;
  for (const std::vector<int>& seen_by : images_of) {
    for (size_t i = 0; i < seen_by.size(); ++i) {
      for (size_t j = i + 1; j < seen_by.size(); ++j) ++shared[{seen_by[i], seen_by[j]}];
    }
  }
  std::vector<bool> joined(images, false);
  if (shared.empty()) return joined;
  const auto most =
      std::max_element(shared.begin(), shared.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  std::vector<int> seen(bundle.points.size(), 0), known(images, 0);
  const auto add = [&](size_t image) {
    joined[image] = true;
    for (const int point : points_of[image]) {
      if (++seen[static_cast<size_t>(point)] != 2) continue;
      for (const int other : images_of[static_cast<size_t>(point)]) {
        ++known[static_cast<size_t>(other)];
      }
    }
  };
  add(static_cast<size_t>(most->first.first));
  add(static_cast<size_t>(most->first.second));
  while (true) {
    size_t best = images;
    for (size_t i = 0; i < images; ++i) {
      if (!joined[i] && (best == images || known[i] > known[best])) best = i;
    }
    if (best == images || known[best] < kMinJoiningPoints) return joined;
    add(best);
  }
}

// Of views of panoramas those stay that points join: a floor that the views downwards alone show
// has its place from the rig, which a fresh adjustment does not know. Returns how many went.
int LeaveOutViewsOfTheRigAlone(calib::Bundle& bundle) {
  const std::vector<bool> joined = JoinedByPoints(bundle);
  std::erase_if(bundle.observations, [&](const calib::BundleObservation& o) {
    return !joined[static_cast<size_t>(o.image)];
  });
  return static_cast<int>(std::count(joined.begin(), joined.end(), false));
}

}  // namespace

calib::ValidationReport ReprojectionOfSet(const DtrSet& set, const SparseScene& sparse,
                                          const calib::ValidateLimits& limits) {
  const Cameras of = CamerasOf(set);
  return calib::ValidateReprojection(of.cameras, of.poses, sparse, limits, of.names, of.held_out);
}

SetValidation ValidateSet(const std::filesystem::path& folder, const DtrSet& set,
                          const SparseScene& sparse, const SetLimits& limits, Progress& progress) {
  progress.Stage("reprojection tests", 0);
  SetValidation report{{ReprojectionOfSet(set, sparse, limits.reprojection)}, {}, {}};
  progress.ThrowIfInterrupted();
  AddCrossDepth(folder, set, limits, report, progress);
  progress.Stage("cameras against their observations", 0);
  const Cameras of = CamerasOf(set);
  const auto rig = RigOfSet(set);
  calib::Bundle bundle = calib::BundleOf(of.cameras, of.poses, of.names, sparse);
  const bool panoramas = rig && calib::HasOneCentre(rig->known);
  const int by_rig = panoramas ? LeaveOutViewsOfTheRigAlone(bundle) : 0;
  calib::BundleLimits photos = limits.photos;
  photos.lenses_are_given = photos.lenses_are_given || rig.has_value();
  calib::PhotosValidation validation = calib::ValidatePhotos(bundle, photos, &progress);
  if (panoramas) {  // it is that of free views: those of a panorama are known far better
    std::erase_if(validation.tests,
                  [](const Check& test) { return test.name == "image_shift_px"; });
  }
  report.tests.insert(report.tests.end(), validation.tests.begin(), validation.tests.end());
  auto places = rig ? RigPlaces(set, sparse, *rig) : std::nullopt;
  if (places && by_rig > 0) {
    places->reason += fmt::format(
        "; {} views share too few points with the others to be solved for without their panorama",
        by_rig);
  }
  if (places) report.tests.push_back(*places);
  if (const auto given = GivenCamerasCheck(set)) report.tests.push_back(*given);
  if (const auto doubt = SfmDoubtCheck(set)) report.tests.push_back(*doubt);
  for (const calib::PhotoValidation& validated_photo : validation.cameras) {
    const auto camera =
        std::find_if(report.cameras.begin(), report.cameras.end(),
                     [&](const auto& validated) { return validated.name == validated_photo.name; });
    if (camera != report.cameras.end()) camera->placed = validated_photo.placed;
  }
  report.adjustment = std::move(validation);
  return report;
}

std::string ToJson(const SetValidation& report) {
  using Json = nlohmann::ordered_json;
  Json json{{"result", ResultWord(report.passed())},
            {"conclusion", calib::Conclusion(report.tests, calib::Validated::kPhotos)}};
  json.update(calib::JsonOf(report));
  json["adjustment"] = calib::JsonOf(report.adjustment);
  if (report.cross_depth) {
    json["cross_depth"] = eval::JsonOf(*report.cross_depth);
    for (const char* listed_above : {"passed", "tests"}) json["cross_depth"].erase(listed_above);
  }
  // Names come from files: bytes that are no UTF-8 must not make the whole report unreadable.
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::pipeline
