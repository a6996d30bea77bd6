// stereo/left_out.h -- what an engine leaves out where a view does not need it.
#pragma once

namespace dtr::stereo {

/// An engine that asks of each view which of its steps are of use there, and counts. Thread-safe.
class CountsLeftOut {
 public:
  virtual ~CountsLeftOut() = default;
  /// Views whose depth was given so far without fitting planes to weak texture: hardly a pixel was
  /// in doubt.
  virtual int without_planes() const = 0;
};

}  // namespace dtr::stereo
