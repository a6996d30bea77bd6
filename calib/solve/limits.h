// calib/solve/limits.h -- internal to calib/solve: how little the solves of boards and rigs go on.
#pragma once
#include <cstddef>

namespace dtr::calib {

constexpr size_t kMinCorners = 4;         // of a view: a pose has 6 unknowns, these 8 numbers
constexpr size_t kMinViews = 3;           // of a camera: two agree about anything
constexpr double kMinAgreeing = 1.0 / 3;  // of a view's corners; else its pose is a guess

}  // namespace dtr::calib
