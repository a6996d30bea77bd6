// viewer/glfw/frame_schedule.h -- when which image is made.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "viewer/frame_rate_controller.h"
#include "viewer/glfw/frame_maker.h"
#include "viewer/stillness.h"

namespace dtr::viewer {

/// Small images while something moves, whole ones when nothing does. An image that cannot be
/// made is told of and, when it was a small one, tried once more in full.
class FrameSchedule {
 public:
  enum class Pace {
    kMoving,   ///< the camera goes on by itself: small images
    kResting,  ///< small ones until the order has not changed for a while
    kWhole,    ///< none but whole ones, however long they take
  };

  /// `largest_divisor`: moving images are never smaller. `tell` is given each error text once.
  FrameSchedule(FrameMaker& maker, int largest_divisor,
                std::function<void(const std::string&)> tell);

  /// Makes the image that is due, if one is. Returns true when it was a moving one.
  bool Make(const FrameRequest& order, Pace pace);
  /// What was made is not to be relied on any more: the next image is made again.
  void Renew() { made_.reset(); }
  /// How long the window took for the frame of the last moving image, milliseconds.
  void MovingTook(double ms);

  /// True when what is shown is all that is ordered.
  bool WholeFor(const FrameRequest& order) const;
  /// True when something was made, or rejected, for this order.
  bool MadeFor(const FrameRequest& order) const;
  /// True when the maker's image was drawn: there is something to read back.
  bool has_picture() const { return has_picture_; }
  /// True while a whole image of the last order is still to come.
  bool Due() const { return !rejection_ && !(has_picture_ && maker_.picture().whole); }
  /// Why the last whole image could not be made.
  const std::optional<std::string>& rejection() const { return rejection_; }
  /// Counts the images, to notice a new one.
  int count() const { return count_; }

 private:
  void MakeNow(const FrameRequest& order, bool small);

  FrameMaker& maker_;
  const std::function<void(const std::string&)> tell_;
  /// One for each kind of image: some cost several times as much as others.
  std::vector<ResolutionFrameRateController> controllers_;
  std::optional<FrameRequest> made_;
  std::optional<std::string> rejection_;
  std::string told_;
  Stillness stillness_;
  bool has_picture_ = false;
  int count_ = 0;
};

}  // namespace dtr::viewer
