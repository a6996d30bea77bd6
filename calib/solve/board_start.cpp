#include "calib/solve/board_start.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "calib/boards/opencv_pixels.h"
#include "calib/lens_map.h"
#include "calib/solve/limits.h"
#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

// Of the image's long side; 0.15 is a 190-degree fisheye on the short side of 4:3, 29 a 2-degree
// tele lens.
constexpr double kShortestFocal = 0.15, kLongestFocal = 30, kFocalStep = 1.3;
constexpr size_t kMaxViewsToTry = 20;    // enough to choose among starts
constexpr double kInlierShare = 0.02;    // of the distance: undistorted starts are this far off
constexpr double kSmallestThird = 0.35;  // quantile of lengths that RobustSigma looks at
const double kThirdOfRayleigh = std::sqrt(-2 * std::log(1 - kSmallestThird));

struct Rays {
  std::vector<cv::Point2d> board;  // corners on the board, squares
  std::vector<cv::Point2d> rays;   // on the plane z = 1 of the turned camera
  Eigen::Quaterniond turned_from_cam = Eigen::Quaterniond::Identity();
};

// Rays as points of a plane, for cameras that see all around: the camera is turned so that the
// board lies ahead.
Rays RaysOf(const Board& board, const BoardView& view, const LensMap& lens) {
  Rays out;
  std::vector<std::pair<int, Eigen::Vector3d>> rays;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const BoardCorner& corner : view.corners) {
    if (const auto ray = lens.RayFromPixel(corner.pixel)) {
      rays.emplace_back(corner.id, *ray);
      sum += *ray;
    }
  }
  if (rays.empty()) return out;
  out.turned_from_cam = Eigen::Quaterniond::FromTwoVectors(sum, Eigen::Vector3d::UnitZ());
  for (const auto& [id, ray] : rays) {
    const Eigen::Vector3d turned = out.turned_from_cam * ray;
    if (!(turned.z() > 0.1)) continue;  // more than 84 degrees from the middle
    const Eigen::Vector3d p = board.Corner(id) / board.square;
    out.board.emplace_back(p.x(), p.y());
    out.rays.emplace_back(turned.x() / turned.z(), turned.y() / turned.z());
  }
  return out;
}

// Keeps the corners that one homography explains.
bool KeepAgreeing(Rays& rays) {
  if (rays.board.size() < kMinCorners) return false;
  double extent = 0;
  for (const cv::Point2d& ray : rays.rays) extent = std::max(extent, cv::norm(ray - rays.rays[0]));
  std::vector<std::uint8_t> agrees;
  const cv::Mat homography = cv::findHomography(rays.board, rays.rays, cv::RANSAC,
                                                kInlierShare * extent, agrees, 2000, 0.999);
  if (homography.empty()) return false;
  Rays kept;
  for (size_t i = 0; i < agrees.size(); ++i) {
    if (agrees[i] == 0) continue;
    kept.board.push_back(rays.board[i]);
    kept.rays.push_back(rays.rays[i]);
  }
  rays.board = std::move(kept.board);
  rays.rays = std::move(kept.rays);
  return rays.board.size() >= kMinCorners;
}

Pose PoseFromOpenCv(const cv::Mat& rotation_vector, const cv::Mat& translation, const Board& board,
                    const Eigen::Quaterniond& cam_from_turned) {
  const Eigen::Vector3d w(rotation_vector.at<double>(0), rotation_vector.at<double>(1),
                          rotation_vector.at<double>(2));
  const Eigen::Vector3d t(translation.at<double>(0), translation.at<double>(1),
                          translation.at<double>(2));
  const double angle = w.norm();
  const Eigen::Quaterniond rotation(
      Eigen::AngleAxisd(angle, angle > 0 ? Eigen::Vector3d(w / angle) : Eigen::Vector3d::UnitX()));
  return {(cam_from_turned * rotation).normalized(), cam_from_turned * t * board.square};
}

std::vector<double> CandidateFocals(const Board& board, std::span<const BoardView> views,
                                    int width_px, int height_px, BoardModel model) {
  const double side = std::max(width_px, height_px);
  std::vector<double> focals;
  for (double f = kShortestFocal; f < kLongestFocal; f *= kFocalStep) focals.push_back(f * side);
  if (model == BoardModel::kFisheye) return focals;
  std::vector<std::vector<cv::Point3f>> corners;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const BoardView& view : views) {
    corners.emplace_back();
    pixels.emplace_back();
    for (const BoardCorner& corner : view.corners) {
      const Eigen::Vector3d p = board.Corner(corner.id) / board.square;
      corners.back().emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), 0.0f);
      pixels.back().emplace_back(static_cast<float>(corner.pixel.x() - kOpenCvOffsetPx),
                                 static_cast<float>(corner.pixel.y() - kOpenCvOffsetPx));
    }
  }
  try {
    const cv::Mat k = cv::initCameraMatrix2D(corners, pixels, cv::Size(width_px, height_px), 1.0);
    const double f = k.at<double>(0, 0);
    if (f > kShortestFocal * side && f < kLongestFocal * side) focals.push_back(f);
  } catch (const cv::Exception&) {
    // Views that its closed form does not take; the ladder remains.
  }
  return focals;
}

