#include "viewer/glfw/frame_schedule.h"

#include <exception>
#include <utility>

#include "viewer/glfw/error_text.h"

namespace dtr::viewer {
namespace {

constexpr double kMovingTargetMs = 60;  // with the window's own work about 15 frames per second

bool SameOrder(const FrameRequest& a, const FrameRequest& b) {
  const Pose &p = a.camera.cam_from_world, &q = b.camera.cam_from_world;
  return a.camera.camera == b.camera.camera && p.translation == q.translation &&
         p.rotation.coeffs() == q.rotation.coeffs() && a.options == b.options &&
         a.shown == b.shown && a.time_step == b.time_step && a.hidden == b.hidden;
}

/// All but what only changes what pixels mean: it can wait for the whole image.
bool SamePlace(const FrameRequest& a, FrameRequest b) {
  b.shown = a.shown;
  b.hidden = a.hidden;
  return SameOrder(a, b);
}

}  // namespace

FrameSchedule::FrameSchedule(FrameMaker& maker, int largest_divisor,
                             std::function<void(const std::string&)> tell)
    : maker_(maker),
      tell_(std::move(tell)),
      controllers_(kAllShown.size(),
                   ResolutionFrameRateController(kMovingTargetMs, largest_divisor)) {}

bool FrameSchedule::WholeFor(const FrameRequest& order) const {
  return MadeFor(order) && has_picture_ && !rejection_ && maker_.picture().whole;
}

bool FrameSchedule::MadeFor(const FrameRequest& order) const {
  return made_ && SameOrder(order, *made_);
}

bool FrameSchedule::Make(const FrameRequest& order, Pace pace) {
  const bool changed = !MadeFor(order);
  if (made_ && !SamePlace(order, *made_)) stillness_.Moved();
  const bool small =
      made_ && pace != Pace::kWhole && (pace == Pace::kMoving || changed || !stillness_.still());
  if (!changed && (small || !Due())) return false;
  MakeNow(order, small);
  return small && has_picture_;
}

void FrameSchedule::MakeNow(const FrameRequest& order, bool small) {
  rejection_.reset();
  has_picture_ = false;
  ++count_;
  made_ = order;
  try {
    if (small) {
      maker_.MakeMoving(order, controllers_[static_cast<size_t>(order.shown)].divisor());
    } else {
      maker_.MakeStill(order);
    }
    has_picture_ = true;
    told_.clear();
  } catch (const std::exception& error) {
    const std::string said = Said(error);
    if (!small) rejection_ = said;
    if (std::exchange(told_, said) != said) tell_(said);
  }
}

void FrameSchedule::MovingTook(double ms) {
  const MadeFrame& picture = maker_.picture();
  controllers_[static_cast<size_t>(picture.shown)].Drawn(picture.divisor, ms);
}

}  // namespace dtr::viewer
