// Decisions on small exact scenes where it is known what is needed.
#include "dtr/prune/prune.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "datasets/exact/analytic_scene.h"
#include "dtr/base/error.h"
#include "dtr/cpu/renderer.h"
#include "dtr/prune/probes.h"
#include "dtr/render/scene.h"
#include "tests/support/on_threads.h"

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
      EXPECT_GT((center - view.CenterInWorld()).norm(), 1e-3) << "no novel position";
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

// Renderings that equal the photo, and photos without a pixel to compare, lose a finite amount.
TEST(Errors, OfEqualImagesAndOfNoPixelsAreFinite) {
  const ImageRgb8 photo(4, 4, 3, 100);
  for (const bool masked : {false, true}) {
    const std::vector<Place> places = {{{}, photo, masked ? Mask(4, 4) : Mask(), {}}};
    const Errors same = CompareWithPhotos(places, std::vector{photo}, std::vector{photo});
    EXPECT_EQ(same.psnr_loss_db, 0);
    EXPECT_EQ(same.NewErrorShare(), 1);
    const Errors worse =
        CompareWithPhotos(places, std::vector{photo}, std::vector{ImageRgb8(4, 4, 3, 101)});
    EXPECT_TRUE(std::isfinite(worse.psnr_loss_db));
    EXPECT_EQ(worse.psnr_loss_db > 0, !masked);
    const std::vector<double> some = {1.0}, none = {0.0};
    EXPECT_TRUE(std::isfinite(LossesDb(some, none, same)[0]));
  }
}

TEST(Errors, TellNewErrorFromOneThatTakesAnothersPlace) {
  // The photo is 100; before, images are 103 everywhere.
  const std::vector<Place> places = {{{}, ImageRgb8(4, 4, 3, 100), {}, {}}};
  const std::vector<ImageRgb8> before = {ImageRgb8(4, 4, 3, 103)};
  // 97 is just as wrong as 103, so nothing is lost however far the two are apart.
  const Errors swapped = CompareWithPhotos(places, before, std::vector{ImageRgb8(4, 4, 3, 97)});
  EXPECT_EQ(swapped.before, 9);
  EXPECT_EQ(swapped.after, 9);
  EXPECT_EQ(swapped.change, 36);
  EXPECT_EQ(swapped.psnr_loss_db, 0);
  EXPECT_EQ(swapped.NewErrorShare(), kMinShare);
  // 106 is four times as wrong: 6.02 dB.
  const Errors worse = CompareWithPhotos(places, before, std::vector{ImageRgb8(4, 4, 3, 106)});
  EXPECT_NEAR(worse.psnr_loss_db, 10 * std::log10(4.0), 1e-12);
  EXPECT_EQ(worse.NewErrorShare(), 27.0 / 9);
  // From a place without a photo: a difference of 9, three times that is new error, on top of 9.
  const std::vector<ImageRgb8> a = {before[0], before[0]}, b = {before[0], ImageRgb8(4, 4, 3, 106)};
  const std::vector<Place> novel(2);
  const std::vector<double> none = {0, 0};
  EXPECT_EQ(MeanOf(LossesDb(Changes(novel, a, a), none, worse)), 0);
  const std::vector<double> losses_db = LossesDb(Changes(novel, a, b), none, worse);
  EXPECT_NEAR(MeanOf(losses_db), 0.5 * 10 * std::log10(4.0), 1e-12);
  // Two values x and 0 have the standard deviation x / sqrt(2), their mean x / 2.
  EXPECT_NEAR(StandardError(losses_db), 0.5 * 10 * std::log10(4.0), 1e-12);
  EXPECT_EQ(StandardError(std::span(losses_db).first(1)), 0);
  // What is there no more counts whole, whatever photos say: 27 on top of 9, once.
  const std::vector<double> gone = LossesDb(none, std::vector<double>{27, 0}, worse);
  EXPECT_NEAR(gone[0], 10 * std::log10(4.0), 1e-12);
  EXPECT_EQ(gone[1], 0);
  const Check lucky{0.05, 0.06, 0.01, 0.02, std::nullopt, 30};
  EXPECT_FALSE(lucky.Holds(0.1));
  EXPECT_FALSE(lucky.Holds(0.16));
  EXPECT_TRUE(lucky.Holds(0.18));
  const Check scattered{0.01, 0.01, 0.05, 0.06, std::nullopt, std::nullopt, 30};
  EXPECT_FALSE(scattered.Holds(0.1));
  EXPECT_TRUE(scattered.Holds(0.12));
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
    EXPECT_FALSE(report.photo_frame_loss_db);
    EXPECT_GT(report.error_db, 10) << "PSNR before";
    EXPECT_LT(report.error_db, 60);
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
  const auto pictures = Images(set, {}, std::span(places).first(1), {}, &cpu::Render);
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
  ASSERT_TRUE(report.photo_frame_loss_db);
  EXPECT_LT(std::abs(*report.photo_frame_loss_db), 5);
  EXPECT_EQ(report.loss_db(), other.loss_db());
  EXPECT_EQ(report.setting.without, other.setting.without);
  EXPECT_EQ(report.setting.coding, other.setting.coding);
  EXPECT_THAT(report.setting.without, Not(Contains(photo.id)));
  EXPECT_LE(report.setting.without.size(), kViews - 1 - 2u);
}

