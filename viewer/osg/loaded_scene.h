// viewer/osg/loaded_scene.h -- a set in memory, as nodes and their copies share it.
#pragma once
#include <osg/BoundingBox>

#include <memory>
#include <string>

#include "dtr/render/scene.h"
#include "dtr/types/dtr_set.h"

namespace osgDTR {

/// Never changes once it is made; read by several threads at a time.
struct LoadedScene {
  dtr::DtrSet set;
  dtr::RenderScene scene;   ///< of `set`
  osg::BoundingBox bounds;  ///< of all that can be drawn; set.bounds leaves out the outermost 1 %
};

/// Reads the set with images and depth; osg::notify is told of what is left out of it.
/// Throws dtr::Error.
std::shared_ptr<const LoadedScene> LoadScene(const std::string& set_folder);

/// The same of a set in memory, whose source views are loaded.
std::shared_ptr<const LoadedScene> MakeScene(dtr::DtrSet set);

}  // namespace osgDTR
