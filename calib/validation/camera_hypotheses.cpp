#include "calib/validation/camera_hypotheses.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>

namespace dtr::calib {
namespace {

using Eigen::Matrix3d;
using Cameras = std::vector<GivenCamera>;

// Changes a lens; false: it does not apply.
using LensChange = std::function<bool(LensCamera&)>;

Pose Turned(const Matrix3d& axes, const Pose& pose) {
  return Pose{Eigen::Quaterniond(axes).normalized(), Eigen::Vector3d::Zero()} * pose;
}

Matrix3d Axes(std::initializer_list<double> rows) {
  Matrix3d axes;
  int i = 0;
  for (const double value : rows) {
    axes(i / 3, i % 3) = value;
    ++i;
  }
  return axes;
}

struct AxesOf {
  const char* name;
  const char* advice;
  Matrix3d cam_from_file;
};

// `cam_from_file`: axes of docs/CONVENTIONS.md from those of the file.
std::vector<AxesOf> KnownAxes() {
  return {
      {"OpenGL's axes (y up, z back)",
       "turn the axes of the cameras (transforms.json has OpenGL's; in a cameras.json negate "
       "the second and third row of cam_from_world)",
       Axes({1, 0, 0, 0, -1, 0, 0, 0, -1})},
      {"PyTorch3D's axes (x left, y up)",
       "turn the axes of the cameras (in a cameras.json negate the first and second row of "
       "cam_from_world)",
       Axes({-1, 0, 0, 0, -1, 0, 0, 0, 1})},
      {"LLFF's axes (down, right, back)", "give the poses_bounds.npy itself, or reorder the axes",
       Axes({0, 1, 0, 1, 0, 0, 0, 0, -1})}};
}

void AddPoses(std::span<const GivenCamera> cameras, std::vector<CameraHypothesis>& out) {
  const auto add = [&](const std::string& name, const std::string& advice,
                       const std::function<Pose(const Pose&)>& change) {
    CameraHypothesis hypothesis{name, advice, false, Cameras(cameras.begin(), cameras.end())};
    for (GivenCamera& camera : hypothesis.cameras) {
      camera.cam_from_world = change(camera.cam_from_world);
    }
    out.push_back(std::move(hypothesis));
  };
  constexpr char kInvert[] = "invert the matrices: cam_from_world (world-to-camera) is expected";
  add("camera-to-world matrices", kInvert, [](const Pose& pose) { return pose.Inverse(); });
  for (const AxesOf& axes : KnownAxes()) {
    add(axes.name, axes.advice, [&](const Pose& pose) { return Turned(axes.cam_from_file, pose); });
    add(fmt::format("camera-to-world matrices with {}", axes.name),
        fmt::format("{}, and {}", kInvert, axes.advice),
        [&](const Pose& pose) { return Turned(axes.cam_from_file, pose.Inverse()); });
  }
}

// Numbers in names are compared as such.
bool EarlierByNumber(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!digit(a[i]) || !digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
      continue;
    }
    const auto end = [&](const std::string& text, size_t at) {
      while (at < text.size() && digit(text[at])) ++at;
      return at;
    };
    while (i < a.size() && a[i] == '0') ++i;
    while (j < b.size() && b[j] == '0') ++j;
    const size_t of_a = end(a, i), of_b = end(b, j);
    if (of_a - i != of_b - j) return of_a - i < of_b - j;
    const int order = a.compare(i, of_a - i, b, j, of_b - j);
    if (order != 0) return order < 0;
    i = of_a;
    j = of_b;
  }
  return a.size() - i < b.size() - j;
}

// Photo i has the camera that was given for photo from[i].
CameraHypothesis Reordered(std::span<const GivenCamera> cameras, const std::vector<size_t>& from,
                           const std::string& what) {
  CameraHypothesis hypothesis{
      fmt::format("photos in another order ({})", what),
      "pair cameras and photos by name, or put the photos into the order of the cameras", false,
      Cameras(cameras.begin(), cameras.end())};
  for (size_t i = 0; i < from.size(); ++i) {
    hypothesis.cameras[i].lens = cameras[from[i]].lens;
    hypothesis.cameras[i].cam_from_world = cameras[from[i]].cam_from_world;
  }
  return hypothesis;
}

