#include "dtr/render/fill_holes.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "dtr/base/parallel_for.h"
#include "dtr/render/blend_weights.h"
#include "dtr/render/colour.h"
#include "dtr/render/geometry.h"
#include "dtr/render/texture.h"

namespace dtr {
namespace {

// Depths that are tried for a hole, between its farthest and its nearest guess (SPEC 7.2).
constexpr int kTriedDepths = 8;

/// Which of the cells around a hole have the most say.
enum class Favour { kFar, kNone };

/// The fourth power: a cell twice as near as the farthest keeps a sixteenth of its say, at any
/// scale; a hard limit would draw the blocks of the pyramid into slanted ground.
double Say(double inverse_depth, double farthest, Favour favour) {
  if (favour == Favour::kNone) return 1;
  const double ratio = farthest / inverse_depth;
  return ratio * ratio * ratio * ratio;
}

/// A cell of the pyramid: colour (linear), inverse depth and how much of it is known.
struct Cell {
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();
  double inverse_depth = 0;
  double weight = 0;
};
using Level = Grid<Cell>;

/// Weighted mean of some cells, most of the favoured ones; weight 0 when none is known. `taps` are
/// the interpolation weights.
template <size_t N>
Cell FavouredMean(const std::array<const Cell*, N>& cells, const std::array<double, N>& taps,
                  Favour favour) {
  double farthest = 0;
  bool any = false;
  for (size_t i = 0; i < N; ++i) {
    if (cells[i] == nullptr || !(cells[i]->weight > 0) || !(taps[i] > 0)) continue;
    farthest = any ? std::min(farthest, cells[i]->inverse_depth) : cells[i]->inverse_depth;
    any = true;
  }
  Cell mean;
  if (!any) return mean;
  for (size_t i = 0; i < N; ++i) {
    if (cells[i] == nullptr || !(cells[i]->weight > 0)) continue;
    const double weight =
        cells[i]->weight * taps[i] * Say(cells[i]->inverse_depth, farthest, favour);
    mean.colour += weight * cells[i]->colour;
    mean.inverse_depth += weight * cells[i]->inverse_depth;
    mean.weight += weight;
  }
  if (!(mean.weight > 0)) return Cell{};
  mean.colour /= mean.weight;
  mean.inverse_depth /= mean.weight;
  return mean;
}

const Cell* CellAt(const Level& level, int x, int y) {
  return level.Contains(x, y) ? &level(x, y) : nullptr;
}

Level FinestLevel(const RenderResult& result) {
  Level level(result.image.width(), result.image.height());
  const std::array<double, 256>& linear = LinearFromSrgb8();
  for (int y = 0; y < level.height(); ++y) {
    for (int x = 0; x < level.width(); ++x) {
      if (result.coverage(x, y) == 0 || DepthImage::IsHole(result.depth(x, y))) continue;
      const std::uint8_t* rgb = &result.image(x, y);
      level(x, y) = {{linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]},
                     1.0 / static_cast<double>(result.depth(x, y)),
                     1.0};
    }
  }
  return level;
}

/// Pull: each coarse cell is the favoured mean of its four children.
Level Coarser(const Level& fine, Favour favour) {
  Level coarse((fine.width() + 1) / 2, (fine.height() + 1) / 2);
  for (int y = 0; y < coarse.height(); ++y) {
    for (int x = 0; x < coarse.width(); ++x) {
      const std::array<const Cell*, 4> children = {
          CellAt(fine, 2 * x, 2 * y), CellAt(fine, 2 * x + 1, 2 * y),
          CellAt(fine, 2 * x, 2 * y + 1), CellAt(fine, 2 * x + 1, 2 * y + 1)};
      Cell cell = FavouredMean<4>(children, {1, 1, 1, 1}, favour);
      cell.weight = std::min(cell.weight, 1.0);
      coarse(x, y) = cell;
    }
  }
  return coarse;
}

/// Push: unknown fine cells take the bilinear favoured mean of the four coarse cells around them.
void FillFrom(const Level& coarse, Favour favour, Level& fine) {
  for (int y = 0; y < fine.height(); ++y) {
    for (int x = 0; x < fine.width(); ++x) {
      if (fine(x, y).weight > 0) continue;
      const double cx = 0.5 * (x + 0.5) - 0.5, cy = 0.5 * (y + 0.5) - 0.5;
      const int x0 = static_cast<int>(std::floor(cx)), y0 = static_cast<int>(std::floor(cy));
      const double fx = cx - x0, fy = cy - y0;
      Cell cell =
          FavouredMean<4>({CellAt(coarse, x0, y0), CellAt(coarse, x0 + 1, y0),
                           CellAt(coarse, x0, y0 + 1), CellAt(coarse, x0 + 1, y0 + 1)},
                          {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy}, favour);
      if (cell.weight > 0) cell.weight = 1;
      fine(x, y) = cell;
    }
  }
}

/// Fills every unknown cell of the finest level from the known ones.
void PushPull(Favour favour, Level& finest) {
  std::vector<Level> pyramid = {std::move(finest)};
  while (pyramid.back().width() > 1 || pyramid.back().height() > 1) {
    pyramid.push_back(Coarser(pyramid.back(), favour));
  }
  for (size_t level = pyramid.size() - 1; level > 0; --level) {
    FillFrom(pyramid[level], favour, pyramid[level - 1]);
  }
  finest = std::move(pyramid.front());
}

void WriteHoles(const Level& level, RenderResult& result) {
  for (int y = 0; y < result.image.height(); ++y) {
    for (int x = 0; x < result.image.width(); ++x) {
      if (result.coverage(x, y) != 0) continue;
      for (int channel = 0; channel < 3; ++channel) {
        result.image(x, y, channel) = Srgb8FromLinear(level(x, y).colour[channel]);
      }
    }
  }
}

bool HasHoles(const RenderResult& result) {
  const auto& covered = result.coverage.data();
  return std::find(covered.begin(), covered.end(), 0) != covered.end();
}

/// True where the view measured something behind the guessed point: it sees through it.
bool SeesThrough(const View& view, double delta_inverse_depth, const Eigen::Vector3d& p_in_cam) {
  const auto pixel = view.camera.PixelFromCam(p_in_cam);
  if (!pixel || !view.camera.Contains(*pixel)) return false;
  const float depth = view.depth(static_cast<int>(pixel->x()) / view.depth_scale,
                                 static_cast<int>(pixel->y()) / view.depth_scale);
  return !DepthImage::IsHole(depth) &&
         1.0 / static_cast<double>(depth) < 1 / p_in_cam.z() - delta_inverse_depth;
}

/// What a view shows of a guessed point; empty where it looks at something nearer, or off its
/// image.
std::optional<Eigen::Vector3d> GuessFrom(const View& view, double delta_inverse_depth,
                                         const Eigen::Vector3d& p_in_cam) {
  const auto pixel = view.camera.PixelFromCam(p_in_cam);
  if (!pixel || !view.camera.Contains(*pixel)) return std::nullopt;
  const float depth = view.depth(static_cast<int>(pixel->x()) / view.depth_scale,
                                 static_cast<int>(pixel->y()) / view.depth_scale);
  if (!DepthImage::IsHole(depth) &&
      1.0 / static_cast<double>(depth) > 1 / p_in_cam.z() + delta_inverse_depth) {
    return std::nullopt;
  }
  return ColourAt(view, *pixel);
}

/// SPEC 7.2 for one picture: the views to ask and where they stand.
class GuessedColours {
 public:
  GuessedColours(const RenderScene& scene, const std::vector<int>& views_used,
                 const PinholeCamera& novel, const Pose& novel_from_world,
                 const RenderOptions& options)
      : novel_(novel), blend_(BlendParametersOf(options, novel.fx_px())) {
    const size_t count = std::min(views_used.size(), static_cast<size_t>(options.views));
    std::vector<int> order(views_used.begin(),
                           views_used.begin() + static_cast<std::ptrdiff_t>(count));
    std::sort(order.begin(), order.end(), [&](int a, int b) {
      const std::string &id_a = scene.views[static_cast<size_t>(a)]->id,
                        &id_b = scene.views[static_cast<size_t>(b)]->id;
      return id_a != id_b ? id_a < id_b : a < b;
    });
    for (const int index : order) {
      const View& view = *scene.views[static_cast<size_t>(index)];
      const Eigen::Quaterniond view_from_novel =
          (view.cam_from_world.rotation.normalized() *
           novel_from_world.rotation.normalized().conjugate());
      const Eigen::Vector3d center_in_novel =
          novel_from_world.rotation.normalized() *
          (view.CenterInWorld() - novel_from_world.TargetOriginInSource());
      views_.push_back({&view, view_from_novel.toRotationMatrix(), center_in_novel,
                        ThresholdsOf(view, options).delta});
    }
  }

