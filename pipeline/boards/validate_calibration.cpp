#include "pipeline/boards/validate_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "calib/boards/repeats.h"
#include "calib/solve/rig_start.h"
#include "dtr/base/error.h"
#include "pipeline/boards/board_photos.h"
#include "pipeline/boards/calibrate_rig.h"
#include "pipeline/boards/rig_photos.h"
#include "pipeline/core/camera_file.h"

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

TestPhotos TestPhotosOfCamera(const calib::Calibration& calibration,
                              const std::filesystem::path& folder, const std::string& pattern,
                              Progress& progress) {
  const BoardPhotos photos = ReadBoardPhotos(folder, pattern, calibration.board, {}, progress,
                                             calibration.cameras[0].camera);
  RequireSize(calibration.cameras[0], photos.width_px, photos.height_px, folder);
  TestPhotos found{{}, photos.left_out};
  calib::TestViews& test_views = found.test_views;
  for (const auto& view : photos.views)
    test_views.views.push_back({0, test_views.frames++, view, {}});
  return found;
}

TestPhotos TestPhotosOfRig(const calib::Calibration& calibration,
                           const std::filesystem::path& folder, const std::string& pattern,
                           Progress& progress) {
  if (pattern != "*") {
    throw UsageError(fmt::format(
        "`pattern` {}: is for the photos of one camera; a rig's cameras are distinguished by their "
        "folders or names",
        pattern));
  }
  std::map<std::string, calib::LensCamera> known;
  for (const auto& camera : calibration.cameras) known.emplace(camera.name, camera.camera);
  RigPhotos photos = ReadRigPhotos(folder, calibration.board, {}, progress, known);
  std::vector<size_t> index(photos.cameras.size());
  for (size_t c = 0; c < photos.cameras.size(); ++c) {
    const auto found =
        std::find_if(calibration.cameras.begin(), calibration.cameras.end(),
                     [&](const auto& camera) { return camera.name == photos.cameras[c].name; });
    if (found == calibration.cameras.end()) {
      throw Error(fmt::format(
          "{}: camera {}: expected a camera of the calibration, found none of this name; its first "
          "is {}",
          folder.string(), photos.cameras[c].name, calibration.cameras[0].name));
    }
    index[c] = static_cast<size_t>(found - calibration.cameras.begin());
    RequireSize(*found, photos.cameras[c].width_px, photos.cameras[c].height_px, folder);
  }
  TestPhotos of_rig{{}, std::move(photos.left_out)};
  calib::TestViews& test_views = of_rig.test_views;
  test_views.frames = photos.frames.size();
  test_views.views = std::move(photos.views);
  for (calib::RigView& view : test_views.views) view.camera = index[view.camera];
  std::stable_sort(test_views.views.begin(), test_views.views.end(),
                   [](const auto& a, const auto& b) {
                     return std::pair(a.frame, a.camera) < std::pair(b.frame, b.camera);
                   });
  return of_rig;
}

bool CornersMoved(const calib::Calibration& calibration, const calib::CalibratedView& view) {
  const auto& delay = calibration.cameras[view.camera].delay;
  return delay && delay->corners_moved;
}

// The same photo, detected again, has the same corners, of chessboards perhaps counted from the
// other end; another one of the same board at the same place differs by its noise. Corners that a
// free-running camera's delay has moved are no photo's: there names must do.
bool IsSame(const calib::Calibration& calibration, const calib::BoardView& view,
            const calib::CalibratedView& kept) {
  if (CornersMoved(calibration, kept)) return view.name == kept.seen.name;
  if (calib::MeanDistancePx(view, kept.seen) < kSamePhotoPx) return true;
  return calibration.board.kind == calib::Board::Kind::kChessboard &&
         calib::MeanDistancePx(calib::TurnedByHalf(calibration.board, view), kept.seen) <
             kSamePhotoPx;
}

std::vector<calib::LeftOut> TakeOutSeen(const calib::Calibration& calibration,
                                        std::vector<calib::RigView>& views) {
  std::vector<calib::LeftOut> seen;
  std::erase_if(views, [&](const calib::RigView& view) {
    const auto same =
        std::find_if(calibration.views.begin(), calibration.views.end(), [&](const auto& kept) {
          return kept.camera == view.camera && IsSame(calibration, view.seen, kept);
        });
    if (same == calibration.views.end()) return false;
    seen.push_back(
        {view.seen.name,
         CornersMoved(calibration, *same)
             ? "not held out: the calibration was made from a photo of this name"
             : fmt::format(
                   "not held out: its corners are those of {}, which the calibration was made from",
                   same->seen.name)});
    return true;
  });
  return seen;
}

}  // namespace

calib::ValidatedCalibration ToValidate(const calib::Calibration& calibration) {
  calib::ValidatedCalibration judged;
  judged.board = calibration.board;
  judged.free_lenses = !calibration.lenses_given;
  for (const calib::CalibratedCamera& camera : calibration.cameras) {
    judged.cameras.push_back({.name = camera.name,
                              .model = camera.model,
                              .camera = camera.camera,
                              .cam_from_rig = camera.cam_from_rig});
  }
  for (const calib::CalibratedView& view : calibration.views) {
    judged.kept.push_back(
        {.camera = view.camera, .frame = view.frame, .seen = view.seen, .outliers = view.outliers});
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

TestPhotos ReadTestPhotos(const calib::Calibration& calibration,
                          const std::filesystem::path& folder, const std::string& pattern,
                          Progress& progress) {
  TestPhotos photos = calibration.cameras.size() == 1
                          ? TestPhotosOfCamera(calibration, folder, pattern, progress)
                          : TestPhotosOfRig(calibration, folder, pattern, progress);
  const std::vector<calib::LeftOut> seen = TakeOutSeen(calibration, photos.test_views.views);
  if (photos.test_views.views.empty()) {
    throw Error(fmt::format(
        "{}: expected photos that the calibration has not seen, found only those that it was made "
        "from, {} first; take others, or leave `images` out",
        folder.string(), seen.front().name));
  }
  photos.left_out.insert(photos.left_out.end(), seen.begin(), seen.end());
  return photos;
}

}  // namespace dtr::pipeline
