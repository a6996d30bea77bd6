// dtr/prune/setting.h -- a set as it is pruned, and the steps from one such setting to the next.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "dtr/prune/coding.h"
#include "dtr/prune/cover.h"
#include "dtr/render/options.h"

namespace dtr::prune {

/// What of a set is kept, how it is stored, how it is drawn.
struct Setting {
  std::vector<std::string> without;  ///< ids of source views that are left out, in that order
  Coding coding;
  RenderOptions render;
};

/// Stored and drawn the same, with all views and tiles.
Setting WithNothingRemoved(Setting setting);

enum class Kind { kView, kTiles, kViewsUsed, kResolution, kImages, kDepth, kSize, kMesh };
inline constexpr std::array kLevelled = {Kind::kTiles,  Kind::kViewsUsed, Kind::kResolution,
                                         Kind::kImages, Kind::kDepth,     Kind::kSize,
                                         Kind::kMesh};
const char* NameOf(Kind kind);

/// Steps of each kind, most expensive first. Of `tiles`: 1 + the index of a rule.
std::vector<double> LevelsOf(Kind kind);
/// True where all levels are tried at once: they may pay where the first of them does not.
bool MaySkipLevels(Kind kind);

struct Move {
  Kind kind = Kind::kView;
  std::string view;  ///< its id
  double level = 0;
  bool operator==(const Move&) const = default;
};

/// Takes steps on one set.
class Mover {
 public:
  /// `set`: loaded, must outlive this.
  explicit Mover(const DtrSet& set) : set_(set) {}

  /// The setting after a move; nothing where it changes nothing or goes back.
  std::optional<Setting> After(Setting setting, const Move& move);
  /// What was left out: a view's name, "JPEG quality 90".
  std::string WordsFor(const Move& move, const Setting& after) const;
  /// Source views that are left.
  size_t SourcesLeft(const Setting& setting) const;
  /// Of the tiles of the views that are left, the share that is left out.
  double TilesShare(const Setting& setting) const;
  /// What a frame's time is proportional to, measured in views that a pixel looks at, of full
  /// resolution and default meshes: times themselves would make decisions depend on the machine.
  double FrameOf(const Setting& setting) const;

 private:
  const CoverMap& CoverWithout(const std::vector<std::string>& without);

  const DtrSet& set_;
  std::optional<CoverMap> cover_;
  std::vector<std::string> cover_without_;
};

/// What a decision changed, done to another setting.
Setting Redone(Setting on, const Setting& before, const Setting& after);

/// The same for equal settings, and for those alone.
std::string KeyOf(const Setting& setting);

}  // namespace dtr::prune
