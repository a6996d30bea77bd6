// viewer/glfw/picture_schedule.h -- when which picture is made.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "viewer/glfw/picture_maker.h"
#include "viewer/governor.h"
#include "viewer/stillness.h"

namespace dtr::viewer {

/// Small pictures while something moves, whole ones when nothing does. A picture that cannot be
/// made is told of and, when it was a small one, tried once more in full.
class PictureSchedule {
 public:
  enum class Pace {
    kMoving,   ///< the camera goes on by itself: small pictures
    kResting,  ///< small ones until the order has not changed for a while
    kWhole,    ///< none but whole ones, however long they take
  };

  /// `largest_divisor`: moving pictures are never smaller. `tell` is given each trouble once.
  PictureSchedule(PictureMaker& maker, int largest_divisor,
                  std::function<void(const std::string&)> tell);

  /// Makes the picture that is due, if one is. Returns true when it was a moving one.
  bool Make(const PictureOrder& order, Pace pace);
  /// What was made is not to be relied on any more: the next picture is made anew.
  void Renew() { made_.reset(); }
  /// How long the window took for the frame of the last moving picture, milliseconds.
  void MovingTook(double ms);

  /// True when what is shown is all that is ordered.
  bool WholeFor(const PictureOrder& order) const;
  /// True when something was made, or refused, for this order.
  bool MadeFor(const PictureOrder& order) const;
  /// True when the maker's picture was drawn: there is something to read back.
  bool has_picture() const { return has_picture_; }
  /// True while a whole picture of the last order is still to come.
  bool Due() const { return !refusal_ && !(has_picture_ && maker_.picture().whole); }
  /// Why the last whole picture could not be made.
  const std::optional<std::string>& refusal() const { return refusal_; }
  /// Counts the pictures, to notice a new one.
  int count() const { return count_; }

 private:
  void MakeNow(const PictureOrder& order, bool small);

  PictureMaker& maker_;
  const std::function<void(const std::string&)> tell_;
  /// One for each kind of picture: some cost several times as much as others.
  std::vector<ResolutionGovernor> governors_;
  std::optional<PictureOrder> made_;
  std::optional<std::string> refusal_;
  std::string told_;
  Stillness stillness_;
  bool has_picture_ = false;
  int count_ = 0;
};

}  // namespace dtr::viewer
