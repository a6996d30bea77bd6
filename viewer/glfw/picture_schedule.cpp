#include "viewer/glfw/picture_schedule.h"

#include <exception>
#include <utility>

#include "viewer/glfw/error_text.h"

namespace dtr::viewer {
namespace {

constexpr double kMovingTargetMs = 60;  // with the window's own work about 15 frames per second

bool SameOrder(const PictureOrder& a, const PictureOrder& b) {
  const Pose &p = a.camera.cam_from_world, &q = b.camera.cam_from_world;
  return a.camera.camera == b.camera.camera && p.translation == q.translation &&
         p.rotation.coeffs() == q.rotation.coeffs() && a.options == b.options &&
         a.shown == b.shown && a.instant == b.instant && a.hidden == b.hidden;
}

/// All but what only changes what pixels mean: it can wait for the whole image.
bool SamePlace(const PictureOrder& a, PictureOrder b) {
  b.shown = a.shown;
  b.hidden = a.hidden;
  return SameOrder(a, b);
}

}  // namespace

PictureSchedule::PictureSchedule(PictureMaker& maker, int largest_divisor,
                                 std::function<void(const std::string&)> tell)
    : maker_(maker),
      tell_(std::move(tell)),
      governors_(kAllShown.size(),
                 ResolutionFrameRateController(kMovingTargetMs, largest_divisor)) {}

bool PictureSchedule::WholeFor(const PictureOrder& order) const {
  return MadeFor(order) && has_picture_ && !rejection_ && maker_.picture().whole;
}

bool PictureSchedule::MadeFor(const PictureOrder& order) const {
  return made_ && SameOrder(order, *made_);
}

bool PictureSchedule::Make(const PictureOrder& order, Pace pace) {
  const bool changed = !MadeFor(order);
  if (made_ && !SamePlace(order, *made_)) stillness_.Moved();
  const bool small =
      made_ && pace != Pace::kWhole && (pace == Pace::kMoving || changed || !stillness_.still());
  if (!changed && (small || !Due())) return false;
  MakeNow(order, small);
  return small && has_picture_;
}

void PictureSchedule::MakeNow(const PictureOrder& order, bool small) {
  rejection_.reset();
  has_picture_ = false;
  ++count_;
  made_ = order;
  try {
    if (small) {
      maker_.MakeMoving(order, governors_[static_cast<size_t>(order.shown)].divisor());
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

void PictureSchedule::MovingTook(double ms) {
  const MadePicture& picture = maker_.picture();
  governors_[static_cast<size_t>(picture.shown)].Drawn(picture.divisor, ms);
}

}  // namespace dtr::viewer
