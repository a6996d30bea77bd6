// viewer/controller.h -- turns input into the motion of a camera.
#pragma once
#include <array>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "dtr/types/dtr_set.h"
#include "viewer/input.h"
#include "viewer/navigation.h"

namespace dtr::viewer {

/// What the controller knows of the scene. The views must outlive it.
struct Surroundings {
  std::vector<const View*> views;  ///< source views: what images are drawn from
  /// Input cameras, those of held-out photos too, in the order in which they are stepped through.
  std::vector<const View*> cameras;
  Bounds bounds;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
};
/// Of one of the set's frames; views and cameras in byte order of their ids.
Surroundings SurroundingsOf(const DtrSet& set, size_t frame = 0);

/// How far the cameras stand from the middle of the scene (median, scene units; 1 where that tells
/// nothing): bounds can reach to the horizon.
double SceneSize(const Surroundings& surroundings);

/// What to look at: the bounds without what lies further from the middle than kMaxSceneSizes
/// times the scene's size along an axis, as sky and horizon do; all of them where nothing is left.
Bounds Foreground(const Surroundings& surroundings);
inline constexpr double kMaxSceneSizes = 4;

/// The camera of a window and how it moves. Left drag: orbit about the point under the cursor.
/// Right drag: look around. Middle drag: pan. Wheel: towards the point under the cursor; while
/// flying or looking, the speed of flight. Fly keys: fly.
class Controller {
 public:
  /// Plane z of what the image shows at a pixel; none where it shows nothing.
  using DepthAt = std::function<std::optional<double>(const Eigen::Vector2d& pixel)>;

  /// Starts at the camera of OpeningView, or nowhere in particular without a source view. `up`:
  /// WorldUp, unit length. Sizes in pixels.
  Controller(Surroundings surroundings, const Eigen::Vector3d& up, int width_px, int height_px,
             DepthAt depth_at);

  const NovelCamera& camera() const { return camera_; }
  /// Camera that it started at, of the photo's own size.
  const NovelCamera& home() const { return home_; }
  /// Has the whole foreground in its image; of the window's size.
  NovelCamera Overview() const;
  /// Intrinsics of the photo or file that it shows or glides to, before they fill the window.
  const PinholeCamera& lens() const { return lens_; }
  /// Scene units per second.
  double fly_speed() const { return fly_speed_; }
  void set_fly_speed(double units_per_s);
  Eigen::Vector3d up() const { return up_; }
  const Surroundings& surroundings() const { return surroundings_; }
  /// Another time step of the same scene: the camera stays where it is and goes on as it went, and
  /// up stays up.
  void SetSurroundings(Surroundings surroundings) { surroundings_ = std::move(surroundings); }

  void Handle(const InputEvent& event);
  /// Time passes: flight and glides go on. Glides and steps never depend on how long a frame took
  /// in where they end.
  void Advance(double seconds);
  /// True while the camera moves, or will with the next Advance.
  bool moving() const;
  bool dragging() const { return drag_.has_value(); }

  void Resize(int width_px, int height_px);

  /// All of these glide; a drag or a key stops them where they are.
  void GoTo(const NovelCamera& camera);
  void GoToView(size_t index);  ///< of `cameras`
  void StepViews(int by);       ///< from the view stepped to last, or the nearest
  void GoToNearestView();
  /// Begins there instead: home, too.
  void StartAt(const NovelCamera& camera);
  /// At once, without a glide.
  void JumpTo(const NovelCamera& camera);

  /// Index into `cameras` of the one whose place this is just now; none between them.
  std::optional<size_t> at_view() const;
  std::optional<size_t> nearest_view() const;
  /// Index into `views`: the nearest that images are drawn from.
  std::optional<size_t> nearest_source() const;
  double scene_size() const { return SceneSize(surroundings_); }

 private:
  struct Drag {
    Button button;
    Eigen::Vector2d last_px;
    Eigen::Vector3d pivot;  ///< world
    double pivot_z;         ///< plane z, scene units
  };
  struct Glide {
    NovelCamera from, to;
    double elapsed_s = 0;
  };

  void On(const ButtonEvent& event);
  void On(const MoveEvent& event);
  void On(const ScrollEvent& event);
  void On(const FlyEvent& event);
  void On(const FocusLostEvent&);
  double DepthOrUsual(const Eigen::Vector2d& pixel) const;
  bool flying() const;

  Surroundings surroundings_;
  const DepthAt depth_at_;
  const Eigen::Vector3d up_;
  PinholeCamera lens_;  ///< of the photo or file that the camera shows or glides to
  NovelCamera camera_, home_;
  double orbit_rad_;  ///< by a drag across the image's longer side
  double fly_speed_;
  std::optional<Drag> drag_;
  std::optional<Glide> glide_;
  std::optional<size_t> stepped_to_;
  std::array<bool, kFlyKeys> held_{};
  /// Seconds of flight owed by keys that were pressed, also those let go since.
  std::array<double, kFlyKeys> owed_s_{};
};

}  // namespace dtr::viewer
