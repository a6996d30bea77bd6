// viewer/osg/loaded_scene.h -- a set in memory, as nodes and their copies share it.
#pragma once
#include <osg/BoundingBox>

#include <memory>
#include <string>
#include <vector>

#include "dtr/render/options.h"
#include "dtr/render/scene.h"
#include "dtr/render/time_steps.h"
#include "dtr/types/dtr_set.h"

namespace osgDTR {

/// One time step of a set.
struct LoadedScene {
  dtr::DtrSet set;         ///< its only frame is that time step
  dtr::RenderScene scene;  ///< of `set`
};

/// Never changes once it is made; used by several threads at a time.
struct LoadedSet {
  std::vector<LoadedScene> time_steps;  ///< one of a still scene
  dtr::FrameClock clock;                ///< of the time steps
  dtr::RenderOptions defaults;          ///< what the set was pruned for, else the library's
  /// Of what can be drawn at any time step, but for single pixels that lie far beyond all others of
  /// their views; DtrSet::bounds leaves out the outermost 1 %.
  osg::BoundingBox bounds;
};

/// Reads the set with images and depth; osg::notify is told of what is left out of it.
/// Throws dtr::Error.
std::shared_ptr<const LoadedSet> LoadSet(const std::string& set_folder);

/// The same of a set in memory, whose source views are loaded.
std::shared_ptr<const LoadedSet> MakeSet(dtr::DtrSet set);

}  // namespace osgDTR
