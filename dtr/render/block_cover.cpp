#include "dtr/render/block_cover.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dtr/base/parallel_for.h"

namespace dtr {
namespace {

constexpr int kRootSide = BlockCover::kRootSide;
// Smaller aligned squares would leave more pieces than they save corners.
constexpr int kSmallestSquare = 8;
// Beside depth breaks smaller pieces are left to the cells of their samples.
constexpr int kMinBlocks = 3;
constexpr BlockTriangles kBothTriangles{{kA | kB | kD, kA | kD | kC}};

/// Covers one root square.
class RootMaker {
 public:
  RootMaker(const Grid<double>& w, const BreakRule& rule, double tolerance, int x, int y,
            BlockCover& cover)
      : w_(w), rule_(rule), tolerance_(tolerance), x_(x), y_(y), cover_(cover) {}

  void Make() {
    FindTriangles();
    CoverSquares();
    CoverRest();
  }

 private:
  enum Block : std::uint8_t { kBroken, kWhole, kDone };

  /// Also of the blocks around the root square; beyond the map nothing is missing.
  void FindTriangles() {
    width_ = std::clamp(w_.width() - 1 - x_, 0, kRootSide);
    height_ = std::clamp(w_.height() - 1 - y_, 0, kRootSide);
    for (int j = -1; j <= height_; ++j) {
      for (int i = -1; i <= width_; ++i) {
        const int x = x_ + i, y = y_ + j;
        const bool inside = x >= 0 && y >= 0 && x + 1 < w_.width() && y + 1 < w_.height();
        const BlockTriangles block = inside ? TrianglesOfBlock(w_, x, y, rule_) : kBothTriangles;
        At(i, j) = block.corners[0] != 0 && block.corners[1] != 0 ? kWhole : kBroken;
      }
    }
  }

  std::uint8_t& At(int i, int j) { return block_[j + 1][i + 1]; }
  std::uint8_t At(int i, int j) const { return block_[j + 1][i + 1]; }

  bool IsBesideBreak(int i, int j) const {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (At(i + dx, j + dy) == kBroken) return true;
      }
    }
    return false;
  }

  /// Aligned squares, each of four that were flat themselves.
  void CoverSquares() {
    std::uint8_t side_at[kRootSide][kRootSide] = {};  // of the largest flat square that begins here
    for (int j = 0; j < height_; ++j) {
      for (int i = 0; i < width_; ++i) side_at[j][i] = At(i, j) == kWhole;
    }
    for (int side = 2; side <= kRootSide; side *= 2) {
      const int h = side / 2;
      for (int j = 0; j + side <= height_; j += side) {
        for (int i = 0; i + side <= width_; i += side) {
          if (side_at[j][i] == h && side_at[j][i + h] == h && side_at[j + h][i] == h &&
              side_at[j + h][i + h] == h && IsFlat(i, j, side, side)) {
            side_at[j][i] = static_cast<std::uint8_t>(side);
          }
        }
      }
    }
    for (int side = kRootSide; side >= kSmallestSquare; side /= 2) {
      for (int j = 0; j + side <= height_; j += side) {
        for (int i = 0; i + side <= width_; i += side) {
          if (side_at[j][i] == side && At(i, j) == kWhole) Take(i, j, side, side);
        }
      }
    }
  }

  void CoverRest() {
    for (int j = 0; j < height_; ++j) {
      for (int i = 0; i < width_; ++i) {
        if (At(i, j) == kWhole) TakeLargest(i, j);
      }
    }
  }

  /// The larger of what grows to the right first and what grows downwards first.
  void TakeLargest(int i, int j) {
    int best_width = 1, best_height = 1;
    for (const bool right_first : {true, false}) {
      int width = 1, height = 1;
      for (int pass = 0; pass < 2; ++pass) {
        const bool right = right_first == (pass == 0);
        while (CanGrow(i, j, width + right, height + !right)) ++(right ? width : height);
      }
      if (width * height > best_width * best_height) best_width = width, best_height = height;
    }
    // Cells do for the crumbs beside breaks, and cost less than their triangles.
    if (best_width * best_height < kMinBlocks && IsBesideBreak(i, j)) return;
    Take(i, j, best_width, best_height);
  }

  bool CanGrow(int i, int j, int width, int height) const {
    if (i + width > width_ || j + height > height_) return false;
    for (int y = j; y < j + height; ++y) {
      for (int x = i; x < i + width; ++x) {
        if (At(x, y) != kWhole) return false;
      }
    }
    return IsFlat(i, j, width, height);
  }

  void Take(int i, int j, int width, int height) {
    for (int y = j; y < j + height; ++y) {
      for (int x = i; x < i + width; ++x) At(x, y) = kDone;
    }
    cover_.rectangles.push_back({x_ + i, y_ + j, width, height});
  }

  bool IsFlat(int i0, int j0, int width, int height) const {
    const int x = x_ + i0, y = y_ + j0;
    const double a = w_(x, y), b = w_(x + width, y);
    const double c = w_(x, y + height), d = w_(x + width, y + height);
    const bool along_bc = SplitsAlongBC(a, b, c, d);
    // Slopes along x of the upper and the lower triangle, and along y of the left and the right.
    const double upper = (b - a) / width, lower = (d - c) / width;
    const double left = (c - a) / height, right = (d - b) / height;
    for (int j = 0; j <= height; ++j) {
      const double* row = w_.row(y + j) + x;
      for (int i = 0; i <= width; ++i) {
        double on_plane;
        if (along_bc) {
          on_plane = i * height + j * width <= width * height
                         ? a + i * upper + j * left
                         : d - (width - i) * lower - (height - j) * right;
        } else {
          on_plane = i * height >= j * width ? a + i * upper + j * right : a + i * lower + j * left;
        }
        if (!(std::abs(row[i] - on_plane) <= tolerance_)) return false;
      }
    }
    return true;
  }

  const Grid<double>& w_;
  const BreakRule& rule_;
  const double tolerance_;
  const int x_, y_;
  BlockCover& cover_;
  int width_ = 0, height_ = 0;
  std::uint8_t block_[kRootSide + 2][kRootSide + 2] = {};
};

}  // namespace

bool SplitsAlongBC(double a, double b, double c, double d) {
  return std::abs(b - c) < std::abs(a - d);
}

BlockCover CoverBlocks(const Grid<double>& inverse_depth, const BreakRule& rule, double tolerance) {
  BlockCover cover;
  cover.columns = inverse_depth.width();
  cover.rows = inverse_depth.height();
  std::vector<BlockCover> parts(static_cast<size_t>((cover.rows + kRootSide - 1) / kRootSide));
  ParallelFor(0, static_cast<int>(parts.size()), [&](int r) {
    for (int x = 0; x < cover.columns; x += kRootSide) {
      RootMaker(inverse_depth, rule, tolerance, x, r * kRootSide, parts[static_cast<size_t>(r)])
          .Make();
    }
  });
  for (const BlockCover& part : parts) {
    cover.rectangles.insert(cover.rectangles.end(), part.rectangles.begin(), part.rectangles.end());
  }
  return cover;
}

}  // namespace dtr