  /// False where a view saw something behind the point.
  bool Possible(int x, int y, double inverse_depth) const {
    const Eigen::Vector3d point = novel_.RayFromPixel({x + 0.5, y + 0.5}) / inverse_depth;
    return std::none_of(views_.begin(), views_.end(), [&](const Placed& placed) {
      return SeesThrough(*placed.view, placed.delta_inverse_depth,
                         placed.view_from_novel * (point - placed.center_in_novel));
    });
  }

  std::optional<Eigen::Vector3d> At(int x, int y, double inverse_depth) const {
    const Eigen::Vector3d point = novel_.RayFromPixel({x + 0.5, y + 0.5}) / inverse_depth;
    std::vector<double> angles;
    std::vector<Eigen::Vector3d> colours;
    for (const Placed& placed : views_) {
      const auto colour = GuessFrom(*placed.view, placed.delta_inverse_depth,
                                    placed.view_from_novel * (point - placed.center_in_novel));
      if (!colour) continue;
      colours.push_back(*colour);
      angles.push_back(AngleBetween(placed.center_in_novel - point, -point));
    }
    if (colours.empty()) return std::nullopt;
    std::vector<double> shares(angles.size());
    BlendShares(blend_, angles, shares);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < colours.size(); ++i) sum += shares[i] * colours[i];
    return sum;
  }

