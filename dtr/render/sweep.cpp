#include "dtr/render/sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "dtr/base/parallel_for.h"
#include "dtr/render/geometry.h"

namespace dtr {
namespace {

// SPEC 7.3. Costs are in levels of sRGB.
constexpr int kCellPx = 8, kMaxCells = 1 << 15;
constexpr int kMinDepths = 8, kMaxDepths = 256;
constexpr double kBeyondFarthest = 0.1, kBeforeNearest = 4;  // of the seen range of 1/z
constexpr double kStrayShare = 0.005;                        // seen depths left out at either end
constexpr float kMostCost = 40, kOneViewCost = 20;
constexpr float kGuessBonus = 18;
constexpr float kNextDepth = 4, kOtherDepth = 24;
constexpr size_t kViewsCompared = 4;
constexpr double kAngleFloor = 0.02;  // radians: nearer views are all alike
constexpr int kAnchorSteps = 4;       // a seen cell costs the most from here on
constexpr double kSameSurface = 0.1;  // of 1/z, between cells that are interpolated

/// What one view shows at a cell.
struct Answer {
  double angle;
  std::array<float, 3> rgb;
};

class Sweep {
 public:
  Sweep(const Grid<float>& seen, const Grid<float>& guessed, const GuessedColours& guesses,
        int threads)
      : seen_(seen), guessed_(guessed), guesses_(guesses), threads_(threads) {
    while (Cells(seen.width()) * Cells(seen.height()) > kMaxCells) ++cell_px_;
    columns_ = Cells(seen.width());
    rows_ = Cells(seen.height());
  }

  SweptDepth Run() {
    SweptDepth swept;
    if (!ChooseDepths()) return swept;
    SummariseCells();
    pictures_.resize(guesses_.views().size());
    ParallelFor(0, static_cast<int>(pictures_.size()), threads_, [&](int i) {
      const auto k = static_cast<size_t>(i);
      pictures_[k] = Shrunk(*guesses_.views()[k].view);
    });
    const size_t size = static_cast<size_t>(columns_) * static_cast<size_t>(rows_) * Labels();
    costs_.assign(size, 0);
    sums_.assign(size, 0);
    ParallelFor(0, rows_, threads_, [&](int y) {
      for (int x = 0; x < columns_; ++x) Cost(x, y);
    });
    ParallelFor(0, rows_, threads_, [&](int y) {
      Follow(0, y, 1, 0);
      Follow(columns_ - 1, y, -1, 0);
    });
    ParallelFor(0, columns_, threads_, [&](int x) {
      Follow(x, 0, 0, 1);
      Follow(x, rows_ - 1, 0, -1);
    });
    swept.cell_px = cell_px_;
    swept.step = step_;
    swept.inverse_depth = Grid<double>(columns_, rows_);
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x) swept.inverse_depth(x, y) = Best(x, y);
    }
    return swept;
  }

 private:
  int Cells(int pixels) const { return (pixels + cell_px_ - 1) / cell_px_; }
  size_t Labels() const { return static_cast<size_t>(depths_) + 1; }  // the last: the guess
  double InverseDepth(int label) const { return farthest_ + label * step_; }
  size_t At(int x, int y) const {
    return (static_cast<size_t>(y) * static_cast<size_t>(columns_) + static_cast<size_t>(x)) *
           Labels();
  }

  /// From what was seen and how far the views stand apart. False where there is nothing to sweep.
  bool ChooseDepths() {
    if (guesses_.views().size() < 2) return false;
    std::vector<float> inverse;
    for (const float z : seen_.data()) {
      if (z > 0) inverse.push_back(1 / z);
    }
    if (inverse.empty()) return false;
    const auto ranked = [&](double share) {
      const auto rank =
          static_cast<std::ptrdiff_t>(share * static_cast<double>(inverse.size() - 1));
      std::nth_element(inverse.begin(), inverse.begin() + rank, inverse.end());
      return static_cast<double>(inverse[static_cast<size_t>(rank)]);
    };
    farthest_ = kBeyondFarthest * ranked(kStrayShare);
    const double nearest = kBeforeNearest * ranked(1 - kStrayShare);
    std::vector<double> baselines;
    for (const auto& view : guesses_.views()) baselines.push_back(view.center_in_novel.norm());
    std::sort(baselines.begin(), baselines.end());
    const double disparity_px = guesses_.novel().fx_px() * baselines[1] * (nearest - farthest_);
    depths_ = static_cast<int>(std::clamp<double>(disparity_px / cell_px_, kMinDepths, kMaxDepths));
    step_ = (nearest - farthest_) / (depths_ - 1);
    return step_ > 0 && std::isfinite(step_);
  }

