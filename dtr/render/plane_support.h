// dtr/render/plane_support.h -- how much of an image lies on a plane, several samples at once.
#pragma once
#include <cstddef>
#include <vector>

namespace dtr {

/// Positions of an image and their inverse depths.
struct PlaneSamples {
  std::vector<double> x, y, inverse_depth;  ///< of equal length
  size_t size() const { return x.size(); }
};

/// How many samples lie within `tolerance` of the plane a x + b y + c; the same number whatever the
/// processor's vectors hold.
size_t PlaneSupport(const PlaneSamples& samples, double a, double b, double c, double tolerance);

}  // namespace dtr
