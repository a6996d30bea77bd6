#include "dtr/simd/sampled_views.h"

#include <algorithm>
#include <stdexcept>

#include "dtr/base/parallel_for.h"
#include "dtr/render/stored_depth.h"
#include "dtr/render/texture.h"
#include "dtr/render/triangulation.h"
#include "dtr/simd/pixel_kernel.h"

namespace dtr::simd {
namespace {

/// The grid with its outermost samples once more around it, and kReadBeyond more values.
template <typename T>
HugeVector<T> WithBorder(const std::vector<T>& grid, int columns, int rows) {
  HugeVector<T> bordered;
  if (grid.empty()) return bordered;
  bordered.reserve(static_cast<size_t>(columns + 2) * static_cast<size_t>(rows + 2) + kReadBeyond);
  for (int y = -1; y <= rows; ++y) {
    const T* row =
        &grid[static_cast<size_t>(std::clamp(y, 0, rows - 1)) * static_cast<size_t>(columns)];
    bordered.push_back(row[0]);
    bordered.insert(bordered.end(), row, row + columns);
    bordered.push_back(row[columns - 1]);
  }
  bordered.resize(bordered.size() + kReadBeyond);
  return bordered;
}

/// A bit per sample of the grid with its border.
std::vector<std::uint32_t> WholeBlocks(const SampleGrid& samples, const BreakRule& breaks) {
  const Grid<double>& w = samples.inverse_depth;
  const size_t stride = static_cast<size_t>(w.width()) + 2;
  std::vector<std::uint32_t> bits((stride * (static_cast<size_t>(w.height()) + 2) + 31) / 32);
  for (int y = -1; y < w.height(); ++y) {
    for (int x = -1; x < w.width(); ++x) {
      if (!IsWholeBlock(w, x, y, breaks) && !IsMaskedBlock(samples, x, y)) continue;
      const size_t bit = static_cast<size_t>(y + 1) * stride + static_cast<size_t>(x + 1);
      bits[bit / 32] |= std::uint32_t{1} << (bit % 32);
    }
  }
  return bits;
}

// A look at the cells costs a twentieth of what it may save; most maps have no large holes.
constexpr double kCellsWorthAsking = 0.05;

/// As PixelView has them; empty where too few are empty.
std::vector<std::uint32_t> CellsOf(const SampleGrid& samples, int* stride) {
  const Grid<double>& w = samples.inverse_depth;
  constexpr int kSize = 1 << kLog2PixelCell;
  const int columns = (w.width() + kSize) / kSize, rows = (w.height() + kSize) / kSize;
  *stride = columns;
  std::vector<std::uint32_t> cells(static_cast<size_t>(columns) * static_cast<size_t>(rows));
  double empty = 0;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      // Blocks -1 + kSize x and on, each of two samples per axis.
      const int right = std::min(kSize * (x + 1), w.width());
      const int bottom = std::min(kSize * (y + 1), w.height());
      bool some = false, looked = samples.masked.empty(), masked = false;
      for (int j = std::max(0, kSize * y - 1); j < bottom && !some; ++j) {
        for (int i = std::max(0, kSize * x - 1); i < right && !some; ++i) {
          some = w(i, j) > 0;
          const bool hidden = !samples.masked.empty() && samples.masked(i, j) != 0;
          looked = looked || !hidden;
          masked = masked || hidden;
        }
      }
      // Where a view looks at a part of it alone each block must be asked (SPEC 5.2).
      if (some || (looked && masked)) continue;
      cells[static_cast<size_t>(y) * static_cast<size_t>(columns) + static_cast<size_t>(x)] =
          looked ? kCellOfHoles : kMaskedCell;
      ++empty;
    }
  }
  if (empty < kCellsWorthAsking * static_cast<double>(cells.size())) cells.clear();
  return cells;
}

SampledView Sample(const View& view, int resolution, const BreakRule& breaks) {
  const SampleGrid grid = MakeSampleGrid(view, resolution);
  const Grid<double>& w = grid.inverse_depth;
  SampledView sampled;
  if (w.empty()) return sampled;
  sampled.columns = w.width(), sampled.rows = w.height();
  sampled.step = grid.step, sampled.offset = grid.offset;
  const StoredDepth depth = StoreDepth(view, grid);
  sampled.codes = WithBorder(depth.codes, w.width(), w.height());
  sampled.values = WithBorder(depth.values, w.width(), w.height());
  sampled.depth_offset = depth.offset;
  // StoredDepth reads codes as shares of the largest.
  sampled.depth_factor = depth.codes.empty() ? depth.factor : depth.factor / UINT16_MAX;
  sampled.whole_blocks = WholeBlocks(grid, breaks);
  sampled.cells = CellsOf(grid, &sampled.cell_stride);
  const std::vector<std::uint8_t> image = SampledImage(view);
  sampled.rgba.reserve(image.size() + 4 * (static_cast<size_t>(view.image.width()) + kReadBeyond));
  sampled.rgba.assign(image.begin(), image.end());
  sampled.rgba.resize(sampled.rgba.capacity());
  return sampled;
}

}  // namespace

bool SampledViews::Stored::IsFor(const View& view, const RenderOptions& options) const {
  if (resolution != options.resolution || breaks != BreakRuleOf(view, options)) return false;
  const void *image = view.image.data().data(), *depth = view.depth.grid().data().data();
  return view.image.empty() || image_data == nullptr ||
         (image_data == image && depth_data == depth);
}

bool SampledViews::Has(const View& view, const RenderOptions& options) const {
  const auto found = views_.find(&view);
  return found != views_.end() && found->second.IsFor(view, options);
}

void SampledViews::Prepare(const std::vector<const View*>& views, const RenderOptions& options) {
  std::vector<Stored*> missing;
  std::vector<const View*> missing_views;
  for (const View* view : views) {
    Stored& stored = views_[view];
    const bool there = stored.IsFor(*view, options);
    if (!there && view->image.empty()) {
      throw std::logic_error(view->name +
                             ": neither its pixels are there nor what was made of them");
    }
    // Null where the pixels are gone.
    stored.image_data = view->image.data().data();
    stored.depth_data = view->depth.grid().data().data();
    if (there) continue;
    stored.resolution = options.resolution;
    stored.breaks = BreakRuleOf(*view, options);
    stored.sampled = {};
    missing.push_back(&stored);
    missing_views.push_back(view);
  }
  ParallelFor(0, static_cast<int>(missing.size()), [&](int i) {
    const auto k = static_cast<size_t>(i);
    missing[k]->sampled = Sample(*missing_views[k], missing[k]->resolution, missing[k]->breaks);
  });
}

size_t SampledViews::BytesOf(const View& view) const {
  const auto found = views_.find(&view);
  return found == views_.end() ? 0 : found->second.sampled.bytes();
}

}  // namespace dtr::simd
