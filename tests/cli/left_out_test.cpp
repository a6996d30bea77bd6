// What `dtr build` leaves out because this input does not need it: said in one line each, kept in
// the record of the run, and not left out where it is needed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "calib/colmap/model_io.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "pipeline/core/depth/depth_precision.h"
#include "tests/calib/colmap/fake_colmap.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class LeftOut : public ::testing::Test {
 protected:
  void SetUp() override { MakeSmallCourtyard(folder_ / "courtyard"); }
  fs::path Photos() const { return folder_ / "courtyard/images"; }
  std::string Set() const { return (folder_ / "set.dtr").string(); }

  Ran Build(std::vector<std::string> further) const {
    further.insert(further.begin(),
                   {"build", Photos().string(), "-o", Set(), "--force", "--sfm", "colmap"});
    return DtrOk(further);
  }
  std::vector<std::string> WithPoses(std::vector<std::string> further = {}) const {
    further.insert(further.begin(), {"--poses", (folder_ / "courtyard/sparse").string()});
    return further;
  }
  // The lines that the record of the run keeps.
  std::vector<std::string> Log() const {
    return Json::parse(Text(Set() + "/report/run.json"))["log"];
  }
  size_t Views() const { return io::ReadSet(Set()).frames.front().views.size(); }

  // What the mapper leaves of the courtyard's photos: the truth, in the order of names. `further`
  // photos find no place.
  void LeaveModel(colmap::testing::FakeColmap& colmap, int further = 0, double k1 = 0) const {
    calib::SfmModel model = colmap::ReadModel(folder_ / "courtyard/sparse");
    for (auto& [id, camera] : model.cameras) {
      const PinholeCamera c = camera.Pinhole();
      camera.model = calib::CameraModel::kSimpleRadial;
      camera.params = {c.fx_px(), c.cx_px(), c.cy_px(), k1};
    }
    std::vector<std::string> aliases = NumberImages(model);
    colmap::WriteModel(colmap / "model.0", model, colmap::Format::kBinary);
    for (int i = 0; i < further; ++i) {
      aliases.push_back(fmt::format("{:06}.jpg", aliases.size()));
    }
    colmap.LeaveDatabase(aliases);
  }
  TemporaryFolder folder_;
};

TEST_F(LeftOut, SfmAndUndistortionWhereCamerasAreGivenAndStraight) {
  Build(WithPoses({"--engine", "none"}));
  EXPECT_THAT(Log(), Contains("structure from motion left out: cameras are given"));
  EXPECT_THAT(Log(), Contains("undistortion left out: no camera has distortion"));
}

TEST_F(LeftOut, NeitherWhereNoCamerasAreGivenAndTheLensDistorts) {
  colmap::testing::FakeColmap colmap;
  LeaveModel(colmap, 0, -0.01);
  Build({"--engine", "none", "--no-refine"});
  EXPECT_THAT(Log(), Not(Contains(HasSubstr("undistortion left out"))));
  EXPECT_THAT(Log(), Not(Contains(HasSubstr("structure from motion left out"))));
  EXPECT_THAT(colmap.Calls(), Contains(HasSubstr("mapper")));
}

TEST_F(LeftOut, BundleAdjustmentWhereUnseenObservationsArePredictedNoBetter) {
  colmap::testing::FakeColmap colmap;
  LeaveModel(colmap);
  Build({"--engine", "none"});
  EXPECT_THAT(Log(), Contains(HasSubstr("bundle adjustment left out: ")));
  LeaveModel(colmap, 0, -0.01);  // not the lens that these points were seen through
  Build({"--engine", "none"});
  EXPECT_THAT(Log(), Not(Contains(HasSubstr("bundle adjustment left out"))));
}

TEST_F(LeftOut, APhotoThatIsThereTwice) {
  fs::copy_file(Photos() / "0003.jpg", Photos() / "0003_again.jpg");
  {
    colmap::testing::FakeColmap colmap;
    LeaveModel(colmap);
    const std::string line = "0003_again.jpg left out: it has the same pixels as 0003.jpg";
    const Ran ran = Build({"--engine", "none", "--json", "-"});
    EXPECT_THAT(ran.err, HasSubstr(line));
    EXPECT_THAT(Log(), Contains(line));
    EXPECT_EQ(Json::parse(ran.out)["skipped"][0]["name"], "0003_again.jpg");
    EXPECT_EQ(Views(), kCourtyardViews);
    // What is held out by name is shown by no other photo.
    const Ran held = Build({"--engine", "none", "--holdout", "0003_again.jpg", "--json", "-"});
    EXPECT_EQ(Json::parse(held.out)["skipped"][0]["name"], "0003.jpg");
  }
  // Cameras of their own say that they are photos of their own; without them it can be asked for.
  Build(WithPoses({"--engine", "none"}));
  EXPECT_THAT(Log(), Not(Contains(HasSubstr("same pixels"))));
  colmap::testing::FakeColmap colmap;
  LeaveModel(colmap, 1);
  const Ran kept = Build({"--engine", "none", "--keep-duplicates", "--json", "-"});
  EXPECT_THAT(Log(), Not(Contains(HasSubstr("same pixels"))));
  EXPECT_EQ(Json::parse(kept.out)["not_registered"].size(), 1u);
  EXPECT_THAT(kept.err,
              HasSubstr("not registered: 0006.jpg: 100 features, fewer than 15 of them in "
                        "any other photo"));
}

