// Decisions on small exact scenes where it is known what is needed.
#include "dtr/prune/prune.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "datasets/exact/analytic_scene.h"
#include "dtr/base/error.h"
#include "dtr/cpu/renderer.h"
#include "dtr/prune/probes.h"
#include "dtr/render/scene.h"

namespace dtr::prune {
namespace {

using ::testing::Contains;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr int kViews = 6;

/// Cameras in a row before a slanted plane and a sphere; every view sees nearly everything.
DtrSet Row(int views = kViews) {
  const auto surface =
      testing::Union(testing::Plane({0, 0, -1}, -6), testing::Sphere({0, 0, 4.5}, 0.7));
  DtrSet set;
  set.scene_center = {0, 0, 5};
  set.frames.resize(1);
  for (int i = 0; i < views; ++i) {
    const double x = 0.25 * (i - 0.5 * (views - 1));
    testing::Shot shot;
    shot.id = std::string("view") + static_cast<char>('a' + i);
    shot.cam_from_world = testing::LookAt({x, 0, 0}, {0, 0, 5});
    View view = testing::Photograph(surface, shot);
    view.reference_baseline = 0.4;
    view.near_z = 3, view.far_z = 8;
    view.image_file = StoredFile{"images/" + shot.id + ".png", "", 10000};
    view.depth_file = StoredFile{"depth/" + shot.id + ".png", "", 6000};
    set.frames[0].views.push_back(std::move(view));
  }
  return set;
}

/// Bytes by rule, pixels as bad as the coding says: JPEG adds a pattern of its own, depth errors
/// move every depth. Counts how often it was asked.
class FakeStore {
 public:
  explicit FakeStore(const DtrSet& set) : set_(set) {}
  CodedSet operator()(const Coding& coding) {
    ++calls;
    CodedSet coded{set_, {}};
    for (View& view : coded.set.frames[0].views) {
      if (view.role != ViewRole::kSource) {
        coded.bytes.push_back(0);
        continue;
      }
      if (coding.shrink > 1) view = ShrunkView(view, coding.shrink);
      std::uint64_t bytes = 6000;
      if (coding.jpeg_quality > 0) {
        bytes = 60 * static_cast<std::uint64_t>(coding.jpeg_quality);
        const int amount = (100 - coding.jpeg_quality) / 2;
        for (size_t i = 0; i < view.image.data().size(); i += 2) {
          auto& value = view.image.data()[i];
          value = static_cast<std::uint8_t>(std::min(255, value + amount));
        }
      }
      if (coding.depth_error_px > 0) {
        bytes += 1000;
        const double error = coding.depth_error_px * ThresholdsOf(view, {}).pixel;
        for (float& z : view.depth.grid().data()) {
          if (!DepthImage::IsHole(z)) z = static_cast<float>(1 / (1.0 / z + error));
        }
      } else {
        bytes += 6000;
      }
      if (coding.sigma && view.sigma_file) bytes += view.sigma_file->bytes;
      coded.bytes.push_back(bytes / static_cast<std::uint64_t>(coding.shrink * coding.shrink));
    }
    return coded;
  }
  int calls = 0;

