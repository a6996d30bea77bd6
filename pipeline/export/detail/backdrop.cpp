#include "pipeline/export/detail/backdrop.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "dtr/base/parallel_for.h"

namespace dtr::pipeline {
namespace {

constexpr double kCellPx = 3;  // wide, in pixels of the view with the median focal length
constexpr int kMostCells = 1024;
// Its distance, in multiples of the farthest depth of the median view: viewers lose what is much
// farther.
constexpr double kDistance = 3;
// Views that stand beyond the given ones see somewhat past their borders.
constexpr double kPastBorder = 0.5;
constexpr float kOneColour =
    5;  // levels of 8 bits between cells that are one, where nothing else is asked
// Standard deviation by the distance of neighbours: nothing is seen between them.
constexpr double kSpread = 0.9;
constexpr int kLargestSquare = 16;
// Against the sky's 1, so that surfaces are smeared over squares of 16 cells.
constexpr float kSurfaceWeight = 1.0f / 256;

double Median(std::vector<double> values) {
  if (values.empty()) return 1;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void Backdrop::Sum::Add(const Sum& other, float factor) {
  weight += factor * other.weight;
  for (size_t c = 0; c < 3; ++c) rgb[c] += factor * other.rgb[c];
}

Backdrop::Backdrop(const DtrSet& set) : set_(set) {
  std::vector<double> focal, far_z;
  for (const View& view : set.frames.front().views) {
    if (!view.depth_file) continue;
    centre_ += view.CenterInWorld();
    focal.push_back(view.DepthCamera().fx_px());
    far_z.push_back(view.far_z);
  }
  if (!focal.empty()) centre_ /= static_cast<double>(focal.size());
  radius_ = kDistance * Median(far_z);
  const double cells = 2 * Median(focal) / kCellPx;
  while (side_ < cells && side_ < kMostCells) side_ *= 2;
  const size_t all = 6 * static_cast<size_t>(side_) * static_cast<size_t>(side_);
  sky_.resize(all);
  surface_.resize(all);
}

Eigen::Vector3d Backdrop::DirectionOf(int face, double x, double y) const {
  const int axis = face / 2;
  Eigen::Vector3d d;
  d[axis] = face % 2 == 0 ? 1 : -1;
  d[(axis + 1) % 3] = 2 * x / side_ - 1;
  d[(axis + 2) % 3] = 2 * y / side_ - 1;
  return d;
}

Backdrop::Place Backdrop::PlaceOf(const Eigen::Vector3d& direction) const {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  const Eigen::Vector3d on_cube = direction / std::abs(direction[axis]);
  const auto cell = [&](double v) { return std::clamp((v + 1) * 0.5 * side_, 0.0, side_ - 1e-6); };
  return {2 * axis + (direction[axis] > 0 ? 0 : 1), cell(on_cube[(axis + 1) % 3]),
          cell(on_cube[(axis + 2) % 3])};
}

void Backdrop::AddView(const SurfaceView& surface) {
  AddSky(surface);
  AddSurface(surface);
}

void Backdrop::AddSky(const SurfaceView& surface) {
  ParallelFor(0, 6 * side_, [&](int row) {
    for (int x = 0; x < side_; ++x) {
      const int face = row / side_, y = row % side_;
      const Eigen::Vector3d p =
          centre_ + radius_ * DirectionOf(face, x + 0.5, y + 0.5).normalized();
      const auto pixel = surface.camera.PixelFromCam(surface.InCam(p));
      if (!pixel || !surface.camera.Contains(*pixel)) continue;
      const int u = static_cast<int>(pixel->x()), v = static_cast<int>(pixel->y());
      const float w = surface.inverse_depth(u, v);
      const bool sky = !surface.far.empty() && surface.far(u, v) != 0;
      if (!sky && !(w > 0 && Hides(surface.PointAt({u + 0.5, v + 0.5}, w)))) continue;
      Sum& sum = sky_[At(face, x, y)];
      sum.weight += 1;
      for (int c = 0; c < 3; ++c) sum.rgb[static_cast<size_t>(c)] += surface.colours(u, v, c);
    }
  });
}

void Backdrop::AddSurface(const SurfaceView& surface) {
  constexpr int kStep = 2;
  for (int y = 0; y < surface.colours.height(); y += kStep) {
    for (int x = 0; x < surface.colours.width(); x += kStep) {
      const float w = surface.inverse_depth(x, y);
      if (!(w > 0)) continue;
      const Eigen::Vector3d p = surface.PointAt({x + 0.5, y + 0.5}, w) - centre_;
      if (Hides(p + centre_)) continue;
      const Place place = PlaceOf(p);
      const double share = p.norm() / radius_;
      const auto weight = static_cast<float>(share * share);
      Sum sum{weight, {}};
      for (int c = 0; c < 3; ++c) {
        sum.rgb[static_cast<size_t>(c)] = weight * static_cast<float>(surface.colours(x, y, c));
      }
      surface_[At(place.face, static_cast<int>(place.x), static_cast<int>(place.y))].Add(sum, 1);
    }
  }
}

// Pull and push (Gortler et al. 1996, sec. 3.4.2) on each face; what is on no face at all is grey
// of all.
std::vector<Backdrop::Sum> Backdrop::Filled() const {
  std::vector<std::vector<Sum>> levels(1);
  Sum all;
  for (size_t i = 0; i < sky_.size(); ++i) {
    const bool is_sky = sky_[i].weight > 0;
    Sum sum = is_sky ? sky_[i] : surface_[i];
    if (sum.weight > 0) {
      for (float& v : sum.rgb) v /= sum.weight;
      sum.weight = is_sky ? 1 : kSurfaceWeight;
      Sum weighted{sum.weight, sum.rgb};
      for (float& v : weighted.rgb) v *= sum.weight;
      all.Add(weighted, 1);
    }
    levels[0].push_back(sum);
  }
  for (int side = side_ / 2; side >= 1; side /= 2) {
    const std::vector<Sum>& fine = levels.back();
    std::vector<Sum> coarse(6 * static_cast<size_t>(side) * static_cast<size_t>(side));
    for (size_t i = 0; i < coarse.size(); ++i) {
      const size_t wide = static_cast<size_t>(side), row = i / wide, x = i % wide;
      for (size_t child = 0; child < 4; ++child) {
        const Sum& sum = fine[(2 * row + child / 2) * 2 * wide + 2 * x + child % 2];
        Sum weighted{sum.weight, {}};
        for (size_t c = 0; c < 3; ++c) weighted.rgb[c] = sum.weight * sum.rgb[c];
        coarse[i].Add(weighted, 1);
      }
      if (!(coarse[i].weight > 0)) continue;
      for (float& v : coarse[i].rgb) v /= coarse[i].weight;
      coarse[i].weight = std::min(coarse[i].weight, 1.0f);
    }
    levels.push_back(std::move(coarse));
  }
  for (Sum& sum : levels.back()) {
    if (sum.weight > 0 || !(all.weight > 0)) continue;
    for (size_t c = 0; c < 3; ++c) sum.rgb[c] = all.rgb[c] / all.weight;
    sum.weight = 1;
  }
  int side = 1;
  for (size_t level = levels.size() - 1; level-- > 0;) {
    const std::vector<Sum>& coarse = levels[level + 1];
    side *= 2;
    for (size_t i = 0; i < levels[level].size(); ++i) {
      Sum& sum = levels[level][i];
      if (sum.weight >= 1) continue;
      const size_t wide = static_cast<size_t>(side), row = i / wide, x = i % wide;
      // Bilinear among the coarse cells of this face.
      const size_t face = row / wide, y = row % wide, half = wide / 2;
      const auto beside = [&](size_t at) {
        const size_t own = at / 2,
                     other = at % 2 == 0 ? (own > 0 ? own - 1 : own) : std::min(own + 1, half - 1);
        return std::pair{own, other};
      };
      const auto [x0, x1] = beside(x);
      const auto [y0, y1] = beside(y);
      for (size_t c = 0; c < 3; ++c) {
        const auto value = [&](size_t u, size_t v) {
          return coarse[(face * half + v) * half + u].rgb[c];
        };
        const float smooth = 0.75f * (0.75f * value(x0, y0) + 0.25f * value(x1, y0)) +
                             0.25f * (0.75f * value(x0, y1) + 0.25f * value(x1, y1));
        sum.rgb[c] = sum.weight * sum.rgb[c] + (1 - sum.weight) * smooth;
      }
      sum.weight = 1;
    }
  }
  return levels.front();
}

bool Backdrop::CouldBeSeen(const Eigen::Vector3d& p_in_world) const {
  for (const View& view : set_.frames.front().views) {
    if (!view.depth_file) continue;
    const auto pixel = view.camera.PixelFromCam(view.cam_from_world * p_in_world);
    if (!pixel) continue;
    const double past_x = kPastBorder * view.camera.width_px();
    const double past_y = kPastBorder * view.camera.height_px();
    if (pixel->x() > -past_x && pixel->x() < view.camera.width_px() + past_x &&
        pixel->y() > -past_y && pixel->y() < view.camera.height_px() + past_y) {
      return true;
    }
  }
  return false;
}

std::vector<Gaussian> Backdrop::Gaussians(size_t max_count) const {
  const std::vector<Sum> cells = Filled();
  constexpr float kAnyColour = 255;
  for (float one_colour = kOneColour;; one_colour *= 2) {
    std::vector<Gaussian> gaussians = GaussiansOf(cells, one_colour);
    if (gaussians.size() <= max_count || one_colour >= kAnyColour) return gaussians;
  }
}

std::vector<Gaussian> Backdrop::GaussiansOf(const std::vector<Sum>& cells, float one_colour) const {
  std::vector<Gaussian> gaussians;
  const auto is_one = [&](int face, int x, int y, int side) {
    for (size_t c = 0; c < 3; ++c) {
      float low = 255, high = 0;
      for (int i = 0; i < side * side; ++i) {
        const float v = cells[At(face, x + i % side, y + i / side)].rgb[c];
        low = std::min(low, v);
        high = std::max(high, v);
      }
      if (high - low > one_colour) return false;
    }
    return true;
  };
  const std::function<void(int, int, int, int)> add = [&](int face, int x, int y, int side) {
    const Eigen::Vector3d d = DirectionOf(face, x + 0.5 * side, y + 0.5 * side);
    const Eigen::Vector3d p = centre_ + radius_ * d.normalized();
    if (side > 1 && !is_one(face, x, y, side)) {
      for (int child = 0; child < 4; ++child) {
        add(face, x + side / 2 * (child % 2), y + side / 2 * (child / 2), side / 2);
      }
      return;
    }
    if (!CouldBeSeen(p)) return;
    Gaussian gaussian;
    gaussian.position = p.cast<float>();
    // Cells near the corners of the cube are farther from its centre, and so seen smaller.
    const auto wide = static_cast<float>(kSpread * side * 2 * radius_ / side_ / d.norm());
    gaussian.deviation = {0.05f * wide, wide, wide};
    gaussian.world_from_axes =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), d).cast<float>();
    std::array<float, 3> rgb{};
    for (int i = 0; i < side * side; ++i) {
      const Sum& cell = cells[At(face, x + i % side, y + i / side)];
      for (size_t c = 0; c < 3; ++c) rgb[c] += cell.rgb[c];
    }
    for (size_t c = 0; c < 3; ++c) {
      gaussian.rgb[c] = rgb[c] / static_cast<float>(side * side) / 255;
    }
    gaussian.opacity = 0.99f;
    gaussians.push_back(gaussian);
  };
  const int square = std::min(kLargestSquare, side_);
  for (int face = 0; face < 6; ++face) {
    for (int y = 0; y < side_; y += square) {
      for (int x = 0; x < side_; x += square) add(face, x, y, square);
    }
  }
  return gaussians;
}

}  // namespace dtr::pipeline
