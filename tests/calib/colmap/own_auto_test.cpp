// Which mapper's model SfmEngine::kAuto takes, and what --sfm global does with masks, sequences and
// a kill; photos of the sample collection, a COLMAP that leaves what the test chooses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "calib/colmap/model_io.h"
#include "calib/colmap/steps.h"
#include "calib/sfm/run/sfm.h"
#include "calib/sfm/run/workspace.h"
#include "datasets/hard/hard_sets.h"
#include "dtr/base/error.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/image_io.h"
#include "tests/calib/colmap/fake_colmap.h"
#include "tests/calib/colmap/model_test_support.h"
#include "tests/calib/colmap/plaza_truth.h"
#include "tests/calib/colmap/run_sfm_with_fake.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"

namespace dtr::colmap {
namespace {

using namespace sfm;

using namespace testing;
namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

constexpr int kPhotos = 4;
constexpr int kSmallSidePx = 480;

// Blocks of 5 x 5 pixels: features, and no two images alike.
void WriteNoise(const fs::path& file, unsigned seed) {
  std::mt19937 random(seed);
  ImageRgb8 blocks(320, 240, 3);
  for (int y = 0; y < blocks.height(); y += 5) {
    for (int x = 0; x < blocks.width(); x += 5) {
      const auto value = static_cast<std::uint8_t>(random());
      for (int i = 0; i < 75; ++i) blocks(x + i / 3 % 5, y + i / 15, i % 3) = value;
    }
  }
  io::WriteImage(file, blocks);
}

// Pieces of four photos, each moved to where another was: all of them match a little, and no camera
// sees two of them.
void WriteQuilt(const std::array<fs::path, 4>& photos, const fs::path& file) {
  constexpr int kPiecePx = 105;  // few enough matches that the other photos' model passes
  ImageRgb8 quilt;
  for (size_t i = 0; i < photos.size(); ++i) {
    const ImageRgb8 image = io::ReadImage(photos[i]);
    if (i == 0) quilt = ImageRgb8(image.width(), image.height(), 3);
    const auto corner = [&](size_t at) {
      return Eigen::Vector2i(image.width() * (at % 2 == 0 ? 1 : 5) / 8,
                             image.height() * (at / 2 == 0 ? 1 : 5) / 8);
    };
    const Eigen::Vector2i from = corner(i), to = corner(3 - i);
    for (int y = 0; y < kPiecePx; ++y) {
      for (int x = 0; x < kPiecePx; ++x) {
        for (int c = 0; c < 3; ++c) {
          quilt(to.x() + x, to.y() + y, c) = image(from.x() + x, from.y() + y, c);
        }
      }
    }
  }
  io::WriteImage(file, quilt);
}

class AutoSfm : public ::testing::Test {
 protected:
  AutoSfm() : truth_(PlazaTruth()) {
    options_.colmap = &kSteps;
    options_.engine = SfmEngine::kAuto;
    options_.max_image_size_px = kSmallSidePx;
    options_.lens_model = "SIMPLE_PINHOLE";
    fs::create_directories(photos_);
    for (int i = kFirst; i < kFirst + kPhotos; ++i) {
      inputs_.push_back(truth_.inputs[static_cast<size_t>(i)]);
      fs::copy_file(kPlaza / "images" / inputs_.back().name, photos_ / inputs_.back().name);
    }
  }

  SfmResult Run(const std::string& folder) {
    return RunSfm(photos_, inputs_, folder_ / folder, options_, listener_);
  }

  void AddNoise(const std::string& name) {
    WriteNoise(photos_ / name, 7);
    inputs_.push_back({name, 320, 240, {}, "noise"});
  }

  void AddQuilt(const std::string& name) {
    std::array<fs::path, 4> parts;
    for (size_t i = 0; i < parts.size(); ++i) parts[i] = photos_ / inputs_[i].name;
    WriteQuilt(parts, photos_ / name);
    inputs_.push_back(inputs_.front());
    inputs_.back().name = name;
  }

  // What the fake mapper leaves, under the names that COLMAP knows.
  void Leave(calib::SfmModel model) {
    std::vector<std::string> names;
    for (const SfmImageInput& input : inputs_) names.push_back(input.name);
    std::sort(names.begin(), names.end());
    for (calib::SfmImage& image : model.images) {
      const auto at = std::find(names.begin(), names.end(), image.name) - names.begin();
      image.name = Workspace::AliasFor("", static_cast<size_t>(at), image.name);
    }
    fs::remove_all(fake_ / "model.0");
    WriteModel(fake_ / "model.0", model, Format::kBinary);
  }

  bool MapperRan() const {
    const auto calls = fake_.Calls();
    return std::any_of(calls.begin(), calls.end(),
                       [](const std::string& call) { return call.starts_with("mapper"); });
  }