TEST(Prune, DecidesTheSameForAnyNumberOfThreads) {
  DtrSet set = Row(4);
  PruneOptions options = SmallOptions(0.5);
  std::optional<ThreadLimit> limit;
  limit.emplace(1);
  const PruneReport one = PruneWith(set, options);
  limit.emplace(3);
  const PruneReport three = PruneWith(set, options);
  EXPECT_EQ(one.setting.without, three.setting.without);
  EXPECT_EQ(one.setting.coding, three.setting.coding);
  EXPECT_EQ(one.loss_db(), three.loss_db());
}

/// Keeps numbers in memory; stands for a run that is killed after so many new ones.
class Notes : public Journal {
 public:
  explicit Notes(int left) : left_(left) {}
  std::optional<std::vector<double>> Find(const std::string& name, size_t) const override {
    const auto found = numbers.find(name);
    return found == numbers.end() ? std::nullopt : std::optional(found->second);
  }
  void Add(const std::string& name, const std::vector<double>& added) override {
    if (left_-- == 0) throw Error("killed");
    EXPECT_TRUE(numbers.emplace(name, added).second) << name << " measured twice";
  }
  void Allow(int more) { left_ = more; }
  std::map<std::string, std::vector<double>> numbers;

 private:
  int left_;
};

TEST(Prune, EveryCauseOfLossIsLogged) {
  DtrSet set = Row(6);
  for (View& view : set.frames[0].views) view.sigma_file = StoredFile{"s", "", 5000};
  const PruneOptions options = SmallOptions(100);  // everything goes, and nothing is put back
  const PruneReport report = PruneWith(set, options);
  std::map<std::string, int> logged;
  for (const Removal& removal : report.removed) ++logged[removal.kind];
  const Setting& setting = report.setting;
  const Coding usual;
  EXPECT_EQ(logged["sigma"] > 0, !setting.coding.sigma);
  EXPECT_EQ(static_cast<size_t>(logged["view"]), setting.without.size());
  EXPECT_EQ(logged["views-used"] > 0, setting.render.views != options.render.views);
  EXPECT_EQ(logged["resolution"] > 0, setting.render.resolution != options.render.resolution);
  EXPECT_EQ(logged["images"] > 0, setting.coding.jpeg_quality != usual.jpeg_quality);
  EXPECT_EQ(logged["depth"] > 0, setting.coding.depth_error_px != usual.depth_error_px);
  EXPECT_EQ(logged["size"] > 0, setting.coding.shrink != usual.shrink);
  EXPECT_EQ(logged["mesh"] > 0, setting.coding.mesh_tolerance_px != usual.mesh_tolerance_px);
  if (!setting.coding.tiles.empty()) {
    EXPECT_GT(logged["tiles"], 0);
  }
  // And nothing else is changed: with the logged fields put back, drawing is as it was.
  RenderOptions render = setting.render;
  render.views = options.render.views, render.resolution = options.render.resolution;
  render.mesh_tolerance_px = options.render.mesh_tolerance_px;
  EXPECT_EQ(render, options.render);
  EXPECT_GE(logged.size(), 4u) << "too little was left out to tell anything";

  // What the steps are said to have cost is what their sum costs.
  ASSERT_THAT(report.put_back, IsEmpty());
  double sum_db = 0;
  for (const Removal& removal : report.removed) sum_db += removal.loss_db;
  FakeStore store(set);
  SilentProgress progress;
  Mover mover(set);
  Notes notes(100);
  const CodeFunction code = std::ref(store);
  const RendererMaker make = [] { return &cpu::Render; };
  Measurer measurer(
      set, {options.probes, options.checks, options.probe_crop, options.seed, 0, options.render},
      code, make, mover, notes, progress);
  EXPECT_NEAR(measurer.Measure(setting).loss_db, sum_db, 1e-9);
  EXPECT_NEAR(report.decided_loss_db, sum_db, 1e-12);
}

/// As if from elsewhere any JPEG lost 100 dB; all else is measured.
class JpegFailsTheCheck : public Notes {
 public:
  using Notes::Notes;
  std::optional<std::vector<double>> Find(const std::string& name, size_t least) const override {
    // "check IDS QUALITY ..." (KeyOf)
    std::istringstream words(name.starts_with("check ") ? name.substr(name.find(' ', 6)) : "0");
    int quality = 0;
    words >> quality;
    return quality > 0 ? std::optional(std::vector<double>{100, 0}) : Notes::Find(name, least);
  }
};

