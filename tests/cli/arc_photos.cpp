#include "tests/cli/arc_photos.h"

#include "datasets/make.h"

namespace dtr::testing {

void MakeArcPhotos(const std::filesystem::path& folder, double noise) {
  datasets::DatasetSpec spec;
  spec.layout = "arc";
  spec.views = kArcPhotos;
  spec.width_px = 480;
  spec.height_px = 320;
  spec.noise = noise;
  SilentProgress silent;
  datasets::MakeDataset(spec, folder, silent);
}

}  // namespace dtr::testing
