#include "cli/pipeline/judge_calibration.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/boards/repeats.h"
#include "cli/pipeline/board_photos.h"
#include "cli/pipeline/lens_file.h"
#include "cli/pipeline/rig_calibration.h"
#include "cli/pipeline/rig_photos.h"
#include "dtr/base/error.h"

namespace dtr::pipeline {
namespace {

constexpr double kSamePhotoPx = 1e-3;

void RequireSize(const calib::CalibratedCamera& camera, int width_px, int height_px,
                 const std::filesystem::path& folder) {
  if (camera.camera.width_px == width_px && camera.camera.height_px == height_px) return;
  throw Error(
      fmt::format("{}: expected photos of {} x {} px as camera {} was calibrated with, "
                  "found {} x {}",
                  folder.string(), camera.camera.width_px, camera.camera.height_px, camera.name,
                  width_px, height_px));
}

calib::UnseenViews UnseenOfCamera(const calib::Calibration& calibration,
                                  const std::filesystem::path& folder, const std::string& pattern,
                                  int threads, Progress& progress) {
  calib::UnseenViews unseen;
  const BoardPhotos photos =
      ReadBoardPhotos(folder, pattern, calibration.board, {}, threads, progress);
  RequireSize(calibration.cameras[0], photos.width_px, photos.height_px, folder);
  for (const auto& view : photos.views) unseen.views.push_back({0, unseen.frames++, view, {}});
  return unseen;
}

calib::UnseenViews UnseenOfRig(const calib::Calibration& calibration,
                               const std::filesystem::path& folder, const std::string& pattern,
                               int threads, Progress& progress) {
  if (pattern != "*") {
    throw UsageError(fmt::format(
        "--pattern {}: is for the photos of one camera; a rig's cameras are told apart by their "
        "folders or names",
        pattern));
  }
  calib::UnseenViews unseen;
  RigPhotos photos = ReadRigPhotos(folder, calibration.board, {}, threads, progress);
  std::vector<size_t> index(photos.cameras.size());
  for (size_t c = 0; c < photos.cameras.size(); ++c) {
    const auto found =
        std::find_if(calibration.cameras.begin(), calibration.cameras.end(),
                     [&](const auto& camera) { return camera.name == photos.cameras[c].name; });
    if (found == calibration.cameras.end()) {
      throw Error(fmt::format("{}: camera {}: not in the calibration, whose first camera is {}",
                              folder.string(), photos.cameras[c].name,
                              calibration.cameras[0].name));
    }
    index[c] = static_cast<size_t>(found - calibration.cameras.begin());
    RequireSize(*found, photos.cameras[c].width_px, photos.cameras[c].height_px, folder);
  }
  unseen.frames = photos.frames.size();
  unseen.views = std::move(photos.views);
  for (calib::RigView& view : unseen.views) view.camera = index[view.camera];
  std::stable_sort(unseen.views.begin(), unseen.views.end(), [](const auto& a, const auto& b) {
    return std::pair(a.frame, a.camera) < std::pair(b.frame, b.camera);
  });
  return unseen;
}

// The same photo, detected again, has the same corners; another one of the same board at the same
// place differs by its noise.
void TakeOutSeen(const calib::Calibration& calibration, UnseenPhotos& photos) {
  std::erase_if(photos.unseen.views, [&](const calib::RigView& view) {
    const auto same =
        std::find_if(calibration.views.begin(), calibration.views.end(), [&](const auto& kept) {
          return kept.camera == view.camera &&
                 calib::MeanDistancePx(view.seen, kept.seen) < kSamePhotoPx;
        });
    if (same == calibration.views.end()) return false;
    photos.left_out.push_back(
        {view.seen.name,
         fmt::format("not unseen: its corners are those of {}, which the calibration was made from",
                     same->seen.name)});
    return true;
  });
}

}  // namespace

calib::JudgedCalibration JudgedFrom(const calib::Calibration& calibration) {
  calib::JudgedCalibration judged;
  judged.board = calibration.board;
  judged.free_lenses = !calibration.lenses_given;
  for (const calib::CalibratedCamera& camera : calibration.cameras) {
    judged.cameras.push_back({camera.name, camera.model, camera.camera, camera.cam_from_rig});
  }
  for (const calib::CalibratedView& view : calibration.views) {
    judged.kept.push_back({view.camera, view.frame, view.seen, view.outliers});
    judged.kept_frames = std::max(judged.kept_frames, view.frame + 1);
  }
  std::stable_sort(judged.kept.begin(), judged.kept.end(), [](const auto& a, const auto& b) {
    return std::pair(a.frame, a.camera) < std::pair(b.frame, b.camera);
  });
  for (size_t i = 1; i < judged.kept.size(); ++i) {
    const auto &a = judged.kept[i - 1], &b = judged.kept[i];
    if (a.frame == b.frame && a.camera == b.camera) {
      throw Error(fmt::format("views {} and {}: expected one view per camera and frame",
                              a.seen.name, b.seen.name));
    }
  }
  return judged;
}

calib::Calibration ForeignCalibration(const std::filesystem::path& file,
                                      const calib::Board& board) {
  calib::Calibration calibration;
  calibration.board = board;
  const calib::RigCameraInput lens = GivenLens(ReadLens(file), file.string());
  calibration.cameras.push_back({file.stem().string(), lens.model, *lens.given, {}});
  return calibration;
}

UnseenPhotos ReadUnseen(const calib::Calibration& calibration, const std::filesystem::path& folder,
                        const std::string& pattern, int threads, Progress& progress) {
  UnseenPhotos photos;
  photos.unseen = calibration.cameras.size() == 1
                      ? UnseenOfCamera(calibration, folder, pattern, threads, progress)
                      : UnseenOfRig(calibration, folder, pattern, threads, progress);
  TakeOutSeen(calibration, photos);
  if (photos.unseen.views.empty()) {
    throw Error(fmt::format(
        "{}: expected photos that the calibration has not seen, found only those that it was made "
        "from, {} first; take others, or leave --images out",
        folder.string(), photos.left_out.front().name));
  }
  return photos;
}

}  // namespace dtr::pipeline
