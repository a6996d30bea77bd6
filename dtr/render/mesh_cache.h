// dtr/render/mesh_cache.h -- the views' reduced meshes (SPEC 5.1), cached from frame to frame.
#pragma once
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/options.h"
#include "dtr/types/view.h"

namespace dtr {

/// One mesh per view; other options replace it.
class MeshCache {
 public:
  using Warn = std::function<void(const std::string&)>;
  /// Takes of a new mesh what has a better home; called on the thread that prepares.
  using OnNewMesh = std::function<void(const View&, AdaptiveMesh&)>;

  /// `warn` gets a line for each stored mesh that does not fit its depth map.
  explicit MeshCache(Warn warn, OnNewMesh on_new_mesh = {})
      : warn_(std::move(warn)), on_new_mesh_(std::move(on_new_mesh)) {}

  /// Makes the missing meshes of several views, on all cores. A view without pixels needs to have
  /// one (std::logic_error), which stays when they come back.
  void Prepare(const std::vector<const View*>& views, const RenderOptions& options);

  /// After Prepare.
  const AdaptiveMesh& MeshOf(const View& view) const { return views_.at(&view).mesh; }

  /// True when nothing would be made of its pixels.
  bool Has(const View& view, const RenderOptions& options) const;

  void Drop(const View& view) { views_.erase(&view); }
  void Clear() { views_.clear(); }

 private:
  struct Key {
    int resolution = 0;
    MeshRule rule;
    /// Null after a frame in which the pixels were not there: those that come back are the same.
    const void* depth_data = nullptr;
    bool operator==(const Key&) const = default;
  };
  struct Stored {
    Key key;
    AdaptiveMesh mesh;
  };
  static Key KeyOf(const View& view, const RenderOptions& options);

  const Warn warn_;
  const OnNewMesh on_new_mesh_;
  std::map<const View*, Stored> views_;
};

}  // namespace dtr