 private:
  const DtrSet& set_;
};

PruneOptions SmallOptions(double max_loss_db) {
  PruneOptions options;
  options.max_loss_db = max_loss_db;
  options.probes = 4;
  options.checks = 3;
  return options;
}

PruneReport PruneWith(const DtrSet& set, const PruneOptions& options) {
  FakeStore store(set);
  SilentProgress progress;
  return Prune(
      set, options, std::ref(store), [] { return &cpu::Render; }, progress);
}

TEST(DrawProbes, LiesBetweenTwoCamerasAndDoesNotDependOnTheirOrder) {
  DtrSet set = Row();
  const auto probes = DrawProbes(set, 6, 7);
  ASSERT_EQ(probes.size(), 6u);
  for (const NovelCamera& novel : probes) {
    const Eigen::Vector3d center = novel.cam_from_world.TargetOriginInSource();
    EXPECT_NEAR(center.y(), 0, 1e-12);
    EXPECT_LT(std::abs(center.x()), 0.25 * 0.5 * (kViews - 1));
    for (const View& view : set.frames[0].views) {
      EXPECT_GT((center - view.CenterInWorld()).norm(), 1e-3) << "no novel place";
    }
  }
  std::reverse(set.frames[0].views.begin(), set.frames[0].views.end());
  const auto again = DrawProbes(set, 6, 7);
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(again[i].cam_from_world.translation, probes[i].cam_from_world.translation);
  }
  EXPECT_NE(DrawProbes(set, 6, 8)[0].cam_from_world.translation,
            probes[0].cam_from_world.translation);
  EXPECT_THROW(DrawProbes(Row(1), 1, 0), Error);
}

TEST(Errors, TellNewErrorFromOneThatTakesAnothersPlace) {
  // The photo is 100; before, pictures are 103 everywhere.
  const std::vector<Place> places = {{{}, ImageRgb8(4, 4, 3, 100), {}, {}}};
  const std::vector<ImageRgb8> before = {ImageRgb8(4, 4, 3, 103)};
  // 97 is as wrong as 103, so nothing is lost however far the two are apart.
  const Errors swapped = CompareWithPhotos(places, before, std::vector{ImageRgb8(4, 4, 3, 97)});
  EXPECT_EQ(swapped.before, 9);
  EXPECT_EQ(swapped.after, 9);
  EXPECT_EQ(swapped.change, 36);
  EXPECT_EQ(swapped.psnr_loss_db, 0);
  EXPECT_EQ(swapped.NewErrorShare(), kLeastShare);
  // 106 is four times as wrong: 6.02 dB.
  const Errors worse = CompareWithPhotos(places, before, std::vector{ImageRgb8(4, 4, 3, 106)});
  EXPECT_NEAR(worse.psnr_loss_db, 10 * std::log10(4.0), 1e-12);
  EXPECT_EQ(worse.NewErrorShare(), 27.0 / 9);
  // From a place without a photo: a difference of 9, three times that is new error, on top of 9.
  const std::vector<ImageRgb8> a = {before[0], before[0]}, b = {before[0], ImageRgb8(4, 4, 3, 106)};
  EXPECT_EQ(LossDb(a, a, worse), 0);
  EXPECT_NEAR(LossDb(a, b, worse), 0.5 * 10 * std::log10(4.0), 1e-12);
}

TEST(Prune, AllowedNoLossLeavesOutOnlyWhatNobodySees) {
  DtrSet set = Row();
  for (View& view : set.frames[0].views) view.sigma_file = StoredFile{"s", "", 5000};
  PruneOptions options = SmallOptions(0);
  const PruneReport report = PruneWith(set, options);
  EXPECT_EQ(report.loss_db(), 0);
  EXPECT_FALSE(report.setting.coding.sigma);
  ASSERT_FALSE(report.removed.empty());
  EXPECT_EQ(report.removed[0].kind, "sigma");
  EXPECT_EQ(report.setting.coding.jpeg_quality, 0);
  EXPECT_EQ(report.setting.coding.depth_error_px, 0);
}

TEST(Prune, KeepsItsPromiseAndSavesMoreWhereMoreIsAllowed) {
  const DtrSet set = Row(10);
  double saved_before = 0;
  for (const double allowed_db : {0.1, 4.0}) {
    const PruneReport report = PruneWith(set, SmallOptions(allowed_db));
    EXPECT_LE(report.loss_db(), allowed_db);
    EXPECT_FALSE(report.photo_loss_db);
    double share = 1;
    for (const Removal& removal : report.removed) share *= 1 - removal.bytes_share;
    double frames = 1;
    for (const Removal& removal : report.removed) frames *= 1 - removal.frame_share;
    const double saved = -std::log(share * frames);
    EXPECT_GE(saved, saved_before) << allowed_db;
    saved_before = saved;
  }
  // Ten views in a row are few to take any from: what goes is told by photos that did not decide.
  EXPECT_GT(saved_before, std::log(4.0));
}

TEST(LeftOutPlaces, AreSeenWithoutTheViewAndItsCopies) {
  DtrSet set = Row(4);
  View copy = set.frames[0].views[1];
  copy.id = copy.name = "copy";
  copy.image.data()[0] ^= 1;
  set.frames[0].views.push_back(copy);
  const auto places = LeftOutPlaces(set, 10, 2);
  ASSERT_EQ(places.size(), 5u);
  EXPECT_THAT(places[0].left_out, ::testing::UnorderedElementsAre("copy", "viewb"));
  EXPECT_THAT(places[1].left_out, ::testing::ElementsAre("viewa"));
  EXPECT_EQ(places[1].photo.width(), 48);
  // The second place's window is the right upper quarter: the same pixels, seen by the same rays.
  const View& view = set.frames[0].views[0];
  EXPECT_EQ(places[1].photo(3, 5, 1), view.image(48 + 3, 5, 1));
  const Eigen::Vector3d ray = places[1].novel.camera.RayFromPixel({3.5, 5.5});
  EXPECT_NEAR((ray - view.camera.RayFromPixel({51.5, 5.5})).norm(), 0, 1e-12);
  const auto pictures = Pictures(set, {}, std::span(places).first(1), {}, &cpu::Render);
  EXPECT_NE(pictures[0], places[0].photo);
}

TEST(Prune, HeldOutPhotosAreToldOfAndDecideNothing) {
  DtrSet set = Row();
  View& photo = set.frames[0].views[2];
  photo.role = ViewRole::kHeldOut;
  photo.depth = {};
  photo.depth_file.reset();
  const PruneReport report = PruneWith(set, SmallOptions(2));
  ASSERT_TRUE(report.photo_loss_db);
  for (auto& value : photo.image.data()) value = static_cast<std::uint8_t>(255 - value);
  const PruneReport other = PruneWith(set, SmallOptions(2));
  EXPECT_NE(*report.photo_loss_db, *other.photo_loss_db);
  EXPECT_EQ(report.loss_db(), other.loss_db());
  EXPECT_EQ(report.setting.without, other.setting.without);
  EXPECT_EQ(report.setting.coding, other.setting.coding);
  EXPECT_THAT(report.setting.without, Not(Contains(photo.id)));
  EXPECT_LE(report.setting.without.size(), kViews - 1 - 2u);
}

TEST(Prune, DecidesTheSameForAnyNumberOfThreads) {
  DtrSet set = Row(4);
  PruneOptions options = SmallOptions(0.5);
  options.render.threads = 1;
  const PruneReport one = PruneWith(set, options);
  options.render.threads = 3;
  const PruneReport three = PruneWith(set, options);
  EXPECT_EQ(one.setting.without, three.setting.without);
  EXPECT_EQ(one.setting.coding, three.setting.coding);
  EXPECT_EQ(one.loss_db(), three.loss_db());
}

TEST(Prune, RefusesOptionsWithoutAMeaning) {
  const DtrSet set = Row(3);
  EXPECT_THROW(PruneWith(set, SmallOptions(-1)), UsageError);
  EXPECT_THROW(PruneWith(set, SmallOptions(std::nan(""))), UsageError);
  PruneOptions options = SmallOptions(1);
  options.checks = 0;
  EXPECT_THROW(PruneWith(set, options), UsageError);
}

}  // namespace
}  // namespace dtr::prune
