// calib/solve/rig_minimise.h -- internal to calib/solve: one least-squares solve of a rig or of one
// frame, with what counts and the loss fixed. For its .cpp files only: shows Ceres.
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "calib/solve/least_squares.h"
#include "calib/solve/rig_solve.h"

namespace dtr::calib {

/// SigmaOfUsed or ScatterOfUsed, px.
using SigmaRule = double (*)(const std::vector<std::vector<double>>& lengths_px, const Used&);

/// Sigma per camera, px; that of all where a camera has no view.
std::vector<double> CameraSigmas(const Rig& rig, const std::vector<std::vector<double>>& lengths_px,
                                 const Used& used, SigmaRule sigma_of);

/// Least squares over the used corners from where the rig is; Cauchy's loss where a scale is given.
/// Throws Error where there is no solution or no camera of the model explains the corners.
void Minimise(const Board& board, bool free_lenses, std::optional<double> cauchy_px,
              const Used& used, Rig& rig);

/// Least squares over the used corners of a frame's views by the board's pose alone; leaves the
/// pose as it is where there are too few corners or no solution.
void MinimiseFrame(const Board& board, const std::vector<size_t>& views, const Used& used,
                   std::optional<double> cauchy_px, size_t frame, Rig& rig);

}  // namespace dtr::calib
