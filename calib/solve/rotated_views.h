// calib/solve/rotated_views.h -- photos of one camera that a program rotated by a quarter turn.
#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/solve/board_solve.h"

namespace dtr::calib {

/// The view on the sensor's grid of `width_px` x `height_px`, of a photo that was rotated so; the
/// photo has the sides in the other order. Corners keep their ids: a rotated board is the same one.
BoardView OnSensorGrid(const BoardView& view, PhotoRotation rotation, int width_px, int height_px);

/// The camera that rotated views are compared with.
struct ReferenceCamera {
  LensCamera camera;
  /// Noise of a coordinate of its own corners: a view that it explains much worse is not of this
  /// camera. Empty where that is for others to find out.
  std::optional<double> sigma_px;
};

/// Solved from views that are not rotated, Brown's or the fisheye model, whichever leaves less.
/// Throws Error where they determine neither, or half a turn of the sensor would change the camera
/// by no more than it is uncertain: all rotated views would then agree on the same wrong way.
ReferenceCamera ReferenceFrom(const Board& board, std::span<const BoardView> views, int width_px,
                              int height_px);

/// Which way a photo was rotated, or why that cannot be told.
struct FoundRotation {
  PhotoRotation rotation = PhotoRotation::kNone;
  std::string undecided;
};

/// Finds which way each of the `rotated` views was rotated, by which of the two the camera explains
/// better. The two differ by half a turn of the sensor: by a principal point beside the middle of
/// the image, seen in the distortion above all, and by tangential distortion. A view decides for
/// itself where one way leaves less than half of the other's squared residuals; the others follow
/// those that do, if these agree. Where none does, all together decide if they agree beyond chance.
std::vector<FoundRotation> FindRotations(const Board& board, std::span<const BoardView> rotated,
                                         const ReferenceCamera& reference);

}  // namespace dtr::calib
