#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "calib/judge/judge.h"
#include "calib/precision.h"

namespace dtr::calib {
namespace {

// Fine enough that boards in one part of the image do not count for what lies around it.
constexpr int kCoverColumns = 12, kCoverRows = 8;
constexpr double kRepeatSigmas = 0.3;  // two photos of one pose differ by about 1 sigma

// The smallest value over the cameras, and whose it is.
template <typename Value>
Check LeastOverCameras(const JudgedCalibration& calibration, const char* name, double limit,
                       const Value& value) {
  Check check{name, std::numeric_limits<double>::infinity(), limit, false, ""};
  for (size_t c = 0; c < calibration.cameras.size(); ++c) {
    const double v = value(c);
    if (!(v >= check.value)) {
      check.value = v;
      check.reason = calibration.cameras[c].name;
    }
  }
  check.passed = check.value >= limit;
  return check;
}

}  // namespace

double CoverageOf(const JudgedCalibration& calibration, size_t camera) {
  std::set<int> cells;
  const LensCamera& lens = calibration.cameras[camera].camera;
  for (const RigView& view : calibration.kept) {
    if (view.camera != camera) continue;
    for (const BoardCorner& corner : view.seen.corners) {
      if (Holds(view.outliers, corner.id)) continue;
      const double x = kCoverColumns * corner.pixel.x() / lens.width_px;
      const double y = kCoverRows * corner.pixel.y() / lens.height_px;
      if (x < 0 || y < 0 || x >= kCoverColumns || y >= kCoverRows) continue;
      cells.insert(static_cast<int>(y) * kCoverColumns + static_cast<int>(x));
    }
  }
  return static_cast<double>(cells.size()) / (kCoverColumns * kCoverRows);
}

Check TestViewCount(const JudgedCalibration& calibration, double min_views) {
  Check check = LeastOverCameras(calibration, "min_views", min_views, [&](size_t c) {
    return static_cast<double>(std::count_if(calibration.kept.begin(), calibration.kept.end(),
                                             [&](const RigView& v) { return v.camera == c; }));
  });
  check.reason = fmt::format("{}: views of the board, minimum over the cameras", check.reason);
  return check;
}

Check TestCoverage(const JudgedCalibration& calibration, double min_coverage) {
  Check check = LeastOverCameras(calibration, "min_coverage", min_coverage,
                                 [&](size_t c) { return CoverageOf(calibration, c); });
  check.reason = fmt::format("{}: share of {} x {} image regions in which a corner was seen",
                             check.reason, kCoverColumns, kCoverRows);
  return check;
}

Check TestTilt(const JudgedCalibration& calibration, const Rig& fitted, double min_tilt_deg) {
  Check check = LeastOverCameras(calibration, "min_tilt_deg", min_tilt_deg, [&](size_t c) {
    std::vector<Eigen::Vector3d> normals;
    for (const RigView& view : fitted.views) {
      if (view.camera != c) continue;
      normals.push_back(fitted.rig_from_board[view.frame].rotation * Eigen::Vector3d::UnitZ());
    }
    double min_cosine = 1;
    for (const auto& a : normals) {
      for (const auto& b : normals) min_cosine = std::min(min_cosine, std::abs(a.dot(b)));
    }
    return std::acos(std::min(1.0, min_cosine)) * 180 / std::numbers::pi;
  });
  check.reason = fmt::format(
      "{}: largest angle between two boards; parallel ones cannot separate focal length from "
      "distance",
      check.reason);
  return check;
}

Check TestRepeats(const JudgedCalibration& calibration, double sigma_px) {
  Check check{"repeated_views", 0, 0, true, ""};
  const double nearest = kRepeatSigmas * std::sqrt(2.0 * VarianceOf(sigma_px));  // per coordinate
  const auto& views = calibration.kept;
  for (size_t i = 0; i < views.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const auto &a = views[i].seen.corners, &b = views[j].seen.corners;
      if (views[i].camera != views[j].camera || a.size() != b.size()) continue;
      double sum = 0;
      for (size_t k = 0; k < a.size(); ++k) {
        sum += a[k].id == b[k].id ? (a[k].pixel - b[k].pixel).squaredNorm()
                                  : std::numeric_limits<double>::infinity();
      }
      if (!(std::sqrt(sum / (2.0 * static_cast<double>(a.size()))) <= nearest)) continue;
      check.value += 1;
      check.passed = false;
      if (check.reason.empty()) {
        check.reason = fmt::format("{} shows what {} shows: the same noise counted twice",
                                   views[i].seen.name, views[j].seen.name);
      }
      break;
    }
  }
  if (check.passed) check.reason = "no two views have the same noise";
  return check;
}

Check TestBoardsFromBehind(const JudgedCalibration& calibration, const Rig& fitted) {
  Check check{"boards_from_behind", 0, 0, true, "every board shows its face"};
  const Eigen::Vector3d middle = MiddleOf(calibration.board);
  for (const RigView& view : fitted.views) {
    const Pose cam_from_board =
        fitted.cameras[view.camera].cam_from_rig * fitted.rig_from_board[view.frame];
    // The board's z points away from who sees its face.
    if ((cam_from_board.rotation * Eigen::Vector3d::UnitZ()).dot(cam_from_board * middle) > 0) {
      continue;
    }
    if (check.value == 0) {
      check.reason = fmt::format(
          "{}: the corners are a mirror image of the board; a mirrored "
          "photo, or rows and columns taken for each other",
          view.seen.name);
    }
    check.value += 1;
    check.passed = false;
  }
  return check;
}

}  // namespace dtr::calib