void AddOrders(std::span<const GivenCamera> cameras, std::vector<CameraHypothesis>& out) {
  const size_t n = cameras.size();
  std::vector<size_t> order(n);
  std::iota(order.begin(), order.end(), size_t{0});
  std::vector<size_t> reversed(order.rbegin(), order.rend());
  out.push_back(Reordered(cameras, reversed, "reversed"));
  for (const auto& [step, what] :
       {std::pair<size_t, const char*>{1, "each has the camera of the one before it"},
        {n - 1, "each has the camera of the one behind it"}}) {
    std::vector<size_t> shifted;
    for (size_t i = 0; i < n; ++i) shifted.push_back((i + step) % n);
    out.push_back(Reordered(cameras, shifted, what));
  }
  // A file's k-th camera went to the k-th name of one order, and belongs to that of the other.
  std::vector<size_t> by_number = order;
  std::stable_sort(by_number.begin(), by_number.end(), [&](size_t a, size_t b) {
    return EarlierByNumber(cameras[a].name, cameras[b].name);
  });
  if (by_number == order) return;
  std::vector<size_t> inverse(n);
  for (size_t k = 0; k < n; ++k) inverse[by_number[k]] = k;
  out.push_back(Reordered(cameras, inverse, "by letters, not by number: 1, 10, 2"));
  out.push_back(Reordered(cameras, by_number, "by number, not by letters: 1, 2, 10"));
}

void AddLens(std::span<const GivenCamera> cameras, const std::string& name,
             const std::string& advice, bool is_fine, const LensChange& change,
             std::vector<CameraHypothesis>& out) {
  CameraHypothesis hypothesis{name, advice, is_fine, Cameras(cameras.begin(), cameras.end())};
  bool any = false;
  for (GivenCamera& camera : hypothesis.cameras) {
    const LensCamera before = camera.lens;
    if (!change(camera.lens)) {
      camera.lens = before;
      continue;
    }
    any = any || camera.lens.params != before.params || camera.lens.model != before.model;
  }
  if (any) out.push_back(std::move(hypothesis));
}

size_t CentreAt(const LensCamera& lens) { return static_cast<size_t>(FocalCount(lens.model)); }
size_t DistortionAt(const LensCamera& lens) { return CentreAt(lens) + 2; }

void AddSizes(std::span<const GivenCamera> cameras, std::vector<CameraHypothesis>& out) {
  const LensCamera& first = cameras.front().lens;
  std::vector<double> factors{0.5, 2, 0.25, 4, 2.0 / 3, 1.5};
  const double by_centre = first.width_px / (2 * first.params[CentreAt(first)]);
  constexpr double kDifferent = 0.02;
  if (std::isfinite(by_centre) && by_centre > 0 && std::abs(by_centre - 1) > kDifferent) {
    factors.insert(factors.begin(), by_centre);
  }
  for (const double factor : factors) {
    AddLens(
        cameras, fmt::format("intrinsics of an image of {:.3g} times the width", 1 / factor),
        fmt::format("multiply focal lengths and principal point by {:.4g}, or give photos of "
                    "that size",
                    factor),
        false,
        [&](LensCamera& lens) {
          for (size_t i = 0; i < DistortionAt(lens); ++i) lens.params[i] *= factor;
          return true;
        },
        out);
  }
  AddLens(
      cameras, "cx and cy swapped", "swap them (a photo was turned?)", false,
      [](LensCamera& lens) {
        const size_t at = CentreAt(lens);
        std::swap(lens.params[at], lens.params[at + 1]);
        if (at == 2) std::swap(lens.params[0], lens.params[1]);
        return true;
      },
      out);
}

