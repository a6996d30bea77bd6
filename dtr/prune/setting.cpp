#include "dtr/prune/setting.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <sstream>
#include <type_traits>

#include "dtr/base/hash.h"

namespace dtr::prune {
namespace {

// From what others show twice over and nearly alike to what one other shows somehow.
constexpr TileRule kTileRules[] = {{3, 8}, {2, 12}, {2, 27}, {1, 18}};

// A view that a pixel looks at and finds a tile left out costs about so much of one that is there:
// its place is found, nothing is looked up.
constexpr double kLookAtNothing = 0.3;
// What frames take of those with default meshes and all samples: guesses near what was measured
// on courtyard (docs/accuracy/SPEED.md: 0.89 for 1 px against 0.5, 0.63); more of either saves
// little more.
constexpr double kCoarseMesh = 0.95, kFewerSamples = 0.8;

const TileRule& RuleOf(double level) { return kTileRules[static_cast<size_t>(level) - 1]; }

}  // namespace

Setting WithNothingRemoved(Setting setting) {
  setting.without.clear();
  setting.coding.tiles.clear();
  return setting;
}

const char* NameOf(Kind kind) {
  switch (kind) {
    case Kind::kView:
      return "view";
    case Kind::kTiles:
      return "tiles";
    case Kind::kViewsUsed:
      return "views-used";
    case Kind::kResolution:
      return "resolution";
    case Kind::kImages:
      return "images";
    case Kind::kDepth:
      return "depth";
    case Kind::kSize:
      return "size";
    case Kind::kMesh:
      break;
  }
  return "mesh";
}

std::vector<double> LevelsOf(Kind kind) {
  switch (kind) {
    case Kind::kTiles: {
      std::vector<double> levels;
      for (size_t i = 0; i < std::size(kTileRules); ++i) {
        levels.push_back(static_cast<double>(i + 1));
      }
      return levels;
    }
    case Kind::kViewsUsed:
      return {8, 6, 4, 3, 2, 1};
    case Kind::kResolution:
      return {2, 4};
    case Kind::kImages:
      return {98, 95, 90, 85, 80, 70, 60, 45};
    case Kind::kDepth:
      return {0.125, 0.25, 0.5, 1};
    case Kind::kSize:
      return {2};
    case Kind::kMesh:
      return {1, 2, 4};
    case Kind::kView:
      break;
  }
  return {};
}

bool MaySkipLevels(Kind kind) { return kind == Kind::kTiles || kind == Kind::kViewsUsed; }

std::optional<Setting> Mover::After(Setting setting, const Move& move) {
  Coding& coding = setting.coding;
  const auto lower = [&](auto& value) {
    const auto level = static_cast<std::remove_reference_t<decltype(value)>>(move.level);
    if (value != 0 && level >= value) return false;
    value = level;
    return true;
  };
  const auto raise = [&](auto& value) {
    const auto level = static_cast<std::remove_reference_t<decltype(value)>>(move.level);
    if (level <= value) return false;
    value = level;
    return true;
  };
  bool changed = false;
  switch (move.kind) {
    case Kind::kView:
      setting.without.push_back(move.view);
      coding.tiles.erase(move.view);
      changed = true;
      break;
    case Kind::kTiles: {
      const double before = TilesShare(setting);
      coding.tiles = RedundantTiles(CoverWithout(setting.without), RuleOf(move.level));
      changed = TilesShare(setting) > before;
      break;
    }
    case Kind::kViewsUsed:
      changed = lower(setting.render.views);
      break;
    case Kind::kResolution:
      changed = raise(setting.render.resolution);
      coding.mesh_resolution = setting.render.resolution;
      break;
    case Kind::kImages:
      changed = lower(coding.jpeg_quality);
      break;
    case Kind::kDepth:
      changed = raise(coding.depth_error_px);
      break;
    case Kind::kSize:
      changed = raise(coding.shrink);
      break;
    case Kind::kMesh:
      changed = raise(coding.mesh_tolerance_px);
      setting.render.mesh_tolerance_px = coding.mesh_tolerance_px;
      break;
  }
  return changed ? std::optional(setting) : std::nullopt;
}

const CoverMap& Mover::CoverWithout(const std::vector<std::string>& without) {
  if (!cover_ || cover_without_ != without) {
    cover_ = WhoCovers(set_, without);
    cover_without_ = without;
  }
  return *cover_;
}

std::string Mover::WordsFor(const Move& move, const Setting& after) const {
  std::ostringstream words;
  switch (move.kind) {
    case Kind::kView:
      for (const View& view : set_.frames.front().views) {
        if (view.id == move.view) words << view.name;
      }
      break;
    case Kind::kTiles: {
      const TileRule& rule = RuleOf(move.level);
      words << std::round(1000 * TilesShare(after)) / 10 << " % of all, each covered by "
            << rule.coverers << " that stay, within " << rule.levels << " levels";
      break;
    }
    case Kind::kViewsUsed:
      words << "at most " << move.level << " views a pixel";
      break;
    case Kind::kResolution:
      words << "1/" << move.level << " of the samples of depth per axis are drawn";
      break;
    case Kind::kImages:
      words << "JPEG quality " << move.level;
      break;
    case Kind::kDepth:
      words << "within " << move.level << " px of disparity";
      break;
    case Kind::kSize:
      words << "images and depth at 1/" << move.level << " of their size";
      break;
    case Kind::kMesh:
      words << "tolerance " << move.level << " px";
      break;
  }
  return words.str();
}

size_t Mover::SourcesLeft(const Setting& setting) const {
  const auto& views = set_.frames.front().views;
  const auto sources = std::count_if(
      views.begin(), views.end(), [](const View& view) { return view.role == ViewRole::kSource; });
  return static_cast<size_t>(sources) - setting.without.size();
}

double Mover::TilesShare(const Setting& setting) const {
  size_t tiles = 0;
  for (const View& view : set_.frames.front().views) {
    const auto& without = setting.without;
    const bool left = std::find(without.begin(), without.end(), view.id) == without.end();
    if (view.role == ViewRole::kSource && left) {
      tiles += static_cast<size_t>(TileGridOf(view).count());
    }
  }
  return ShareOf(setting.coding.tiles, tiles);
}

double Mover::FrameOf(const Setting& setting) const {
  const auto views = std::min(static_cast<size_t>(setting.render.views), SourcesLeft(setting));
  const double tiles = 1 - (1 - kLookAtNothing) * TilesShare(setting);
  const double mesh = setting.render.mesh_tolerance_px >= 1 ? kCoarseMesh : 1;
  const double samples = setting.render.resolution > 1 ? kFewerSamples : 1;
  return static_cast<double>(views) * tiles * mesh * samples;
}

Setting Redone(Setting on, const Setting& before, const Setting& after) {
  on.without.insert(on.without.end(),
                    after.without.begin() + static_cast<std::ptrdiff_t>(before.without.size()),
                    after.without.end());
  const auto carry = [](auto& to, const auto& from, const auto& was) {
    if (from != was) to = from;
  };
  carry(on.coding.jpeg_quality, after.coding.jpeg_quality, before.coding.jpeg_quality);
  carry(on.coding.depth_error_px, after.coding.depth_error_px, before.coding.depth_error_px);
  carry(on.coding.shrink, after.coding.shrink, before.coding.shrink);
  carry(on.coding.mesh_tolerance_px, after.coding.mesh_tolerance_px,
        before.coding.mesh_tolerance_px);
  carry(on.coding.sigma, after.coding.sigma, before.coding.sigma);
  // A view that goes takes its tiles with it; that is no step of theirs.
  if (after.without.size() == before.without.size()) {
    carry(on.coding.tiles, after.coding.tiles, before.coding.tiles);
  }
  for (const std::string& id : on.without) on.coding.tiles.erase(id);
  carry(on.render.views, after.render.views, before.render.views);
  carry(on.coding.mesh_resolution, after.coding.mesh_resolution, before.coding.mesh_resolution);
  carry(on.render.resolution, after.render.resolution, before.render.resolution);
  carry(on.render.mesh_tolerance_px, after.render.mesh_tolerance_px,
        before.render.mesh_tolerance_px);
  return on;
}

std::string KeyOf(const Setting& setting) {
  const Coding& coding = setting.coding;
  std::ostringstream key;
  key.precision(17);
  for (const std::string& id : setting.without) key << id << "/";
  key << " " << coding.jpeg_quality << " " << coding.depth_error_px << " " << coding.shrink << " "
      << coding.mesh_tolerance_px << " " << coding.sigma << " " << setting.render.views << " "
      << setting.render.mesh_tolerance_px << " " << setting.render.resolution;
  std::string tiles;
  for (const auto& [id, left_out] : coding.tiles) {
    tiles += id + ":";
    for (const std::uint8_t tile : left_out) tiles += tile != 0 ? '1' : '0';
  }
  if (!tiles.empty()) key << " " << Sha256(std::as_bytes(std::span(tiles)));
  return key.str();
}

}  // namespace dtr::prune
