#include "dtr/render/adaptive_mesh.h"

#include <algorithm>
#include <limits>
#include <string>

#include "dtr/base/error.h"
#include "dtr/render/closed_cells.h"
#include "dtr/render/scene.h"

namespace dtr {
namespace {

using Rectangle = BlockCover::Rectangle;
using Range = AdaptiveMesh::Range;
constexpr int kMaxSideSamples = 32767;  // a side; positions in half samples fit 16 bits
constexpr int kTileSide = AdaptiveMesh::kTileSide;
static_assert(kTileSide % BlockCover::kRootSide == 0, "a rectangle lies in one tile");

struct Place {
  int x = 0, y = 0;
};

struct TileContent {
  std::vector<Rectangle> rectangles;
  std::vector<Place> samples;  ///< that no rectangle holds
};

class MeshMaker {
 public:
  MeshMaker(const SampleGrid& samples, const BreakRule& rule, const BlockCover& cover)
      : samples_(samples), w_(samples.inverse_depth), rule_(rule), cover_(cover) {}

  AdaptiveMesh Make() {
    mesh_.columns = w_.width(), mesh_.rows = w_.height();
    mesh_.step = samples_.step, mesh_.offset = samples_.offset;
    if (w_.empty()) return std::move(mesh_);
    state_ = Grid<std::uint8_t>(w_.width(), w_.height());
    number_ = Grid<std::uint32_t>(w_.width(), w_.height());
    for (const Rectangle& rectangle : cover_.rectangles) Mark(rectangle);
    SortIntoTiles();
    for (size_t t = 0; t < tiles_.size(); ++t) AddTile(t);
    return std::move(mesh_);
  }

 private:
  /// Of a sample: whether it is a corner of a triangle, and which quarters of its cell are closed,
  /// those towards smaller x and y first (SPEC 2.6).
  enum State : std::uint8_t {
    kVertex = 1,
    kClosedAbove = 2 | 4,
    kClosedBelow = 8 | 16,
    kClosedLeft = 2 | 8,
    kClosedRight = 4 | 16,
    kInner = 32  ///< inside of a rectangle
  };

  void SetState(int x, int y, int state) {
    if (!(w_(x, y) > 0)) {
      throw Error("block cover: expected blocks of this depth map, found one with a hole");
    }
    state_(x, y) = static_cast<std::uint8_t>(state_(x, y) | state);
  }

  /// Every corner of a triangle is a vertex, for its own rectangle and for all that touch it.
  void Mark(const Rectangle& r) {
    constexpr int kQuarterOfCorner[4] = {16, 8, 4, 2};  // a corner's quarter that lies in the block
    const int right = r.x + r.width, bottom = r.y + r.height;
    for (int k = 0; k < 4; ++k) {
      SetState(k & 1 ? right : r.x, k >> 1 ? bottom : r.y, kVertex | kQuarterOfCorner[k]);
    }
    for (int x = r.x + 1; x < right; ++x) {
      SetState(x, r.y, kClosedBelow);
      SetState(x, bottom, kClosedAbove);
    }
    for (int y = r.y + 1; y < bottom; ++y) {
      SetState(r.x, y, kClosedRight);
      SetState(right, y, kClosedLeft);
      std::fill_n(state_.row(y) + r.x + 1, r.width - 1, static_cast<std::uint8_t>(kInner));
    }
  }

