#include "dtr/prune/tiles.h"

#include <algorithm>
#include <numeric>

namespace dtr::prune {
namespace {

constexpr double kMinCovered = 0.95;  // of a tile's places; the rest is holes and outlines

/// Chooses tiles, keeping count of who still covers what.
class TileChooser {
 public:
  TileChooser(const CoverMap& map, const TileRule& rule) : map_(map), rule_(rule) {
    for (const CoveredView& view : map.views) {
      left_out_.emplace_back(static_cast<size_t>(view.grid.count()));
      places_of_.emplace_back(static_cast<size_t>(view.grid.count()));
      relying_.emplace_back(static_cast<size_t>(view.grid.count()));
      covered_.emplace_back();
    }
    for (size_t v = 0; v < map.views.size(); ++v) {
      const auto& places = map.views[v].places;
      for (size_t p = 0; p < places.size(); ++p) {
        places_of_[v][static_cast<size_t>(places[p].tile)].push_back(p);
        covered_[v].push_back(places[p].count);
        for (int k = 0; k < places[p].count; ++k) {
          const Coverer& by = places[p].coverers[static_cast<size_t>(k)];
          relying_[static_cast<size_t>(by.view)][static_cast<size_t>(by.tile)].push_back({v, p});
        }
      }
    }
  }

  void Choose() {
    std::vector<size_t> order(map_.views.size()), redundant(map_.views.size());
    std::iota(order.begin(), order.end(), size_t{0});
    for (const size_t v : order) {
      for (size_t t = 0; t < left_out_[v].size(); ++t) redundant[v] += IsRedundant(v, t);
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return redundant[a] > redundant[b]; });
    for (const size_t v : order) {
      for (size_t t = 0; t < left_out_[v].size(); ++t) {
        if (IsRedundant(v, t) && !IsReliedOn(v, t)) LeaveOut(v, t);
      }
    }
  }

  TilesLeftOut Result() const {
    TilesLeftOut result;
    for (size_t v = 0; v < left_out_.size(); ++v) {
      const auto& tiles = left_out_[v];
      const bool some = std::any_of(tiles.begin(), tiles.end(), [](auto t) { return t != 0; });
      if (some) result[map_.views[v].id] = tiles;
    }
    return result;
  }

 private:
  struct PlaceOf {
    size_t view, place;
  };

  bool Stays(const Coverer& by) const {
    return left_out_[static_cast<size_t>(by.view)][static_cast<size_t>(by.tile)] == 0;
  }
  bool IsCovered(size_t v, size_t p) const { return covered_[v][p] >= rule_.coverers; }

  bool IsRedundant(size_t v, size_t t) const {
    const CoveredView& view = map_.views[v];
    const double places = view.looked[t];
    double covered = 0, squared = 0;
    for (const size_t p : places_of_[v][t]) {
      if (!IsCovered(v, p)) continue;
      ++covered;
      squared += SquaredDifference(view.places[p]);
    }
    return covered > 0 && covered >= kMinCovered * places &&
           squared <= rule_.levels * rule_.levels * covered;
  }

  double SquaredDifference(const CoveredPlace& place) const {
    double sum = 0, count = 0;
    for (int k = 0; k < place.count; ++k) {
      const Coverer& by = place.coverers[static_cast<size_t>(k)];
      if (!Stays(by)) continue;
      sum += by.squared_difference;
      ++count;
    }
    return sum / count;
  }

  /// True where a tile that was left out would lose one of the fewest coverers it may have.
  bool IsReliedOn(size_t v, size_t t) const {
    const auto& relying = relying_[v][t];
    return std::any_of(relying.begin(), relying.end(), [&](const PlaceOf& place) {
      const auto tile = static_cast<size_t>(map_.views[place.view].places[place.place].tile);
      return left_out_[place.view][tile] != 0 &&
             covered_[place.view][place.place] == rule_.coverers;
    });
  }

  void LeaveOut(size_t v, size_t t) {
    left_out_[v][t] = 1;
    for (const PlaceOf& place : relying_[v][t]) --covered_[place.view][place.place];
  }

  const CoverMap& map_;
  const TileRule rule_;
  std::vector<std::vector<std::uint8_t>> left_out_;          // [view][tile]
  std::vector<std::vector<std::vector<size_t>>> places_of_;  // [view][tile]: of the view's places
  std::vector<std::vector<std::vector<PlaceOf>>> relying_;   // [view][tile]: places it covers
  std::vector<std::vector<int>> covered_;                    // [view][place]: by tiles that stay
};

/// Pixels [x0, x1) x [y0, y1) of an image in their mean colour.
void Flatten(ImageRgb8& image, int x0, int y0, int x1, int y1) {
  const double pixels = static_cast<double>(x1 - x0) * (y1 - y0);
  for (int c = 0; c < image.channels(); ++c) {
    double sum = 0;
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) sum += image(x, y, c);
    }
    const auto mean = static_cast<std::uint8_t>(sum / pixels + 0.5);
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) image(x, y, c) = mean;
    }
  }
}

}  // namespace

TilesLeftOut RedundantTiles(const CoverMap& map, const TileRule& rule) {
  TileChooser chooser(map, rule);
  chooser.Choose();
  return chooser.Result();
}

View WithoutTiles(const View& view, const std::vector<std::uint8_t>& left_out) {
  const TileGrid grid = TileGridOf(view);
  View rest = view;
  rest.mesh.reset();
  rest.mesh_file.reset();
  const int width = view.camera.width_px(), height = view.camera.height_px();
  if (rest.mask.empty()) rest.mask = Mask(width, height, 1, 255);
  for (int t = 0; t < grid.count(); ++t) {
    if (left_out[static_cast<size_t>(t)] == 0) continue;
    const int x0 = t % grid.columns * grid.size_px(), y0 = t / grid.columns * grid.size_px();
    const int x1 = std::min(x0 + grid.size_px(), view.depth.width());
    const int y1 = std::min(y0 + grid.size_px(), view.depth.height());
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) rest.depth(x, y) = 0;
    }
    const int s = view.depth_scale;
    for (int y = s * y0; y < s * y1; ++y) std::fill_n(rest.mask.row(y) + s * x0, s * (x1 - x0), 0);
    Flatten(rest.image, s * x0, s * y0, s * x1, s * y1);
  }
  return rest;
}

double ShareOf(const TilesLeftOut& left_out, size_t tiles) {
  size_t count = 0;
  for (const auto& [id, of_view] : left_out) {
    count += static_cast<size_t>(std::count(of_view.begin(), of_view.end(), 1));
  }
  return tiles > 0 ? static_cast<double>(count) / static_cast<double>(tiles) : 0;
}

}  // namespace dtr::prune