  /// Mean 1/z of the seen pixels of each cell; 0: none was seen.
  void SummariseCells() {
    known_ = Grid<double>(columns_, rows_);
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x) {
        double sum = 0;
        int count = 0;
        ForEachPixel(seen_, x, y, [&](int i, int j) {
          if (!(seen_(i, j) > 0)) return;
          sum += 1 / static_cast<double>(seen_(i, j));
          ++count;
        });
        known_(x, y) = count > 0 ? sum / count : 0;
      }
    }
  }

  template <typename Image, typename Body>
  void ForEachPixel(const Image& image, int x, int y, const Body& body) const {
    for (int j = y * cell_px_; j < std::min((y + 1) * cell_px_, image.height()); ++j) {
      for (int i = x * cell_px_; i < std::min((x + 1) * cell_px_, image.width()); ++i) body(i, j);
    }
  }

  /// The photo averaged over cells: R, G, B in sRGB levels and 1, or all 0 where it is masked.
  Grid<float> Shrunk(const View& view) const {
    Grid<float> small(Cells(view.image.width()), Cells(view.image.height()), 4);
    for (int y = 0; y < small.height(); ++y) {
      for (int x = 0; x < small.width(); ++x) {
        float sum[3] = {};
        int count = 0;
        ForEachPixel(view.image, x, y, [&](int i, int j) {
          if (!view.mask.empty() && view.mask(i, j) == 0) return;
          for (int c = 0; c < 3; ++c) sum[c] += static_cast<float>(view.image(i, j, c));
          ++count;
        });
        if (count == 0) continue;
        for (int c = 0; c < 3; ++c) small(x, y, c) = sum[c] / static_cast<float>(count);
        small(x, y, 3) = 1;
      }
    }
    return small;
  }

  void Cost(int x, int y) {
    float* costs = &costs_[At(x, y)];
    if (known_(x, y) > 0) {
      for (int label = 0; label < depths_; ++label) {
        const double steps = std::abs(InverseDepth(label) - known_(x, y)) / step_;
        costs[label] = kMostCost * static_cast<float>(std::min(1.0, steps / kAnchorSteps));
      }
      return;  // the guess goes on from what was seen: it costs nothing there
    }
    const double px = std::min((x + 0.5) * cell_px_, static_cast<double>(seen_.width()));
    const double py = std::min((y + 0.5) * cell_px_, static_cast<double>(seen_.height()));
    for (int label = 0; label < depths_; ++label) {
      costs[label] = CostAt(px, py, InverseDepth(label)) + kGuessBonus;
    }
    const float guess = guessed_(std::min(static_cast<int>(px), seen_.width() - 1),
                                 std::min(static_cast<int>(py), seen_.height() - 1));
    costs[depths_] = guess > 0 ? CostAt(px, py, 1 / static_cast<double>(guess)) : 2 * kMostCost;
  }

  /// How little the views agree that the surface at pixel position (px, py) has this inverse depth.
  float CostAt(double px, double py, double inverse_depth) const {
    const Eigen::Vector3d ray = guesses_.novel().RayFromPixel({px, py});
    std::vector<Answer> answers;
    answers.reserve(guesses_.views().size());
    double asked = 0, through = 0;
    for (size_t i = 0; i < guesses_.views().size(); ++i) {
      const auto& view = guesses_.views()[i];
      const Eigen::Vector3d p = view.pixel_from_novel_pixel * Eigen::Vector3d(px, py, 1) +
                                inverse_depth * view.pixel_per_inverse_depth;
      if (!(p.z() > 0)) continue;
      const Eigen::Vector2d pixel = p.head<2>() / p.z();
      if (!view.view->camera.Contains(pixel)) continue;
      const Eigen::Vector3d c = inverse_depth * view.center_in_novel;
      const double angle = QuickAngle(c.cross(ray).norm(), ray.squaredNorm() - c.dot(ray));
      asked += 1 / (angle + kAngleFloor);
      const float z = view.view->depth(static_cast<int>(pixel.x()) / view.view->depth_scale,
                                       static_cast<int>(pixel.y()) / view.view->depth_scale);
      if (!DepthImage::IsHole(z)) {
        const double nearer = 1 / static_cast<double>(z) - inverse_depth / p.z();
        if (nearer < -2 * view.delta_inverse_depth) through += 1 / (angle + kAngleFloor);
        if (std::abs(nearer) > 2 * view.delta_inverse_depth) continue;
      }
      Answer answer{angle, {}};
      if (ColourOf(pictures_[i], pixel, answer.rgb)) answers.push_back(answer);
    }
    const auto seen_through = asked > 0 ? kMostCost * static_cast<float>(through / asked) : 0.0F;
    return Disagreement(answers) + seen_through;
  }

  /// Bilinear between the cells around. False where one of them is masked.
  bool ColourOf(const Grid<float>& picture, const Eigen::Vector2d& pixel,
                std::array<float, 3>& rgb) const {
    const double u = std::clamp(pixel.x() / cell_px_ - 0.5, 0.0, picture.width() - 1.0);
    const double v = std::clamp(pixel.y() / cell_px_ - 0.5, 0.0, picture.height() - 1.0);
    const int x0 = static_cast<int>(u), y0 = static_cast<int>(v);
    const int x1 = std::min(x0 + 1, picture.width() - 1),
              y1 = std::min(y0 + 1, picture.height() - 1);
    const auto fx = static_cast<float>(u - x0), fy = static_cast<float>(v - y0);
    if (picture(x0, y0, 3) == 0 || picture(x1, y0, 3) == 0 || picture(x0, y1, 3) == 0 ||
        picture(x1, y1, 3) == 0) {
      return false;
    }
    for (int c = 0; c < 3; ++c) {
      rgb[static_cast<size_t>(c)] =
          (1 - fy) * ((1 - fx) * picture(x0, y0, c) + fx * picture(x1, y0, c)) +
          fy * ((1 - fx) * picture(x0, y1, c) + fx * picture(x1, y1, c));
    }
    return true;
  }

  /// Twice the weighted mean distance of the nearest views' colours from their weighted mean.
  static float Disagreement(std::vector<Answer>& answers) {
    if (answers.empty()) return kMostCost;
    if (answers.size() == 1) return kOneViewCost;
    std::stable_sort(answers.begin(), answers.end(),
                     [](const Answer& a, const Answer& b) { return a.angle < b.angle; });
    answers.resize(std::min(answers.size(), kViewsCompared));
    std::array<double, 3> mean{};
    double weights = 0;
    for (const Answer& answer : answers) {
      const double weight = 1 / (answer.angle + kAngleFloor);
      weights += weight;
      for (size_t c = 0; c < 3; ++c) mean[c] += weight * static_cast<double>(answer.rgb[c]);
    }
    double distance = 0;
    for (const Answer& answer : answers) {
      for (size_t c = 0; c < 3; ++c) {
        distance += std::abs(static_cast<double>(answer.rgb[c]) - mean[c] / weights) /
                    (answer.angle + kAngleFloor) / 3;
      }
    }
    return std::min(kMostCost, static_cast<float>(2 * distance / weights));
  }

  /// One path of semi-global matching (Hirschmueller 2008, eq. 13) from a border cell.
  void Follow(int x, int y, int dx, int dy) {
    const size_t labels = Labels(), guess = labels - 1;
    std::vector<float> before(labels, 0), now(labels);
    for (; x >= 0 && y >= 0 && x < columns_ && y < rows_; x += dx, y += dy) {
      const float least = *std::min_element(before.begin(), before.end());
      for (size_t k = 0; k < labels; ++k) {
        float best = std::min(before[k], least + kOtherDepth);
        if (k > 0 && k != guess) best = std::min(best, before[k - 1] + kNextDepth);
        if (k + 1 < guess) best = std::min(best, before[k + 1] + kNextDepth);
        now[k] = costs_[At(x, y) + k] + best - least;
        sums_[At(x, y) + k] += now[k];
      }
      std::swap(before, now);
    }
  }

  /// The cheapest inverse depth, between the steps by a parabola; 0 where the guess is.
  double Best(int x, int y) const {
    if (known_(x, y) > 0) return 0;
    const float* sums = &sums_[At(x, y)];
    const int label = static_cast<int>(std::min_element(sums, sums + Labels()) - sums);
    if (label == depths_) return 0;
    double offset = 0;
    if (label > 0 && label + 1 < depths_) {
      const double before = static_cast<double>(sums[label - 1] - sums[label]);
      const double after = static_cast<double>(sums[label + 1] - sums[label]);
      if (before + after > 0) offset = 0.5 * (before - after) / (before + after);
    }
    return InverseDepth(label) + offset * step_;
  }

  const Grid<float>&seen_, &guessed_;
  const GuessedColours& guesses_;
  const int threads_;
  int cell_px_ = kCellPx, columns_ = 0, rows_ = 0, depths_ = 0;
  double farthest_ = 0, step_ = 0;
  Grid<double> known_;
  std::vector<Grid<float>> pictures_;
  std::vector<float> costs_, sums_;  ///< per cell and label
};

}  // namespace

