// capture/video/frame_motion.h -- how far the image of a camera has moved.
#pragma once
#include <memory>

#include "dtr/types/grid.h"

namespace dtr::capture {

/// Follows corners of one image through the images after it (Shi & Tomasi 1994, "Good features
/// to track"; Lucas & Kanade with pyramids, Bouguet 2000), there and back: a corner that does not
/// come back to where it was is dropped.
class FrameMotion {
 public:
  /// What has become of the first image's corners.
  struct State {
    double moved = 0;  ///< median way of those still followed, of the image's long side
    double kept = 1;   ///< share of them still followed
  };

  /// `grey`: 8-bit luma, one channel. Some 300 px wide do: the way of corners is wanted, not
  /// detail.
  explicit FrameMotion(const Grid<std::uint8_t>& grey);
  ~FrameMotion();
  FrameMotion(FrameMotion&&) noexcept;
  FrameMotion& operator=(FrameMotion&&) noexcept;

  /// False where the first image has too few corners to say anything.
  bool has_texture() const;
  /// `grey` is the next image, of the same size.
  State Follow(const Grid<std::uint8_t>& grey);

 private:
  struct Corners;
  std::unique_ptr<Corners> corners_;
};

}  // namespace dtr::capture
