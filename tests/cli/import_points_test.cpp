// Models of COLMAP whose points say nothing of where the scene is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "calib/colmap/model_io.h"
#include "dtr/io/set_io.h"
#include "tests/cli/field_scene.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr char kLine[] =
    "none of its 433 points is seen by two of the 6 photos that are here, so none is used: others "
    "are triangulated from the photos";

class UnsharedPoints : public FieldScene {
 protected:
  /// The scene's model, in which the first photo of each point alone sees it.
  std::string Model() const {
    calib::SfmModel model = colmap::ReadModel(Field("_scene/c_plain"));
    std::set<std::uint64_t> seen;
    for (calib::SfmImage& image : model.images) {
      for (calib::SfmFeature& feature : image.features) {
        if (feature.point_id == calib::SfmFeature::kNoPoint) continue;
        if (!seen.insert(feature.point_id).second) feature.point_id = calib::SfmFeature::kNoPoint;
      }
    }
    colmap::WriteModel(folder_ / "model", model, colmap::Format::kBinary);
    return (folder_ / "model").string();
  }
};

TEST_F(UnsharedPoints, AreNamedByImportWhichTriangulatesOthers) {
  DtrOk({"import", "--cameras", Model(), "--images", Field("_scene/images").string(), "-o", Set(),
         "--json", (folder_ / "result.json").string()});
  EXPECT_THAT(Notes(), HasSubstr(kLine));
  EXPECT_EQ(io::ReadSet(Set()).frames[0].views.size(), 6u);
}

TEST_F(UnsharedPoints, AreNamedByBuildWhichTriangulatesOthers) {
  const Ran ran = DtrOk({"build", Field("_scene/images").string(), "--poses", Model(), "--engine",
                         "none", "-o", Set()});
  EXPECT_THAT(ran.err, HasSubstr(kLine));
  EXPECT_EQ(io::ReadSet(Set()).frames[0].views.size(), 6u);
}

}  // namespace
}  // namespace dtr::testing