double SweptDepth::At(int x, int y) const {
  if (inverse_depth.empty()) return 0;
  const double own = inverse_depth(x / cell_px, y / cell_px);
  if (!(own > 0)) return 0;
  const double u = std::clamp((x + 0.5) / cell_px - 0.5, 0.0, inverse_depth.width() - 1.0);
  const double v = std::clamp((y + 0.5) / cell_px - 0.5, 0.0, inverse_depth.height() - 1.0);
  const int x0 = static_cast<int>(u), y0 = static_cast<int>(v);
  const int x1 = std::min(x0 + 1, inverse_depth.width() - 1);
  const int y1 = std::min(y0 + 1, inverse_depth.height() - 1);
  const double a = inverse_depth(x0, y0), b = inverse_depth(x1, y0);
  const double c = inverse_depth(x0, y1), d = inverse_depth(x1, y1);
  const auto [least, most] = std::minmax({a, b, c, d});
  if (!(least > 0) || most - least > std::max(3 * step, kSameSurface * most)) return own;
  const double fx = u - x0, fy = v - y0;
  return (1 - fy) * ((1 - fx) * a + fx * b) + fy * ((1 - fx) * c + fx * d);
}

SweptDepth SweepLargeHoles(const Grid<float>& seen, const Grid<float>& guessed,
                           const GuessedColours& guesses, int threads) {
  return Sweep(seen, guessed, guesses, threads).Run();
}

}  // namespace dtr
