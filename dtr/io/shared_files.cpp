#include "dtr/io/shared_files.h"

#include <cstdint>
#include <map>
#include <string>
#include <utility>

namespace dtr::io {

void ShareEqualFiles(DtrSet& set) {
  std::map<std::pair<std::string, std::uint64_t>, std::string> path_of;
  for (Frame& frame : set.frames) {
    for (View& view : frame.views) {
      if (view.role != ViewRole::kSource) continue;  // those of held-out views have no hash here
      for (auto* file : {&view.image_file, &view.mask_file, &view.depth_file, &view.completed_file,
                         &view.sigma_file, &view.mesh_file}) {
        if (!*file) continue;
        const auto first =
            path_of.emplace(std::pair((*file)->sha256, (*file)->bytes), (*file)->path);
        (*file)->path = first.first->second;
      }
    }
  }
}

}  // namespace dtr::io
