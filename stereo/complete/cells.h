// stereo/complete/cells.h -- a view in little: what completion asks of it.
#pragma once
#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <optional>

#include "dtr/types/camera.h"
#include "dtr/types/grid.h"
#include "dtr/types/pose.h"
#include "dtr/types/view.h"

namespace dtr::stereo {

/// A plane before a camera: n . p = 1 for its points p in the camera's frame, so that the inverse
/// depth along a ray (z = 1) is n . ray. Zero is the plane at infinity. Units of 1 / scene unit.
using ViewPlane = Eigen::Vector3f;

/// A view averaged over square cells of its photo. Grids have shape (rows, columns) of cells.
struct CellView {
  PinholeCamera camera{1, 1, 1, 1, 0, 0};  ///< of the grids: a pixel is a cell
  Pose cam_from_world;
  Grid<float> colour;         ///< R, G, B, sRGB levels in the mean exposure of the set
  Mask usable;                ///< 0 where a cell is masked altogether
  Grid<float> inverse_depth;  ///< median of the measured depths; 0 where less than half has any
  Grid<float> planes;         ///< ViewPlane of measured cells, 3 channels
  Grid<std::uint8_t> shared;  ///< 255 where measured, but the cell has holes as well
  int cell_px = 1;            ///< photo pixels per cell and axis
  float pixel = 0;            ///< difference of inverse depth that is one cell of disparity

  ViewPlane PlaneAt(int x, int y) const {
    return {planes(x, y, 0), planes(x, y, 1), planes(x, y, 2)};
  }
  /// Ray of a position in cells, z = 1.
  Eigen::Vector3f RayAt(float x, float y) const {
    return {(x - static_cast<float>(camera.cx_px())) / static_cast<float>(camera.fx_px()),
            (y - static_cast<float>(camera.cy_px())) / static_cast<float>(camera.fy_px()), 1};
  }
  /// Mean difference of two cells' colours over the channels, levels.
  float Difference(int x, int y, int u, int v) const {
    float difference = 0;
    for (int c = 0; c < 3; ++c) difference += std::abs(colour(x, y, c) - colour(u, v, c)) / 3;
    return difference;
  }
  /// Of a cell's centre.
  Eigen::Vector3f RayOf(int x, int y) const {
    return RayAt(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
  }
};

/// Of a loaded view (image, mask, measured depth) with its reference_baseline. The longer side has
/// at most 340 cells.
CellView MakeCells(const View& view);
/// Bytes of the cells of a view of this camera.
std::uint64_t CellBytes(const PinholeCamera& camera);

/// The same plane before another camera; empty where that camera's centre lies on it.
std::optional<ViewPlane> PlaneInOther(const ViewPlane& plane, const Pose& other_from_view);

}  // namespace dtr::stereo