  double WorstDegrees(const calib::SfmModel& model) const {
    double worst = 0;
    const calib::SfmImage& first = model.images.front();
    for (const calib::SfmImage& image : model.images) {
      worst = std::max(
          worst, DegreesBetween(image.cam_from_world, first.cam_from_world,
                                truth_.CamFromWorld(image.name), truth_.CamFromWorld(first.name)));
    }
    return worst;
  }

  Truth truth_;
  std::vector<SfmImageInput> inputs_;
  SfmOptions options_;
  Listener listener_;
  FakeColmap fake_;
  const dtr::testing::TemporaryFolder folder_;
  const fs::path photos_ = folder_ / "photos";
};

TEST_F(AutoSfm, AModelOfTheGlobalMapperThatPassesIsTakenWithoutAskingColmap) {
  const SfmResult sfm = Run("sfm");
  EXPECT_EQ(sfm.model.images.size(), size_t{kPhotos});
  EXPECT_FALSE(MapperRan());
  EXPECT_THAT(sfm.report.version, Not(HasSubstr("COLMAP's mapper")));
  EXPECT_LT(WorstDegrees(sfm.model), kRotationDeg);
}

TEST_F(AutoSfm, ColmapsModelIsTakenWhereOursDoesNotPassAndTheMatchesAgreeWithIt) {
  options_.engine = SfmEngine::kGlobal;
  const calib::SfmModel right = Run("right").model;
  options_.engine = SfmEngine::kAuto;
  options_.lens_model = "FULL_OPENCV";  // which the global mapper does not adjust
  Leave(right);
  const SfmResult sfm = Run("sfm");
  EXPECT_TRUE(MapperRan());
  EXPECT_EQ(sfm.model.images.size(), size_t{kPhotos});
  EXPECT_THAT(sfm.report.version, HasSubstr("COLMAP's mapper"));
  EXPECT_THAT(listener_.notes, Contains(HasSubstr("are not supported; trying COLMAP's mapper")));
  EXPECT_THAT(listener_.notes, Contains(HasSubstr("COLMAP's model is taken")));
  // A second call has the reason and the mapper from its checkpoint.
  EXPECT_THAT(Run("sfm").report.version, HasSubstr("COLMAP's mapper"));

  calib::SfmModel wrong = right;
  std::swap(wrong.images[0].cam_from_world, wrong.images[2].cam_from_world);
  Leave(wrong);
  // Nothing better is there: it is given, with what speaks against it.
  const SfmResult doubted = Run("wrong");
  EXPECT_THAT(doubted.report.doubt, HasSubstr("contradict"));
  EXPECT_THAT(doubted.report.version, HasSubstr("COLMAP's mapper"));
  EXPECT_THAT(listener_.notes, Contains(HasSubstr("is not sure of these cameras")));
}

TEST_F(AutoSfm, APhotoThatNeitherPlacesIsNamedAndOurModelTaken) {
  options_.engine = SfmEngine::kGlobal;
  const calib::SfmModel right = Run("right").model;
  options_.engine = SfmEngine::kAuto;
  AddQuilt("z.png");
  Leave(right);
  const SfmResult sfm = Run("sfm");
  EXPECT_TRUE(MapperRan());
  EXPECT_THAT(listener_.notes, Contains(HasSubstr("1 of 5 photos have no camera")));
  EXPECT_THAT(listener_.notes, Contains("the global mapper's model is taken"));
  EXPECT_THAT(sfm.report.version, Not(HasSubstr("COLMAP's mapper")));
  EXPECT_EQ(sfm.report.not_registered, std::vector<std::string>{"z.png"});
  EXPECT_THAT(sfm.report.why_not_registered.at("z.png"), HasSubstr("matches"));
}

TEST_F(AutoSfm, ColmapIsNotAskedForAPhotoThatMatchesNothing) {
  AddNoise("z.png");
  const SfmResult sfm = Run("sfm");
  EXPECT_FALSE(MapperRan());
  EXPECT_EQ(sfm.report.not_registered, std::vector<std::string>{"z.png"});
}

TEST_F(AutoSfm, AFailureOfColmapDoesNotLoseOurModel) {
  AddQuilt("z.png");
  fake_.Fail("mapper", "echo 'out of luck'; exit 1");
  const SfmResult sfm = Run("sfm");
  EXPECT_EQ(sfm.model.images.size(), size_t{kPhotos});
  EXPECT_THAT(listener_.notes, Contains(StartsWith("COLMAP's mapper failed:")));
}

// A program of that name that does not work, such as one whose libraries are gone.
TEST_F(AutoSfm, AColmapThatDoesNotWorkIsOneNote) {
  fake_.Break();
  EXPECT_EQ(Run("whole").model.images.size(), size_t{kPhotos});
  EXPECT_THAT(listener_.notes, Not(Contains(HasSubstr("COLMAP"))));
  AddQuilt("z.png");
  EXPECT_EQ(Run("sfm").model.images.size(), size_t{kPhotos});
  const auto says = [](const std::string& note) {
    return note.find("with COLMAP in working order (") != std::string::npos;
  };
  EXPECT_EQ(std::count_if(listener_.notes.begin(), listener_.notes.end(), says), 1);
}

TEST_F(AutoSfm, WhereNeitherMapsThePhotosTheReasonIsOneLine) {
  inputs_.clear();
  for (const char* name : {"a.png", "b.png"}) {
    WriteNoise(photos_ / name, static_cast<unsigned>(name[0]));
    inputs_.push_back({name, 320, 240, {}, "noise"});
  }
  const std::string message = dtr::testing::MessageOf<Error>([&] { Run("sfm"); });
  EXPECT_THAT(message, Not(IsEmpty()));
  EXPECT_THAT(message, Not(HasSubstr("\n")));
}

TEST_F(AutoSfm, KnownIntrinsicsHoldInTheGlobalMapper) {
  options_.engine = SfmEngine::kGlobal;
  Run("sfm");
  const auto fixed = MapWithFixedIntrinsics(photos_, inputs_, folder_ / "sfm", options_, listener_);
  ASSERT_TRUE(fixed);
  EXPECT_TRUE(fixed->report.fixed_intrinsics);
  EXPECT_EQ(fixed->model.images.size(), size_t{kPhotos});
  EXPECT_LT(WorstDegrees(fixed->model), kRotationDeg);
  for (const auto& [id, camera] : fixed->model.cameras) {
    EXPECT_EQ(camera.params[0], *inputs_.front().focal_prior_px);
  }
}

// Any focal length fits photos from one line with parallel axes.
TEST_F(AutoSfm, AStraightWalkIsMappedWithExifsFocalLength) {
  const auto sets = datasets::HardSets();
  auto walk = std::find_if(sets.begin(), sets.end(),
                           [](const auto& set) { return set.name == "straight_walk"; });
  ASSERT_NE(walk, sets.end());
  datasets::WriteHardSet(*walk, folder_ / "walk");
  inputs_.clear();
  const auto truth = io::ReadCamerasJson(folder_ / "walk" / "cameras.json").cameras;
  for (const auto& camera : truth) {
    inputs_.push_back({camera.name, camera.camera.width_px(), camera.camera.height_px(),
                       camera.camera.fx_px(), "camera"});
  }
  options_.lens_model = "SIMPLE_RADIAL";
  const SfmResult sfm =
      RunSfm(folder_ / "walk" / "photos", inputs_, folder_ / "sfm", options_, listener_);
  EXPECT_FALSE(MapperRan());
  EXPECT_TRUE(sfm.report.fixed_intrinsics);
  EXPECT_EQ(sfm.model.images.size(), truth.size());
  EXPECT_EQ(sfm.model.cameras.begin()->second.params[0], truth[0].camera.fx_px());
  EXPECT_THAT(listener_.notes, Contains(HasSubstr("EXIF's focal length is held")));
  for (size_t i = 0; i < sfm.model.images.size(); ++i) {
    EXPECT_LT(DegreesBetween(sfm.model.images[i].cam_from_world, sfm.model.images[0].cam_from_world,
                             truth[i].cam_from_world, truth[0].cam_from_world),
              0.1);
  }
}

TEST_F(AutoSfm, NoPointLiesUnderAMask) {
  options_.engine = SfmEngine::kGlobal;
  const int width = inputs_.front().width_px, height = inputs_.front().height_px;
  Mask mask(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) mask(x, y) = x < width / 4 ? 0 : 255;
  }
  io::WriteMask(folder_ / "mask.png", mask);
  for (SfmImageInput& input : inputs_) input.mask_file = folder_ / "mask.png";
  const SfmResult sfm = Run("sfm");
  EXPECT_EQ(sfm.model.images.size(), size_t{kPhotos});
  for (const calib::SfmImage& image : sfm.model.images) {
    for (const calib::SfmFeature& feature : image.features) {
      EXPECT_GE(feature.pixel.x(), width / 4);
    }
  }
}

TEST_F(AutoSfm, SequentialPairsGiveAModel) {
  options_.engine = SfmEngine::kGlobal;
  options_.matching = Matching::kSequential;
  const SfmResult sfm = Run("sfm");
  EXPECT_EQ(sfm.report.matching, Matching::kSequential);
  EXPECT_LT(WorstDegrees(sfm.model), kRotationDeg);
}

TEST_F(AutoSfm, ARunStoppedWhileMatchingGoesOnToTheSameModel) {
  options_.engine = SfmEngine::kGlobal;
  const calib::SfmModel whole = Run("whole").model;
  for (const char* stage : {"features", "matching", "mapping"}) {
    listener_.stop_at = stage;
    EXPECT_THROW(Run(stage), Interrupted) << stage;
    listener_.stop_at = "";
    listener_.stop = false;
    ExpectSame(whole, Run(stage).model);
  }
}

}  // namespace
}  // namespace dtr::colmap
