#include "pipeline/validate.h"

#include <algorithm>
#include <atomic>
#include <nlohmann/json.hpp>

#include "calib/validation/report_json.h"
#include "dtr/base/memory_budget.h"
#include "dtr/eval/cross_depth.h"
#include "dtr/eval/report_json.h"
#include "dtr/io/set_io.h"
#include "pipeline/detail/cameras/given_cameras.h"
#include "pipeline/set_rig.h"

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
                   int threads, SetValidation& report, Progress& progress) {
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
  options.threads = threads;
  progress.Stage("depth across views", static_cast<int>(with_depth.size()));
  std::atomic<int> brought = 0;  // some more than once, where memory is short
  auto cross = eval::CrossDepth(with_depth, options, [&](const View& view) {
    progress.ThrowIfInterrupted();
    View loaded = view;
    loaded.mesh_file.reset();  // renderers' alone
    io::LoadOptions load;
    load.images = false;
    load.threads = 1;  // several views at a time
    io::LoadPixels(folder, loaded, load);
    progress.Update(std::min(++brought, static_cast<int>(with_depth.size())));
    return std::move(loaded.depth);
  });
  report.tests.insert(report.tests.end(), cross.tests.begin(), cross.tests.end());
  report.cross_depth = std::move(cross);
}

}  // namespace

calib::ValidationReport ReprojectionOfSet(const DtrSet& set, const SparseScene& sparse,
                                          const calib::ValidateLimits& limits, int threads) {
  const Cameras of = CamerasOf(set);
  return calib::ValidateReprojection(of.cameras, of.poses, sparse, limits, of.names, threads,
                                     of.held_out);
}

SetValidation ValidateSet(const std::filesystem::path& folder, const DtrSet& set,
                          const SparseScene& sparse, const SetLimits& limits, int threads,
                          Progress& progress) {
  progress.Stage("reprojection tests", 0);
  SetValidation report{{ReprojectionOfSet(set, sparse, limits.reprojection, threads)}, {}, {}};
  progress.ThrowIfInterrupted();
  AddCrossDepth(folder, set, limits, threads, report, progress);
  progress.Stage("cameras against their observations", 0);
  const Cameras of = CamerasOf(set);
  calib::PhotosValidation validation = calib::ValidatePhotos(
      calib::BundleOf(of.cameras, of.poses, of.names, sparse), limits.photos, threads, &progress);
  report.tests.insert(report.tests.end(), validation.tests.begin(), validation.tests.end());
  const auto rig = RigOfSet(set);
  const auto places = rig ? RigPlaces(set, sparse, *rig) : std::nullopt;
  if (places) report.tests.push_back(*places);
  if (const auto given = GivenCamerasCheck(set)) report.tests.push_back(*given);
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
  Json json = calib::JsonOf(report);
  json["adjustment"] = calib::JsonOf(report.adjustment);
  if (report.cross_depth) {
    json["cross_depth"] = eval::JsonOf(*report.cross_depth);
    for (const char* listed_above : {"passed", "tests"}) json["cross_depth"].erase(listed_above);
  }
  // Names come from files: bytes that are no UTF-8 must not make the whole report unreadable.
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::pipeline
