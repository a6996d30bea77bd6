// stereo/geometric_passes.h -- planes of a collection, pass after pass.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "dtr/base/progress.h"
#include "stereo/engine.h"
#include "stereo/neighbours.h"
#include "stereo/view_paging.h"

namespace dtr::stereo {

/// What a run over a collection works on; borrowed.
struct Collection {
  std::span<const StereoView> views;
  std::span<const ViewNeighbours> neighbours;
  std::span<const DepthRange> ranges;
  const Engine* engine = nullptr;
  EngineOptions options;
  PixelLoader load_pixels = {};  ///< null: the views have theirs in memory
  Pages* pages = nullptr;        ///< what bounds the memory; null: nothing does
};

/// What an engine's call for one view takes: the pixels it sees, and room for its work.
class Room {
 public:
  Room(const Collection& collection, int view);
  std::span<const StereoView> views() const { return around_.views(); }

 private:
  Pages unlimited_;
  ViewsAround around_;
  Pages::Reservation work_;
};

/// The planes that concern one view: its own and its neighbours', kept alive.
class PlanesAround {
 public:
  PlanesAround(const Collection& collection, PlaneMapStore& store, int pass, int view);
  /// One entry per view of the collection; null where there are no planes or the view is none of
  /// these.
  std::span<const PlaneMap* const> maps() const { return maps_; }
  bool HasOwn() const { return maps_[own_] != nullptr; }

 private:
  std::vector<std::shared_ptr<const PlaneMap>> held_;
  std::vector<const PlaneMap*> maps_;
  size_t own_;
};

/// Sees to it that `store` has the planes of the engine's last pass for all `needed` views. A
/// pass of a view reads only the pass before, so the order of views has no influence; what the
/// store has already is not computed again. As many views are worked on at a time as the pages have
/// room for (ViewsAtOnce), one always. A view without neighbours, or for which the
/// engine finds no usable pair, gets empty planes and a note. Throws what the engine throws, and
/// Interrupted between views.
void RunAllPasses(const Collection& collection, std::span<const int> needed, PlaneMapStore& store,
                  Progress& progress);

/// One pass (0: the search) of these views alone: what `store` has already is not computed again.
/// The pass before must be there, of their neighbours too: throws Error as RequirePass; else as
/// RunAllPasses.
void RunPass(const Collection& collection, std::span<const int> views, PlaneMapStore& store,
             int pass, Progress& progress);

/// Throws Error where `store` lacks planes of `pass` of these views or their neighbours; never
/// where the engine has no passes.
void RequirePass(const Collection& collection, std::span<const int> views,
                 const PlaneMapStore& store, int pass);

}  // namespace dtr::stereo