  void SortIntoTiles() {
    tiles_across_ = (w_.width() + kTileSide - 1) / kTileSide;
    const int tiles_down = (w_.height() + kTileSide - 1) / kTileSide;
    tiles_.resize(static_cast<size_t>(tiles_across_) * static_cast<size_t>(tiles_down));
    const auto tile_of = [&](int x, int y) -> TileContent& {
      return tiles_[static_cast<size_t>(y / kTileSide) * static_cast<size_t>(tiles_across_) +
                    static_cast<size_t>(x / kTileSide)];
    };
    for (const Rectangle& r : cover_.rectangles) tile_of(r.x, r.y).rectangles.push_back(r);
    for (int y = 0; y < w_.height(); ++y) {
      for (int x = 0; x < w_.width(); ++x) {
        if (w_(x, y) > 0 && state_(x, y) == 0) tile_of(x, y).samples.push_back({x, y});
      }
    }
    // Those of one size stand together: neighbours in a group of shader invocations cost alike.
    for (TileContent& tile : tiles_) {
      std::stable_sort(tile.rectangles.begin(), tile.rectangles.end(),
                       [](const Rectangle& a, const Rectangle& b) {
                         return a.width * a.height > b.width * b.height;
                       });
    }
  }

  void AddTile(size_t t) {
    tile_ = NewTile();
    tile_.first_triangle = TriangleCount();
    tile_.first_cell = static_cast<int>(mesh_.cells.size());
    for (const Rectangle& rectangle : tiles_[t].rectangles) AddRectangle(rectangle);
    for (const Place& sample : tiles_[t].samples) AddCell(sample.x, sample.y);
    tile_.triangle_count = TriangleCount() - tile_.first_triangle;
    tile_.cell_count = static_cast<int>(mesh_.cells.size()) - tile_.first_cell;
    if (tile_.triangle_count + tile_.cell_count > 0) mesh_.tiles.push_back(tile_);
  }

  int TriangleCount() const { return static_cast<int>(mesh_.indices.size() / 3); }

  static AdaptiveMesh::Tile NewTile() {
    constexpr float kMax = std::numeric_limits<float>::max();
    constexpr Range kNothing{kMax, -kMax};
    return {0, 0, 0, 0, kNothing, kNothing, kNothing, kNothing, kNothing};
  }