std::vector<BoardView> SomeOf(std::span<const BoardView> views) {
  std::vector<BoardView> some;
  const size_t count = std::min(views.size(), kMaxViewsToTry);
  for (size_t i = 0; i < count; ++i) some.push_back(views[i * views.size() / count]);
  return some;
}

// Robust size of the residuals of a camera over these views; infinite where it has no poses.
double Misfit(const Board& board, std::span<const BoardView> views, const LensCamera& camera) {
  std::vector<double> lengths;
  for (const BoardView& view : views) {
    const auto pose = PoseOfBoard(board, view, camera);
    if (!pose) {
      lengths.insert(lengths.end(), view.corners.size(), std::numeric_limits<double>::infinity());
      continue;
    }
    const auto residuals = ResidualLengths(board, view, camera, *pose);
    lengths.insert(lengths.end(), residuals.begin(), residuals.end());
  }
  return RobustSigma(std::move(lengths));
}

}  // namespace

double RobustSigma(std::vector<double> lengths_px) {
  const auto index = static_cast<long>(kSmallestThird * static_cast<double>(lengths_px.size()));
  const auto place = lengths_px.begin() + index;
  std::nth_element(lengths_px.begin(), place, lengths_px.end());
  return *place / kThirdOfRayleigh;
}

std::vector<double> ResidualLengths(const Board& board, const BoardView& view,
                                    const LensCamera& camera, const Pose& cam_from_board) {
  const LensMap lens(camera);
  std::vector<double> lengths;
  for (const BoardCorner& corner : view.corners) {
    const auto pixel = lens.PixelFromCam(cam_from_board * board.Corner(corner.id));
    lengths.push_back(pixel ? (*pixel - corner.pixel).norm()
                            : std::numeric_limits<double>::infinity());
  }
  return lengths;
}

std::optional<Pose> PoseOfBoard(const Board& board, const BoardView& view,
                                const LensCamera& camera) {
  Rays rays = RaysOf(board, view, LensMap(camera));
  if (!KeepAgreeing(rays)) return std::nullopt;
  std::vector<cv::Point3d> corners;
  for (const cv::Point2d& p : rays.board) corners.emplace_back(p.x, p.y, 0.0);
  std::vector<cv::Mat> rotations, translations;
  try {
    cv::solvePnPGeneric(corners, rays.rays, cv::Matx33d::eye(), cv::noArray(), rotations,
                        translations, false, cv::SOLVEPNP_IPPE);
  } catch (const cv::Exception&) {
    return std::nullopt;  // corners on a line
  }
  std::optional<Pose> best;
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < rotations.size(); ++i) {
    const Pose pose =
        PoseFromOpenCv(rotations[i], translations[i], board, rays.turned_from_cam.conjugate());
    if (!pose.rotation.coeffs().allFinite() || !pose.translation.allFinite()) continue;
    const double misfit = RobustSigma(ResidualLengths(board, view, camera, pose));
    if (misfit < least) {
      least = misfit;
      best = pose;
    }
  }
  return best;
}

BoardStart StartBoard(const Board& board, std::span<const BoardView> views, int width_px,
                      int height_px, BoardModel model) {
  const std::vector<BoardView> some = SomeOf(views);
  BoardStart best;
  double least = std::numeric_limits<double>::infinity();
  for (const double f : CandidateFocals(board, some, width_px, height_px, model)) {
    std::vector<double> params(static_cast<size_t>(FreeParameterCount(model)), 0.0);
    params[0] = params[1] = f;
    params[2] = 0.5 * width_px;
    params[3] = 0.5 * height_px;
    const LensCamera camera = CameraFrom(model, width_px, height_px, params);
    const double misfit = Misfit(board, some, camera);
    if (misfit < least) {
      least = misfit;
      best.camera = camera;
    }
  }
  size_t with_pose = 0;
  if (std::isfinite(least)) {
    for (const BoardView& view : views) {
      best.cam_from_board.push_back(PoseOfBoard(board, view, best.camera));
      with_pose += best.cam_from_board.back() ? 1 : 0;
    }
  }
  if (with_pose < kMinViews) {
    throw Error(fmt::format(
        "calibration: expected at least {} images whose corners lie like those of a {}, found {}; "
        "is it the board that was photographed?",
        kMinViews, TextOf(board), with_pose));
  }
  return best;
}

}  // namespace dtr::calib