void AddCentres(std::span<const GivenCamera> cameras, std::vector<CameraHypothesis>& out) {
  for (const double shift_px : {0.5, -0.5}) {
    AddLens(
        cameras,
        fmt::format("a principal point half a pixel {}", shift_px > 0 ? "larger" : "smaller"),
        shift_px > 0 ? "add 0.5 to cx and cy: the file counts from the centre of the first "
                       "pixel, its corner is expected"
                     : "subtract 0.5 from cx and cy: 0.5 was added to a file that counts from "
                       "the corner of the first pixel",
        true,
        [&](LensCamera& lens) {
          const size_t at = CentreAt(lens);
          lens.params[at] += shift_px;
          lens.params[at + 1] += shift_px;
          return true;
        },
        out);
  }
}

std::optional<CameraModel> FisheyeOf(CameraModel model) {
  switch (model) {
    case CameraModel::kOpenCv:
      return CameraModel::kOpenCvFisheye;
    case CameraModel::kSimpleRadial:
      return CameraModel::kSimpleRadialFisheye;
    case CameraModel::kRadial:
      return CameraModel::kRadialFisheye;
    default:
      return {};
  }
}

std::optional<CameraModel> PerspectiveOf(CameraModel model) {
  switch (model) {
    case CameraModel::kOpenCvFisheye:
      return CameraModel::kOpenCv;
    case CameraModel::kSimpleRadialFisheye:
      return CameraModel::kSimpleRadial;
    case CameraModel::kRadialFisheye:
      return CameraModel::kRadial;
    default:
      return {};
  }
}

void AddDistortions(std::span<const GivenCamera> cameras, std::vector<CameraHypothesis>& out) {
  AddLens(
      cameras, "no distortion",
      "the photos are undistorted already: set the distortion of the cameras to zero", true,
      [](LensCamera& lens) {
        if (lens.IsUndistorted()) return false;
        const PinholeCamera pinhole = lens.Pinhole();
        lens.model = CameraModel::kPinhole;
        lens.params = {pinhole.fx_px(), pinhole.fy_px(), pinhole.cx_px(), pinhole.cy_px()};
        return true;
      },
      out);
  AddLens(
      cameras, "p1 and p2 swapped",
      "swap them: the order is k1, k2, p1, p2, as OpenCV's and COLMAP's", true,
      [](LensCamera& lens) {
        constexpr size_t kP1 = 6;
        if (lens.model != CameraModel::kOpenCv && lens.model != CameraModel::kFullOpenCv &&
            lens.model != CameraModel::kThinPrismFisheye) {
          return false;
        }
        std::swap(lens.params[kP1], lens.params[kP1 + 1]);
        return true;
      },
      out);
  AddLens(
      cameras, "the other sign of all distortion",
      "negate the coefficients: the file has those of the inverse mapping", true,
      [](LensCamera& lens) {
        if (lens.IsUndistorted()) return false;
        for (size_t i = DistortionAt(lens); i < lens.params.size(); ++i) {
          lens.params[i] = -lens.params[i];
        }
        return true;
      },
      out);
  for (const auto& [other, name] :
       {std::pair{&FisheyeOf, "fisheye"}, std::pair{&PerspectiveOf, "perspective"}}) {
    AddLens(
        cameras, fmt::format("the {} model of the same coefficients", name),
        fmt::format("name the {} camera model in the file", name), true,
        [&, of = other](LensCamera& lens) {
          const auto model = of(lens.model);
          if (!model) return false;
          lens.model = *model;
          return true;
        },
        out);
  }
}

}  // namespace

std::vector<CameraHypothesis> HypothesesFor(std::span<const GivenCamera> cameras) {
  std::vector<CameraHypothesis> out;
  AddPoses(cameras, out);
  AddOrders(cameras, out);
  AddSizes(cameras, out);
  AddCentres(cameras, out);
  AddDistortions(cameras, out);
  return out;
}

std::vector<GivenCamera> WithRadial(std::span<const GivenCamera> cameras, double k1) {
  Cameras changed(cameras.begin(), cameras.end());
  for (GivenCamera& camera : changed) {
    const PinholeCamera pinhole = camera.lens.Pinhole();
    camera.lens.model = CameraModel::kOpenCv;
    camera.lens.params = {
        pinhole.fx_px(), pinhole.fy_px(), pinhole.cx_px(), pinhole.cy_px(), k1, 0, 0, 0};
  }
  return changed;
}

}  // namespace dtr::calib
