#include "viewer/controller.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "dtr/base/order_statistics.h"
#include "dtr/render/geometry.h"
#include "dtr/render/opening_view.h"

namespace dtr::viewer {
namespace {

// Dragging across the image's longer side orbits by what the cameras span, but by no less.
constexpr double kMinOrbitRad = std::numbers::pi / 8;
constexpr double kScrollFactor = 0.85;  // of the distance that is left after a step
constexpr double kSpeedFactor = 1.25;   // per step of the wheel
constexpr double kSceneSizesPerSecond = 0.3;
constexpr double kMinSpeedShare = 1e-4, kMaxSpeedShare = 100;  // of the scene's size per second
constexpr double kGlideSeconds = 0.35;
constexpr double kTapSeconds = 1.0 / 30;     // what a short press of a fly key moves
constexpr double kLongestStepSeconds = 0.1;  // a slow frame must not throw the camera far
constexpr double kSameCenterShare = 1e-9, kSameAxisRad = 1e-9;

Eigen::Vector3d DirectionOf(FlyKey key) {
  switch (key) {
    case FlyKey::kForward:
      return {0, 0, 1};
    case FlyKey::kBack:
      return {0, 0, -1};
    case FlyKey::kLeft:
      return {-1, 0, 0};
    case FlyKey::kRight:
      return {1, 0, 0};
    case FlyKey::kUp:
      return {0, -1, 0};
    case FlyKey::kDown:
      return {0, 1, 0};
  }
  return Eigen::Vector3d::Zero();
}

std::vector<Pose> PosesOf(const std::vector<const View*>& views) {
  std::vector<Pose> poses;
  for (const View* view : views) poses.push_back(view->cam_from_world);
  return poses;
}

bool SamePose(const Pose& a, const Pose& b, double scene_size) {
  return (a.TargetOriginInSource() - b.TargetOriginInSource()).norm() <=
             kSameCenterShare * scene_size &&
         a.rotation.angularDistance(b.rotation) <= kSameAxisRad;
}

}  // namespace

Surroundings SurroundingsOf(const DtrSet& set, size_t frame) {
  Surroundings surroundings;
  surroundings.bounds = set.bounds;
  surroundings.center = set.scene_center;
  for (const View& view : set.frames.at(frame).views) surroundings.cameras.push_back(&view);
  std::sort(surroundings.cameras.begin(), surroundings.cameras.end(),
            [](const View* a, const View* b) { return a->id < b->id; });
  for (const View* view : surroundings.cameras) {
    if (view->role == ViewRole::kSource) surroundings.views.push_back(view);
  }
  return surroundings;
}

double SceneSize(const Surroundings& surroundings) {
  std::vector<double> distances;
  for (const View* view : surroundings.views) {
    distances.push_back((view->CenterInWorld() - surroundings.center).norm());
  }
  if (distances.empty()) return 1;
  const auto middle = UpperMedian(distances);
  return middle > 0 && std::isfinite(middle) ? middle : 1;
}

Bounds Foreground(const Surroundings& surroundings) {
  const Bounds& bounds = surroundings.bounds;
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(kMaxSceneSizes * SceneSize(surroundings));
  const Bounds foreground{bounds.min.cwiseMax(surroundings.center - reach),
                          bounds.max.cwiseMin(surroundings.center + reach)};
  return bounds.empty() || foreground.empty() ? bounds : foreground;
}

Controller::Controller(Surroundings surroundings, const Eigen::Vector3d& up, int width_px,
                       int height_px, DepthAt depth_at)
    : surroundings_(std::move(surroundings)),
      depth_at_(std::move(depth_at)),
      up_(up),
      lens_(3, 2, 3, 3, 1.5, 1),
      orbit_rad_(std::max(CameraSpan(surroundings_.views, surroundings_.center), kMinOrbitRad)),
      fly_speed_(kSceneSizesPerSecond * SceneSize(surroundings_)) {
  if (surroundings_.views.empty()) {
    camera_ = {FillLens(lens_, width_px, height_px), {}};
    home_ = {lens_, {}};
    return;
  }
  const View& first = *surroundings_.views[OpeningView(surroundings_.views, surroundings_.center)];
  lens_ = first.camera;
  home_ = {lens_, first.cam_from_world};
  camera_ = {FillLens(lens_, width_px, height_px), first.cam_from_world};
  const auto& cameras = surroundings_.cameras;
  stepped_to_ =
      static_cast<size_t>(std::find(cameras.begin(), cameras.end(), &first) - cameras.begin());
}

void Controller::set_fly_speed(double units_per_s) {
  const double size = scene_size();
  fly_speed_ = std::clamp(units_per_s, kMinSpeedShare * size, kMaxSpeedShare * size);
}

void Controller::Handle(const InputEvent& event) {
  std::visit([this](const auto& e) { On(e); }, event);
}

double Controller::DepthOrUsual(const Eigen::Vector2d& pixel) const {
  if (const auto depth = depth_at_(pixel); depth && *depth > 0) return *depth;
  // Where nothing is seen: as far away as the middle of the scene, if that is in front.
  const double z = (camera_.cam_from_world * surroundings_.center).z();
  return z > 0 ? z : 0.5 * scene_size();
}

void Controller::On(const ButtonEvent& event) {
  const Eigen::Vector2d pixel(event.x_px, event.y_px);
  if (!event.pressed) {
    if (drag_ && drag_->button == event.button) drag_.reset();
    return;
  }
  if (drag_) return;  // one drag at a time
  glide_.reset();
  const double z = DepthOrUsual(pixel);
  drag_ = Drag{event.button, pixel, WorldPoint(camera_, pixel, z), z};
}

void Controller::On(const MoveEvent& event) {
  if (!drag_) return;
  const Eigen::Vector2d to(event.x_px, event.y_px);
  const Eigen::Vector2d by = to - drag_->last_px;
  if (by.isZero(0)) return;
  const double rad_per_px =
      orbit_rad_ / std::max(camera_.camera.width_px(), camera_.camera.height_px());
  Pose& pose = camera_.cam_from_world;
  switch (drag_->button) {
    case Button::kLeft:
      // The scene follows the hand: to the right turns the camera to the left about it.
      pose = Orbit(pose, drag_->pivot, up_, -by.x() * rad_per_px, -by.y() * rad_per_px);
      break;
    case Button::kRight: {
      const PinholeCamera& lens = camera_.camera;
      pose = Look(pose, up_, -by.x() / lens.fx_px(), -by.y() / lens.fy_px());
      break;
    }
    case Button::kMiddle:
      pose = Pan(camera_, drag_->last_px, to, drag_->pivot_z);
      break;
  }
  drag_->last_px = to;
}

void Controller::On(const ScrollEvent& event) {
  if (flying() || (drag_ && drag_->button == Button::kRight)) {
    set_fly_speed(fly_speed_ * std::pow(kSpeedFactor, event.steps));
    return;
  }
  glide_.reset();
  const Eigen::Vector2d pixel(event.x_px, event.y_px);
  const Eigen::Vector3d point = WorldPoint(camera_, pixel, DepthOrUsual(pixel));
  camera_.cam_from_world =
      Approach(camera_.cam_from_world, point, std::pow(kScrollFactor, event.steps));
}

void Controller::On(const FlyEvent& event) {
  const auto key = static_cast<size_t>(event.key);
  if (event.pressed && !held_[key]) {
    glide_.reset();
    owed_s_[key] = std::max(owed_s_[key], kTapSeconds);
  }
  held_[key] = event.pressed;
}

void Controller::On(const FocusLostEvent&) {
  held_.fill(false);
  drag_.reset();
}

bool Controller::flying() const {
  return std::any_of(held_.begin(), held_.end(), [](bool held) { return held; });
}

bool Controller::moving() const {
  return glide_.has_value() || flying() ||
         std::any_of(owed_s_.begin(), owed_s_.end(), [](double owed) { return owed > 0; });
}

void Controller::Advance(double seconds) {
  const double step = std::clamp(seconds, 0.0, kLongestStepSeconds);
  if (glide_) {
    glide_->elapsed_s += step;
    const double linear = std::min(1.0, glide_->elapsed_s / kGlideSeconds);
    const double share = linear * linear * (3 - 2 * linear);
    camera_ = share < 1 ? Between(glide_->from, glide_->to, share) : glide_->to;
    if (linear >= 1) glide_.reset();
  }
  Eigen::Vector3d way = Eigen::Vector3d::Zero();
  for (int key = 0; key < kFlyKeys; ++key) {
    const auto at = static_cast<size_t>(key);
    const double flown = std::max(held_[at] ? step : 0.0, owed_s_[at]);
    owed_s_[at] = 0;
    way += flown * DirectionOf(static_cast<FlyKey>(key));
  }
  if (!way.isZero(0)) camera_.cam_from_world = MoveInCam(camera_.cam_from_world, fly_speed_ * way);
}

void Controller::Resize(int width_px, int height_px) {
  const PinholeCamera lens = FillLens(lens_, width_px, height_px);
  if (glide_) {
    glide_->from.camera = FillLens(glide_->from.camera, width_px, height_px);
    glide_->to.camera = lens;
  }
  camera_.camera = glide_ ? FillLens(camera_.camera, width_px, height_px) : lens;
}

void Controller::StartAt(const NovelCamera& camera) {
  home_ = camera;
  JumpTo(camera);
}

void Controller::JumpTo(const NovelCamera& camera) {
  glide_.reset();
  drag_.reset();
  lens_ = camera.camera;
  camera_ = {FillLens(lens_, camera_.camera.width_px(), camera_.camera.height_px()),
             camera.cam_from_world};
}

void Controller::GoTo(const NovelCamera& camera) {
  drag_.reset();
  lens_ = camera.camera;
  const NovelCamera to{FillLens(lens_, camera_.camera.width_px(), camera_.camera.height_px()),
                       camera.cam_from_world};
  glide_ = Glide{camera_, to};
}

void Controller::GoToView(size_t index) {
  if (index >= surroundings_.cameras.size()) return;
  stepped_to_ = index;
  GoTo({surroundings_.cameras[index]->camera, surroundings_.cameras[index]->cam_from_world});
}

void Controller::StepViews(int by) {
  const auto count = static_cast<int>(surroundings_.cameras.size());
  if (count == 0) return;
  // By its own pose: of two cameras at one place at_view() knows the first alone.
  const bool there = stepped_to_ && *stepped_to_ < surroundings_.cameras.size() &&
                     SamePose(surroundings_.cameras[*stepped_to_]->cam_from_world,
                              camera_.cam_from_world, scene_size());
  const bool on_the_way = glide_.has_value() || there;
  const std::optional<size_t> from = on_the_way ? stepped_to_ : nearest_view();
  const int to = (static_cast<int>(from.value_or(0)) + by % count + count) % count;
  GoToView(static_cast<size_t>(to));
}

void Controller::GoToNearestView() {
  if (const auto nearest = nearest_view()) GoToView(*nearest);
}

NovelCamera Controller::Overview() const {
  const PinholeCamera lens =
      FillLens(home_.camera, camera_.camera.width_px(), camera_.camera.height_px());
  return {lens, ViewAll(Foreground(surroundings_), PosesOf(surroundings_.views), up_, lens)};
}

std::optional<size_t> Controller::nearest_view() const {
  return NearestView(surroundings_.cameras, camera_.cam_from_world, scene_size());
}

std::optional<size_t> Controller::nearest_source() const {
  return NearestView(surroundings_.views, camera_.cam_from_world, scene_size());
}

std::optional<size_t> Controller::at_view() const {
  const auto nearest = nearest_view();
  if (!nearest) return std::nullopt;
  const Pose& view = surroundings_.cameras[*nearest]->cam_from_world;
  if (!SamePose(view, camera_.cam_from_world, scene_size())) return std::nullopt;
  return nearest;
}

}  // namespace dtr::viewer