  /// The vertices on a rectangle's border, clockwise from A.
  void CollectBorder(const Rectangle& r) {
    border_.clear();
    const int right = r.x + r.width, bottom = r.y + r.height;
    const Place starts[4] = {{r.x, r.y}, {right, r.y}, {right, bottom}, {r.x, bottom}};
    constexpr Place kAlong[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    for (int e = 0; e < 4; ++e) {
      corner_at_[e] = static_cast<int>(border_.size());
      for (int i = 0; i < (e % 2 == 0 ? r.width : r.height); ++i) {
        const Place p{starts[e].x + i * kAlong[e].x, starts[e].y + i * kAlong[e].y};
        if (state_(p.x, p.y) & kVertex) border_.push_back(p);
      }
    }
  }

  void AddRectangle(const Rectangle& r) {
    CollectBorder(r);
    const int n = static_cast<int>(border_.size());
    const auto at = [&](int i) { return border_[static_cast<size_t>(i % n)]; };
    const auto plain = [&](int e) {  // the side from corner e to the next has no inner vertex
      return (e == 3 ? n : corner_at_[e + 1]) - corner_at_[e] == 1;
    };
    if (n == 4) {
      const auto w = [&](int i) { return w_(at(i).x, at(i).y); };
      const int apex = SplitsAlongBC(w(0), w(1), w(3), w(2)) ? 1 : 0;
      AddTriangle(at(apex), at(apex + 1), at(apex + 2));
      AddTriangle(at(apex), at(apex + 2), at(apex + 3));
      return;
    }
    // A corner between two plain sides sees every other vertex at an angle of its own.
    for (int e = 0; e < 4; ++e) {
      if (!plain(e) || !plain((e + 3) % 4)) continue;
      const int apex = corner_at_[e];
      for (int i = 1; i + 1 < n; ++i) AddTriangle(at(apex), at(apex + i), at(apex + i + 1));
      return;
    }
    CutEars();
  }

  /// Any other border: corner after corner is cut off, each time along the shortest diagonal that
  /// leaves no triangle without area.
  void CutEars() {
    const auto area = [&](size_t i) {  // twice that of the ear at i
      const Place& p = border_[(i + border_.size() - 1) % border_.size()];
      const Place &q = border_[i], &n = border_[(i + 1) % border_.size()];
      return (q.x - p.x) * (n.y - p.y) - (q.y - p.y) * (n.x - p.x);
    };
    const auto diagonal = [&](size_t i) {
      const Place& p = border_[(i + border_.size() - 1) % border_.size()];
      const Place& n = border_[(i + 1) % border_.size()];
      return (n.x - p.x) * (n.x - p.x) + (n.y - p.y) * (n.y - p.y);
    };
    const Place &a = border_[0], &d = border_[static_cast<size_t>(corner_at_[2])];
    int left = 2 * (d.x - a.x) * (d.y - a.y);
    while (border_.size() > 3) {
      size_t ear = border_.size();
      for (size_t i = 0; i < border_.size(); ++i) {
        if (area(i) <= 0 || area(i) == left) continue;
        if (ear == border_.size() || diagonal(i) < diagonal(ear)) ear = i;
      }
      left -= area(ear);
      AddTriangle(border_[(ear + border_.size() - 1) % border_.size()], border_[ear],
                  border_[(ear + 1) % border_.size()]);
      border_.erase(border_.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    AddTriangle(border_[0], border_[1], border_[2]);
  }

  std::uint32_t Number(const Place& p) {
    std::uint32_t& number = number_(p.x, p.y);
    if (number == 0) {
      mesh_.vertices.push_back(VertexAt(p));
      number = static_cast<std::uint32_t>(mesh_.vertices.size());
    }
    return number - 1;
  }

  /// A sample's place. Where both quarters of its cell on a side are open, and not those of the
  /// other side too, the surface ends there and goes on to the edge of the cell, on the sample's
  /// local plane (SPEC 2.6).
  AdaptiveMesh::Vertex VertexAt(const Place& p) const {
    const int state = state_(p.x, p.y);
    const auto outwards = [&](int before, int after) {
      return static_cast<int>((state & after) == 0) - static_cast<int>((state & before) == 0);
    };
    const int dx = outwards(kClosedLeft, kClosedRight);
    const int dy = outwards(kClosedAbove, kClosedBelow);
    const double here = w_(p.x, p.y);
    double w = here;
    if (dx != 0) w += 0.5 * dx * LocalSlope(w_, p.x, p.y, 1, 0, rule_);
    if (dy != 0) w += 0.5 * dy * LocalSlope(w_, p.x, p.y, 0, 1, rule_);
    return {HalfSamples(p.x, dx), HalfSamples(p.y, dy),
            static_cast<float>(std::max(w, 0.5 * here))};  // the bound is QuarterCell's
  }

  static std::uint16_t HalfSamples(int sample, int outwards) {
    return static_cast<std::uint16_t>(2 * sample + 1 + outwards);
  }

  void AddTriangle(const Place& a, const Place& b, const Place& c) {
    const std::uint32_t numbers[3] = {Number(a), Number(b), Number(c)};
    mesh_.indices.insert(mesh_.indices.end(), numbers, numbers + 3);
    const AdaptiveMesh::Vertex &va = mesh_.vertices[numbers[0]], &vb = mesh_.vertices[numbers[1]],
                               &vc = mesh_.vertices[numbers[2]];
    for (const auto* v : {&va, &vb, &vc}) Include(v->x, v->y, v->inverse_depth);
    const double bx = vb.x - va.x, by = vb.y - va.y,
                 bw = double(vb.inverse_depth) - va.inverse_depth;
    const double cx = vc.x - va.x, cy = vc.y - va.y,
                 cw = double(vc.inverse_depth) - va.inverse_depth;
    const double per_sample = 2 / (bx * cy - by * cx);
    IncludeSlopes((bw * cy - cw * by) * per_sample, (bx * cw - cx * bw) * per_sample);
  }

  void AddCell(int x, int y) {
    const AdaptiveMesh::Cell cell{HalfSamples(x, 0), HalfSamples(y, 0),
                                  static_cast<float>(w_(x, y)),
                                  static_cast<float>(LocalSlope(w_, x, y, 1, 0, rule_)),
                                  static_cast<float>(LocalSlope(w_, x, y, 0, 1, rule_))};
    mesh_.cells.push_back(cell);
    Include(cell.x, cell.y, cell.inverse_depth);
    IncludeSlopes(cell.slope_x, cell.slope_y);
  }

  static void Extend(Range& range, double value) {
    range.low = std::min(range.low, static_cast<float>(value));
    range.high = std::max(range.high, static_cast<float>(value));
  }
  void Include(int x, int y, float w) {
    Extend(tile_.x, x);
    Extend(tile_.y, y);
    Extend(tile_.inverse_depth, w);
  }
  void IncludeSlopes(double slope_x, double slope_y) {
    Extend(tile_.slope_x, slope_x);
    Extend(tile_.slope_y, slope_y);
  }

  const SampleGrid& samples_;
  const Grid<double>& w_;
  const BreakRule rule_;
  const BlockCover& cover_;
  Grid<std::uint8_t> state_;
  Grid<std::uint32_t> number_;  ///< of the vertex at a sample, from 1; 0: none yet
  int tiles_across_ = 0;
  std::vector<TileContent> tiles_;
  std::vector<Place> border_;
  int corner_at_[4] = {};
  AdaptiveMesh mesh_;
  AdaptiveMesh::Tile tile_;
};

}  // namespace

MeshRule MeshRuleOf(const View& view, const RenderOptions& options) {
  const InverseDepthThresholds thresholds = ThresholdsOf(view, options);
  return {BreakRuleOf(view, options), thresholds.mesh_tolerance};
}

AdaptiveMesh MakeAdaptiveMesh(const SampleGrid& samples, const BreakRule& rule,
                              const BlockCover& cover) {
  const Grid<double>& w = samples.inverse_depth;
  if (cover.columns != w.width() || cover.rows != w.height()) {
    throw Error("block cover: expected one of " + std::to_string(w.width()) + "x" +
                std::to_string(w.height()) + " samples, found " + std::to_string(cover.columns) +
                "x" + std::to_string(cover.rows));
  }
  if (w.width() > kMaxSideSamples || w.height() > kMaxSideSamples) {
    throw Error("reduced mesh: expected at most " + std::to_string(kMaxSideSamples) +
                " depth samples a side, found " + std::to_string(w.width()) + "x" +
                std::to_string(w.height()) + "; use a larger `resolution`");
  }
  return MeshMaker(samples, rule, cover).Make();
}

AdaptiveMesh MakeAdaptiveMesh(const View& view, const RenderOptions& options, std::string& unfit) {
  unfit.clear();
  const SampleGrid samples = MakeSampleGrid(view, options.resolution);
  const MeshRule rule = MeshRuleOf(view, options);
  // Without a sample there is nothing that a stored mesh could fit.
  if (view.mesh && !samples.inverse_depth.empty() && view.mesh->resolution == options.resolution &&
      MeshRule{{view.mesh->depth_break, view.mesh->absolute_depth_break}, view.mesh->tolerance} ==
          rule) {
    try {
      return MakeAdaptiveMesh(samples, rule.breaks, view.mesh->cover);
    } catch (const Error& error) {
      unfit = error.what();
    }
  }
  return MakeAdaptiveMesh(samples, rule.breaks,
                          CoverBlocks(samples.inverse_depth, rule.breaks, rule.tolerance));
}

StoredMesh MakeStoredMesh(const View& view, const RenderOptions& options) {
  const SampleGrid samples = MakeSampleGrid(view, options.resolution);
  const MeshRule rule = MeshRuleOf(view, options);
  return {"",
          "",
          options.resolution,
          rule.tolerance,
          rule.breaks.inverse_depth,
          rule.breaks.absolute_depth,
          CoverBlocks(samples.inverse_depth, rule.breaks, rule.tolerance)};
}

}  // namespace dtr
