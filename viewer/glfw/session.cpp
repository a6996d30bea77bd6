#include "viewer/glfw/session.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "viewer/navigation.h"
#include "viewer/world_up.h"

namespace dtr::viewer {
namespace {

gl::RendererSettings MakerSettings(const AppSettings& settings, const Session::Tell& tell) {
  gl::RendererSettings renderer;
  renderer.shader_folder = settings.shader_folder;
  renderer.gpu_bytes = settings.gpu_bytes;
  renderer.warn = tell;
  return renderer;
}

}  // namespace

Session::Session(const AppSettings& settings, const Host& host, const Tell& tell, int width_px,
                 int height_px)
    : host_(host),
      opened_(host.open()),
      clock_(opened_->set),
      sigmas_(host.load_sigma),
      maker(*opened_->stream, ViewColours(opened_->set), MakerSettings(settings, tell),
            settings.drawer, [this](const View& view) { return SigmaOfView(view); }),
      schedule(maker, settings.largest_divisor, tell),
      controller(SurroundingsOf(opened_->set), WorldUp(opened_->set), width_px, height_px,
                 [this](const Eigen::Vector2d& pixel) { return DepthAt(pixel); }),
      inspector({maker, schedule, controller,
                 [this](const View& view) { return SigmaOfView(view); }, host.validations,
                 host.load_photo, tell}) {
  inspector.inspection().unit = opened_->set.unit == LengthUnit::kMetre ? "m" : "units";
  Hide(settings.hidden);
}

Eigen::Vector3d Session::ContinueFrom(const Session& before) {
  // Stored worlds are relative to their sets' origins.
  const Eigen::Vector3d shift = opened_->set.world_origin - before.opened_->set.world_origin;
  NovelCamera there = InMovedWorld(before.controller.camera(), shift);
  there.camera = before.controller.lens();
  controller.StartAt(InMovedWorld(before.controller.home(), shift));
  controller.JumpTo(there);
  controller.set_fly_speed(before.controller.fly_speed());
  Inspection& mine = inspector.inspection();
  const Inspection& theirs = before.inspector.inspection();
  mine.cameras = theirs.cameras;
  mine.magnifier = theirs.magnifier;
  mine.compared = theirs.compared;
  mine.border = theirs.border;
  mine.hidden.clear();
  Hide(before.HiddenNames());
  ShowTimeStep(std::min(before.time_step(), clock_.frames() - 1));
  return shift;
}

void Session::Hide(const std::vector<std::string>& names) {
  hidden_elsewhere_ = names;
  for (const View* view : controller.surroundings().views) {
    if (std::find(names.begin(), names.end(), view->name) == names.end()) continue;
    inspector.inspection().Toggle(*view);
    std::erase(hidden_elsewhere_, view->name);
  }
}

void Session::ShowTimeStep(size_t time_step) {
  if (std::exchange(time_step_, time_step) == time_step) return;
  const std::vector<std::string> hidden = HiddenNames();
  controller.SetSurroundings(SurroundingsOf(opened_->set, time_step));
  inspector.inspection().hidden.clear();
  Hide(hidden);
}

NovelCamera Session::Overview(FrameRequest request) {
  constexpr double kMinShare = 0.9;  // of the coverage at home
  constexpr int kHalvings = 8;
  const PinholeCamera& window = controller.camera().camera;
  const NovelCamera& home = controller.home();
  request.camera = {FillLens(home.camera, window.width_px(), window.height_px()),
                    home.cam_from_world};
  const NovelCamera from = request.camera, to = controller.Overview();
  const double min_coverage = kMinShare * maker.CoverageOf(request);
  const auto covers = [&](double share) {
    request.camera = Between(from, to, share);
    return maker.CoverageOf(request) >= min_coverage;
  };
  double share = covers(1) ? 1 : 0;
  for (double step = 0.5; share < 1 && step > std::ldexp(1.0, -kHalvings - 1); step /= 2) {
    if (covers(share + step)) share += step;
  }
  return {home.camera, Between(from, to, share).cam_from_world};
}

void Session::RetryLostViews() {
  if (!host_.view_stamp) return;
  const auto changed_since = [this](std::map<const View*, std::string>& tried) {
    return [this, &tried](const View& view) {
      const std::string stamp = host_.view_stamp(view);
      return !stamp.empty() && std::exchange(tried[&view], stamp) != stamp;
    };
  };
  inspector.TryPhotosAgain(changed_since(tried_photos_));
  if (opened_->stream->lost().empty()) return;
  if (opened_->stream->RetryLost(changed_since(tried_views_)) > 0) schedule.Renew();
}

const Grid<float>* Session::SigmaOfView(const View& view) {
  if (const Grid<float>* known = sigmas_.Known(view)) return known;
  const MadeFrame& picture = maker.picture();
  std::set<const View*> in_picture;
  for (const int index : picture.views_used) {
    in_picture.insert(picture.scene.views[static_cast<size_t>(index)]);
  }
  return sigmas_.Of(view, in_picture);
}

std::optional<double> Session::DepthAt(const Eigen::Vector2d& pixel) {
  if (!schedule.has_picture()) return std::nullopt;
  const NovelCamera& shown = maker.picture().camera;
  const PinholeCamera& now = controller.camera().camera;
  const auto x = static_cast<int>(pixel.x() * shown.camera.width_px() / now.width_px());
  const auto y = static_cast<int>(pixel.y() * shown.camera.height_px() / now.height_px());
  const DepthImage& depth = maker.Result().depth;
  if (!depth.Contains(x, y) || DepthImage::IsHole(depth(x, y))) return std::nullopt;
  const Eigen::Vector3d p_in_world = WorldPoint(shown, {x + 0.5, y + 0.5}, depth(x, y));
  const double z = (controller.camera().cam_from_world * p_in_world).z();
  return z > 0 ? std::optional(z) : std::nullopt;
}

std::vector<std::string> Session::HiddenNames() const {
  std::vector<std::string> names = hidden_elsewhere_;
  for (const View* view : inspector.inspection().hidden) names.push_back(view->name);
  return names;
}

std::vector<const View*> Session::HiddenAt(size_t time_step) const {
  const std::vector<std::string> names = HiddenNames();
  std::vector<const View*> hidden;
  for (const View& view : opened_->set.frames.at(time_step).views) {
    if (std::find(names.begin(), names.end(), view.name) != names.end()) hidden.push_back(&view);
  }
  return hidden;
}

void Session::Describe(AppState& state) const {
  state.camera = controller.camera();
  if (const auto at = controller.at_view()) {
    const View& view = *controller.surroundings().cameras[*at];
    state.at_view = view.name;
    state.at_held_out = view.role == ViewRole::kHeldOut;
  }
  state.fly_speed = controller.fly_speed();
  state.time_step = time_step_;
  state.time_steps = clock_.frames();

  const MadeFrame& picture = maker.picture();
  state.divisor = picture.divisor;
  for (const int index : picture.views_used) {
    state.views_used.push_back(picture.scene.views[static_cast<size_t>(index)]->name);
  }
  state.coverage = picture.coverage;

  const Inspection& inspection = inspector.inspection();
  if (const View* photo = inspector.photo()) state.photo = photo->name;
  state.thumbnails = inspector.thumbnails();
  state.cameras = inspection.cameras;
  state.magnifier = inspection.magnifier;
  state.compared = NameOf(inspection.compared);
  state.hidden = HiddenNames();
  state.distance = inspection.DistanceText();
  if (!inspection.magnifier || !inspection.under_cursor) return;
  for (const ProbeView& view : inspection.under_cursor->views) {
    state.under_cursor.push_back(view.name);
  }
}

}  // namespace dtr::viewer
