#include "dtr/render/mesh_cache.h"

#include <stdexcept>
#include <utility>

#include "dtr/base/parallel_for.h"

namespace dtr {

MeshCache::Key MeshCache::KeyOf(const View& view, const RenderOptions& options) {
  return {options.resolution, MeshRuleOf(view, options), view.depth.grid().data().data()};
}

void MeshCache::Prepare(const std::vector<const View*>& views, const RenderOptions& options) {
  std::vector<const View*> missing;
  for (const View* view : views) {
    if (Has(*view, options)) {
      views_.at(view).key.depth_data = view->depth.grid().data().data();
    } else if (view->depth.empty()) {
      throw std::logic_error(view->name + ": neither its depth is there nor its mesh");
    } else {
      missing.push_back(view);
    }
  }
  std::vector<AdaptiveMesh> meshes(missing.size());
  std::vector<std::string> unfit(missing.size());
  ParallelFor(0, static_cast<int>(missing.size()), [&](int i) {
    const auto k = static_cast<size_t>(i);
    meshes[k] = MakeAdaptiveMesh(*missing[k], options, unfit[k]);
  });
  for (size_t k = 0; k < missing.size(); ++k) {
    if (unfit[k].empty()) continue;
    warn_("WARNING: " + missing[k]->name +
          ": its stored mesh does not fit its depth map and was made again: " + unfit[k]);
  }
  for (size_t k = 0; k < missing.size(); ++k) {
    if (on_new_mesh_) on_new_mesh_(*missing[k], meshes[k]);
    views_.insert_or_assign(missing[k], Stored{KeyOf(*missing[k], options), std::move(meshes[k])});
  }
}

bool MeshCache::Has(const View& view, const RenderOptions& options) const {
  const auto found = views_.find(&view);
  if (found == views_.end()) return false;
  Key wanted = KeyOf(view, options);
  const void* const stored = found->second.key.depth_data;
  if (view.depth.empty() || stored == nullptr) wanted.depth_data = stored;
  return found->second.key == wanted;
}

}  // namespace dtr