 private:
  struct Placed {
    const View* view;
    Eigen::Matrix3d view_from_novel;
    Eigen::Vector3d center_in_novel;
    double delta_inverse_depth;
  };
  const PinholeCamera novel_;
  const BlendParameters blend_;
  std::vector<Placed> views_;  ///< in the order of the ids
};

/// SPEC 7.2: inverse depth for each hole: the nearest of those tried that no view sees through.
Grid<double> GuessDepth(const Level& known, const GuessedColours& colours, int threads) {
  Level far = known, even = known;
  PushPull(Favour::kFar, far);
  PushPull(Favour::kNone, even);
  Grid<double> guess(known.width(), known.height());
  ParallelFor(0, known.height(), threads, [&](int y) {
    for (int x = 0; x < known.width(); ++x) {
      if (known(x, y).weight > 0 || !(far(x, y).weight > 0)) continue;
      const double farthest = far(x, y).inverse_depth, nearest = even(x, y).inverse_depth;
      guess(x, y) = farthest;
      for (int k = kTriedDepths - 1; k > 0; --k) {
        const double tried = farthest + (nearest - farthest) * k / (kTriedDepths - 1);
        if (!colours.Possible(x, y, tried)) continue;
        guess(x, y) = tried;
        break;
      }
    }
  });
  return guess;
}

}  // namespace

void FillHoles(RenderResult& result) {
  if (!HasHoles(result)) return;
  Level level = FinestLevel(result);
  PushPull(Favour::kFar, level);
  WriteHoles(level, result);
}

void FillHolesFromViews(const RenderScene& scene, const PinholeCamera& novel,
                        const Pose& novel_from_world, const RenderOptions& options,
                        RenderResult& result) {
  if (!HasHoles(result)) return;
  Level known = FinestLevel(result);
  const GuessedColours colours(scene, result.views_used, novel, novel_from_world, options);
  const Grid<double> guess = GuessDepth(known, colours, options.threads);
  ParallelFor(0, known.height(), options.threads, [&](int y) {
    for (int x = 0; x < known.width(); ++x) {
      if (known(x, y).weight > 0 || !(guess(x, y) > 0)) continue;
      const auto colour = colours.At(x, y, guess(x, y));
      if (colour) known(x, y) = {*colour, guess(x, y), 1};
    }
  });
  PushPull(Favour::kFar, known);
  WriteHoles(known, result);
}

}  // namespace dtr