class CountsMeasuring : public Progress {
 public:
  void Update(int) override {}
  void Note(const std::string&) override {}
  void Stage(const std::string& name, int) override { passes += name.starts_with("measuring"); }
  int passes = 0;
};

TEST(Prune, WhatACheckTakesBackStaysOutAndLeavesRoomForOthers) {
  const DtrSet set = Row(6);
  PruneOptions options = SmallOptions(15);  // as much as it takes for JPEG to be worth a step
  JpegFailsTheCheck journal(100000);
  options.journal = &journal;
  FakeStore store(set);
  CountsMeasuring progress;
  const CodeFunction code = std::ref(store);
  const RendererMaker make = [] { return &cpu::Render; };
  const PruneReport report = Prune(set, options, code, make, progress);
  EXPECT_GE(progress.passes, 2);
  EXPECT_EQ(report.setting.coding.jpeg_quality, 0);
  ASSERT_FALSE(report.put_back.empty());
  std::set<std::string> once;
  for (const Removal& removal : report.put_back) {
    EXPECT_TRUE(once.insert(removal.kind + removal.what).second)
        << removal.what << " was decided again after a check took it back";
  }
  EXPECT_TRUE(once.contains("imagesJPEG quality 98"));
  ASSERT_FALSE(report.removed.empty());
  for (const Removal& removal : report.removed) EXPECT_NE(removal.kind, "images");
  // What is said to have been decided is what the result loses, not what was taken back.
  Mover mover(set);
  Measurer measurer(
      set, {options.probes, options.checks, options.probe_crop, options.seed, 0, options.render},
      code, make, mover, journal, progress);
  EXPECT_DOUBLE_EQ(report.decided_loss_db, measurer.Measure(report.setting).loss_db);
  double sum_db = 0;
  for (const Removal& removal : report.removed) sum_db += removal.loss_db;
  EXPECT_NEAR(report.decided_loss_db, sum_db, 1e-9);
  EXPECT_LE(report.loss_db(), options.max_loss_db);
}

TEST(Prune, GoesOnFromWhatAnInterruptedRunMeasured) {
  const DtrSet set = Row(5);
  PruneOptions options = SmallOptions(1);
  const PruneReport whole = PruneWith(set, options);
  constexpr int kMany = 100000;
  Notes notes(12);
  options.journal = &notes;
  EXPECT_THROW(PruneWith(set, options), Error);
  EXPECT_EQ(notes.numbers.size(), 12u);
  notes.Allow(kMany);
  const PruneReport resumed = PruneWith(set, options);
  EXPECT_EQ(resumed.setting.without, whole.setting.without);
  EXPECT_EQ(resumed.setting.coding, whole.setting.coding);
  EXPECT_EQ(resumed.setting.render, whole.setting.render);
  EXPECT_EQ(resumed.loss_db(), whole.loss_db());
  EXPECT_EQ(resumed.removed.size(), whole.removed.size());
  // All of it again: nothing is drawn.
  notes.Allow(0);
  FakeStore store(set);
  SilentProgress progress;
  const PruneReport again = Prune(
      set, options, std::ref(store), [] { return &cpu::Render; }, progress);
  EXPECT_EQ(again.loss_db(), whole.loss_db());
  EXPECT_EQ(store.calls, 0);
}

TEST(Prune, StopsWhereEnoughIsLeftOut) {
  const DtrSet set = Row(5);
  PruneOptions options = SmallOptions(20);
  options.probes = options.checks = 2;
  const size_t all = PruneWith(set, options).removed.size();
  options.enough_bytes = 0.6 * 5 * 12000;
  const PruneReport small = PruneWith(set, options);
  double left = 1;
  for (const Removal& removal : small.removed) {
    EXPECT_GT(left, 0.6) << "one step more than was needed: " << removal.kind;
    left *= 1 - removal.bytes_share;
  }
  EXPECT_LE(left, 0.6);
  EXPECT_LT(small.removed.size(), all);
  options.enough_bytes.reset();
  options.enough_frame_share = 0.6;
  left = 1;
  for (const Removal& removal : PruneWith(set, options).removed) left *= 1 - removal.frame_share;
  EXPECT_LE(left, 0.6);
}

TEST(Prune, RejectsOptionsWithoutAMeaning) {
  const DtrSet set = Row(3);
  EXPECT_THROW(PruneWith(set, SmallOptions(-1)), UsageError);
  EXPECT_THROW(PruneWith(set, SmallOptions(std::nan(""))), UsageError);
  PruneOptions options = SmallOptions(1);
  options.checks = 0;
  EXPECT_THROW(PruneWith(set, options), UsageError);
}

}  // namespace
}  // namespace dtr::prune