// A messenger's copy: as large, compressed once more.
void CopyByMessenger(const fs::path& photo, const fs::path& copy) {
  io::WriteImage(copy, io::ReadImage(photo), 75);
}

TEST_F(LeftOut, WhatShowsAHeldOutPhotoAgain) {
  CopyByMessenger(Photos() / "0003.jpg", Photos() / "0003-chat.jpg");
  {
    colmap::testing::FakeColmap colmap;
    LeaveModel(colmap);
    const std::string line =
        "0003-chat.jpg left out: it shows the same image as the held-out photo 0003.jpg";
    const Ran ran = Build({"--engine", "none", "--holdout", "0003.jpg", "--json", "-"});
    EXPECT_THAT(ran.err, HasSubstr(line));
    EXPECT_THAT(Log(), Contains(line));
    EXPECT_EQ(Json::parse(ran.out)["skipped"][0]["name"], "0003-chat.jpg");
    EXPECT_EQ(Views(), kCourtyardViews);
  }
  const fs::path few = folder_ / "few";
  fs::create_directories(few);
  for (const char* name : {"0001.jpg", "0003.jpg", "0003-chat.jpg"}) {
    fs::copy_file(Photos() / name, few / name);
  }
  ExpectRejected(Dtr({"build", few.string(), "-o", Set(), "--force", "--holdout", "0003.jpg"}),
                 kWrongUsage, "photos to build from that show something else than held-out ones");
}

TEST_F(LeftOut, FloatsWhere16BitsHold) {
  Build(WithPoses({"--passes", "0", "--iterations", "1", "--neighbours", "2"}));
  EXPECT_THAT(Log(), Contains("depth in floats left out: 16 bits hold what is known in all 7 "
                              "views"));
  const DtrSet set = io::ReadSet(Set());
  for (const View& view : set.frames.front().views) {
    EXPECT_EQ(view.depth_coding, DepthCoding::kPng16InverseDepth);
  }
}

// Depths from near to far, evenly in 1/z, known to `sigma` of it.
View WithDepth(double near_z, double far_z, float sigma) {
  View view;
  view.depth = DepthImage(64, 48);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const double share = (64 * y + x) / (64.0 * 48 - 1);
      view.depth(x, y) = static_cast<float>(1 / (1 / far_z + share * (1 / near_z - 1 / far_z)));
    }
  }
  view.inverse_depth_sigma = Grid<float>(64, 48, 1, sigma);
  return view;
}

TEST(ChooseDepthCoding, SixteenBitsUnlessTheyWouldAddToTheError) {
  // By hand: steps of 0.9 / 65534 round by 3.96e-6, which is 0.4 % of the deviation.
  View view = WithDepth(1, 10, 1e-3f);
  EXPECT_NEAR(pipeline::RoundingInSigmas(view), 3.964e-3, 1e-5);
  pipeline::ChooseDepthCoding(view);
  EXPECT_EQ(view.depth_coding, DepthCoding::kPng16InverseDepth);
  // A twig at a millimetre before a view of kilometres whose depth is good: 40 % of the deviation.
  View twig = WithDepth(1e-3, 1e3, 1e-2f);
  pipeline::ChooseDepthCoding(twig);
  EXPECT_EQ(twig.depth_coding, DepthCoding::kExrFloat);
  View asked = WithDepth(1, 10, 1e-3f);
  asked.depth_coding = DepthCoding::kExrHalf;
  pipeline::ChooseDepthCoding(asked);
  EXPECT_EQ(asked.depth_coding, DepthCoding::kExrHalf);
  View unsaid = WithDepth(1e-3, 1e3, 1e-2f);
  unsaid.inverse_depth_sigma.reset();
  pipeline::ChooseDepthCoding(unsaid);
  EXPECT_EQ(unsaid.depth_coding, DepthCoding::kPng16InverseDepth);

  for (View* v : {&view, &twig}) v->depth_file.emplace();
  EXPECT_EQ(pipeline::SayDepthCodings({view, twig}),
            "depth in floats in 1 of 2 views: asked for, or 16 bits would add to its error");
  EXPECT_EQ(pipeline::SayDepthCodings({}), "");
}

}  // namespace
}  // namespace dtr::testing
