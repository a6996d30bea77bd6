// viewer/osg/dtr_drawable.h -- what a drawable has between node and drawing threads. Only
// viewer/osg's own .cpp files include this.
#pragma once
#include <memory>
#include <mutex>
#include <set>
#include <string>

#include "viewer/osg/context_renderers.h"
#include "viewer/osg/depth_tr.h"

namespace osgDTR {

/// What a frame is drawn by; copied when the frame begins.
struct DrawSettings {
  std::shared_ptr<const LoadedSet> set;
  size_t time_step = 0;
  dtr::RenderOptions options;
  DrawPath path = DrawPath::kGpu;
  FillTime fill_time = FillTime::kAlways;
  unsigned version = 0;  ///< rises with every change
  /// Null without a set.
  std::shared_ptr<const LoadedScene> Scene() const {
    return set ? std::shared_ptr<const LoadedScene>(set, &set->time_steps.at(time_step)) : nullptr;
  }
};

struct DepthTR::dtrDrawable::State {
  DrawSettings Get() const {
    const std::lock_guard lock(mutex);
    return settings;
  }
  template <typename Change>
  void Set(const Change& change) {
    const std::lock_guard lock(mutex);
    change(settings);
    ++settings.version;
  }
  /// True the first time that this is said.
  bool IsNews(const std::string& line) {
    const std::lock_guard lock(mutex);
    return said.insert(line).second;
  }

  mutable std::mutex mutex;
  DrawSettings settings;
  std::set<std::string> said;
  ContextRenderers contexts;
};

}  // namespace osgDTR
