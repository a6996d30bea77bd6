#include "dtr/io/formats/foreign_scene.h"

#include <algorithm>

namespace dtr::io {
namespace {

bool AllZero(const double* values, size_t count) {
  return std::all_of(values, values + count, [](double v) { return v == 0; });
}

}  // namespace

Distortion LensFrom(const BrownTerms& t) {
  Distortion lens{"", {t.fx, t.fy, t.cx, t.cy}};
  const auto with = [&](const char* model, std::initializer_list<double> terms) {
    lens.model = model;
    lens.params.insert(lens.params.end(), terms);
    return lens;
  };
  const bool plain = t.skew == 0 && AllZero(t.p.data() + 2, 2) && AllZero(t.k.data() + 4, 2);
  const bool central = AllZero(t.p.data(), 2);
  const auto& [k1, k2, k3, k4, k5, k6] = t.k;
  const auto& [p1, p2, p3, p4] = t.p;
  if (plain && t.fisheye) {
    if (central) return with("OPENCV_FISHEYE", {k1, k2, k3, k4});
    return with("THIN_PRISM_FISHEYE", {k1, k2, p1, p2, k3, k4, 0, 0});
  }
  if (plain && k4 == 0) {
    if (central && AllZero(t.k.data(), 3)) return with("PINHOLE", {});
    if (k3 == 0) return with("OPENCV", {k1, k2, p1, p2});
    return with("FULL_OPENCV", {k1, k2, p1, p2, k3, 0, 0, 0});
  }
  return with(t.fisheye ? "FISHEYE_AFFINE" : "BROWN_AFFINE",
              {k1, k2, k3, k4, k5, k6, p1, p2, p3, p4, t.skew});
}

}  // namespace dtr::io
