#include "stereo/geometric_passes.h"

#include <algorithm>
#include <string>

#include "dtr/base/error.h"
#include "stereo/side_by_side.h"

namespace dtr::stereo {
namespace {

const std::vector<int>& NeighboursOf(const Collection& c, int view) {
  return c.neighbours[static_cast<size_t>(view)].views;
}

/// Which views each pass must still compute: what the next one lacks needs all around it.
std::vector<std::vector<int>> Missing(const Collection& c, std::span<const int> needed,
                                      const PlaneMapStore& store) {
  const int passes = c.engine->Passes();
  std::vector<std::vector<int>> missing(static_cast<size_t>(passes) + 1);
  std::vector<bool> wanted(c.views.size(), false);
  for (const int v : needed) wanted[static_cast<size_t>(v)] = true;
  for (int pass = passes; pass >= 0; --pass) {
    std::vector<int>& here = missing[static_cast<size_t>(pass)];
    for (int v = 0; v < static_cast<int>(wanted.size()); ++v) {
      if (wanted[static_cast<size_t>(v)] && !store.Has(pass, v)) here.push_back(v);
    }
    wanted.assign(wanted.size(), false);
    for (const int v : here) {
      wanted[static_cast<size_t>(v)] = true;
      for (const int n : NeighboursOf(c, v)) wanted[static_cast<size_t>(n)] = true;
    }
  }
  return missing;
}

PlaneMap First(const Collection& c, int view, std::string* note) {
  if (NeighboursOf(c, view).empty()) {
    *note = "view " + std::to_string(view) + ": no neighbours, no depth";
    return {};
  }
  try {
    const Room room(c, view);
    return c.engine->Match(room.views(), view, NeighboursOf(c, view),
                           c.ranges[static_cast<size_t>(view)], c.options);
  } catch (const NoUsablePair& error) {
    *note = std::string(error.what()) + ": no depth";
    return {};
  }
}

PlaneMap Next(const Collection& c, PlaneMapStore& store, int pass, int view) {
  const PlanesAround around(c, store, pass - 1, view);
  if (!around.HasOwn()) return {};
  const Room room(c, view);
  return c.engine->Refine(room.views(), view, NeighboursOf(c, view),
                          c.ranges[static_cast<size_t>(view)], around.maps(), pass, c.options);
}

}  // namespace

Room::Room(const Collection& c, int view)
    : around_(c.views, c.load_pixels, c.pages != nullptr ? *c.pages : unlimited_, view,
              NeighboursOf(c, view)),
      work_(c.pages != nullptr ? *c.pages : unlimited_,
            c.engine->WorkBytes(c.views, view, NeighboursOf(c, view))) {}

PlanesAround::PlanesAround(const Collection& collection, PlaneMapStore& store, int pass, int view)
    : maps_(collection.views.size(), nullptr), own_(static_cast<size_t>(view)) {
  std::vector<int> around = NeighboursOf(collection, view);
  around.push_back(view);
  for (const int v : around) {
    held_.push_back(store.Load(pass, v));
    const PlaneMap& map = *held_.back();
    const PinholeCamera& camera = collection.views[static_cast<size_t>(v)].camera;
    for (const Grid<float>* grid : {&map.inverse_depth, &map.slope_x, &map.slope_y}) {
      if (map.empty() ||
          (grid->width() == camera.width_px() && grid->height() == camera.height_px()))
        continue;
      throw Error("planes of view " + std::to_string(v) + ": expected " +
                  std::to_string(camera.width_px()) + "x" + std::to_string(camera.height_px()) +
                  " as the view, found " + std::to_string(grid->width()) + "x" +
                  std::to_string(grid->height()) + "; delete the partial set and build again");
    }
    if (!held_.back()->empty()) maps_[static_cast<size_t>(v)] = held_.back().get();
  }
}

void RequirePass(const Collection& c, std::span<const int> views, const PlaneMapStore& store,
                 int pass) {
  if (c.engine->Passes() == 0) return;
  for (const int view : views) {
    std::vector<int> around = NeighboursOf(c, view);
    around.push_back(view);
    const auto missing =
        std::find_if(around.begin(), around.end(), [&](int v) { return !store.Has(pass, v); });
    if (missing == around.end()) continue;
    const std::string stage = pass == 0 ? "search" : "pass-" + std::to_string(pass);
    throw Error("depth: expected planes of the stage " + stage +
                " of every view, found none of "
                "view " +
                std::to_string(*missing) + "; run all parts of that stage first");
  }
}

void RunPass(const Collection& collection, std::span<const int> views, PlaneMapStore& store,
             int pass, Progress& progress) {
  std::vector<int> missing;
  for (const int view : views) {
    if (!store.Has(pass, view)) missing.push_back(view);
  }
  if (pass > 0) RequirePass(collection, missing, store, pass - 1);
  progress.Stage(pass == 0 ? "matching" : "consistency pass " + std::to_string(pass),
                 static_cast<int>(missing.size()));
  SideBySide(missing.size(), ViewsAtOnce(collection, missing, false), progress,
             [&](size_t k, std::string* note) {
               const int view = missing[k];
               store.Save(
                   pass, view,
                   pass == 0 ? First(collection, view, note) : Next(collection, store, pass, view));
             });
}

void RunAllPasses(const Collection& collection, std::span<const int> needed, PlaneMapStore& store,
                  Progress& progress) {
  const std::vector<std::vector<int>> missing = Missing(collection, needed, store);
  for (int pass = 0; pass < static_cast<int>(missing.size()); ++pass) {
    RunPass(collection, missing[static_cast<size_t>(pass)], store, pass, progress);
    if (pass > 0) store.Drop(pass - 1);
  }
}

}  // namespace dtr::stereo
