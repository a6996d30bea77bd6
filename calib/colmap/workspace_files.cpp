#include "calib/colmap/workspace_files.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/colmap/model_io.h"
#include "dtr/base/error.h"

namespace dtr::colmap {
namespace fs = std::filesystem;

calib::SfmModel ReadModelHere(const sfm::Workspace& workspace, const fs::path& folder) {
  calib::SfmModel model = ReadModel(folder);
  for (calib::SfmImage& image : model.images) image.name = workspace.NameOfAlias(image.name);
  return model;  // aliases sort as the names do
}

void WriteModelHere(const sfm::Workspace& workspace, const fs::path& folder,
                    calib::SfmModel model) {
  const auto& images = workspace.images();
  for (calib::SfmImage& image : model.images) {
    const auto known = std::lower_bound(images.begin(), images.end(), image.name,
                                        [](const auto& a, const auto& b) { return a.name < b; });
    if (known == images.end() || known->name != image.name) {
      throw Error(fmt::format("{}: expected images of this workspace only, found '{}'",
                              folder.string(), image.name));
    }
    image.name = workspace.AliasOf(static_cast<size_t>(known - images.begin()));
  }
  WriteModel(folder, model, Format::kBinary);
}

}  // namespace dtr::colmap
