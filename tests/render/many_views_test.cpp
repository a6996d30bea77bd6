// Work on sets of many views grows in proportion to their number, not to that of their pairs. The
// sources under test are compiled into this program once more, so that their steps are counted.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "datasets/exact/analytic_scene.h"
#include "dtr/io/json_fields.h"
#include "dtr/io/set_io.h"
#include "dtr/io/set_json.h"
#include "dtr/render/frame.h"
#include "dtr/render/geometry.h"
#include "dtr/render/view_stream.h"
#include "dtr/render/views_within_room.h"
#include "tests/support/count_steps.h"

namespace dtr {
namespace {

using namespace dtr::testing;

constexpr int kFew = 1000, kMany = 8 * kFew;
// n log n grows 10.4 times from kFew to kMany, n^2 64 times.
constexpr double kMaxGrowth = 13;
const Eigen::Vector3d kCentre(0, 0, 0);

/// Views evenly on a sphere about the scene centre, all looking there, of one pixel.
DtrSet Sphere(int count) {
  DtrSet set;
  set.scene_center = kCentre;
  set.frames.resize(1);
  for (int i = 0; i < count; ++i) {
    const double z = 2 * (i + 0.5) / count - 1,
                 around = i * std::numbers::phi * 2 * std::numbers::pi;
    const double radius = 10 * std::sqrt(1 - z * z);
    View view;
    view.id = std::to_string(kMany + i);
    view.name = view.id + ".png";
    view.camera = PinholeCamera(1, 1, 1, 1, 0.5, 0.5);
    view.cam_from_world =
        LookAt({radius * std::cos(around), radius * std::sin(around), 10 * z}, kCentre);
    view.image_file = StoredFile{"images/all.png", std::string(64, 'a'), 1};
    view.reference_baseline = 1;
    set.frames[0].views.push_back(view);
  }
  return set;
}

void GivePixels(View& view) {
  view.image = ImageRgb8(1, 1, 3);
  view.depth = DepthImage(1, 1);
}

/// `work(n)` prepares work on n views and returns the steps that it took.
template <typename Work>
void ExpectNearLinear(const Work& work) {
  const std::uint64_t few = work(kFew), many = work(kMany);
  EXPECT_GT(few, std::uint64_t{kFew}) << "this is not counted";
  EXPECT_LT(static_cast<double>(many), kMaxGrowth * static_cast<double>(few));
}

RenderOptions AllViews() {
  RenderOptions options;
  options.views = 1 << 20;
  return options;
}

/// A camera behind which the scene centre lies: all views are drawn from (SPEC 1.3).
Pose Outwards(double x) { return LookAt({x, 20, 0}, {x, 40, 0}); }

TEST(ManyViews, ParsingJson) {
  ExpectNearLinear([](int count) {
    std::string text = "[{}";
    for (int i = 1; i < count; ++i) text += ",{}";
    text += "]";
    return StepsOf([&] { io::ParseJson(text, "text"); });
  });
}

TEST(ManyViews, WritingAndReadingADescription) {
  ExpectNearLinear([](int count) {
    const DtrSet set = Sphere(count);
    return StepsOf([&] { io::JsonFromSet(set, "set.json"); });
  });
}

TEST(ManyViews, LookingForDuplicates) {
  ExpectNearLinear([](int count) {  // of one image
    DtrSet set = Sphere(count);
    return StepsOf([&] { EXPECT_TRUE(io::CollapseDuplicates(set).empty()); });
  });
  ExpectNearLinear([](int count) {  // from one position
    DtrSet set = Sphere(count);
    for (View& view : set.frames[0].views) {
      view.cam_from_world = {};
      view.image_file->sha256 = view.id;
    }
    return StepsOf([&] { EXPECT_TRUE(io::CollapseDuplicates(set).empty()); });
  });
  ExpectNearLinear([](int count) {  // in memory
    DtrSet set = Sphere(count);
    for (View& view : set.frames[0].views) GivePixels(view);
    return StepsOf(
        [&] { EXPECT_EQ(MakeRenderScene(set).views.size(), static_cast<size_t>(count)); });
  });
}

TEST(ManyViews, LeavingOutHalf) {
  ExpectNearLinear([](int count) {
    const DtrSet set = Sphere(count);
    std::vector<std::string> names;
    for (int i = 0; i < count; i += 2)
      names.push_back(set.frames[0].views[static_cast<size_t>(i)].id);
    return StepsOf([&] { DescribeRenderScene(set, names); });
  });
}

TEST(ManyViews, Baselines) {
  ExpectNearLinear([](int count) {
    DtrSet set = Sphere(count);
    return StepsOf([&] { FinishGeometry(set, SceneExtent{kCentre, {}}); });
  });
}

TEST(ManyViews, ChoosingViewsAndPlacingThem) {
  for (const Pose& camera : {Outwards(0), LookAt({20, 1, 2}, kCentre)}) {
    ExpectNearLinear([&](int count) {
      const DtrSet set = Sphere(count);
      const RenderScene scene = DescribeRenderScene(set);
      const RenderOptions options = AllViews();
      const PinholeCamera novel(1, 1, 1, 1, 0.5, 0.5);
      return StepsOf([&] {
        const ViewSelection selection = SelectViews(scene, camera, options);
        RenderFrame frame = MakeFrame(scene, novel, camera, options, selection);
        SetCutFactors(selection, selection.views.size(), frame);
        EXPECT_GT(frame.views.size(), scene.views.size() / 8);
      });
    });
  }
}

// Threads that read come in between, so that steps differ from run to run: a bound by view.
TEST(ManyViews, StreamsThatHoldHalfOfThem) {
  constexpr size_t kMaxStepsPerView = 4000;
  DtrSet set = Sphere(kMany);
  const RenderScene described = DescribeRenderScene(set);
  ViewStream::Settings settings;
  settings.host_bytes = kMany / 2 * (3 + sizeof(float));
  const std::uint64_t steps = StepsOf([&] {
    ViewStream stream(set, described, GivePixels, settings);
    std::vector<const View*> hidden(described.views.begin(), described.views.begin() + kMany / 4);
    stream.Hide(hidden);
    for (const double x : {-50.0, 50.0}) {  // half of the views make room
      stream.SceneFor(Outwards(x), AllViews(), ViewStream::Wait::kForAll);
      EXPECT_EQ(stream.bytes(), settings.host_bytes);
    }
  });
  EXPECT_GT(steps, size_t{kMany});
  EXPECT_LT(steps / kMany, kMaxStepsPerView);
}

/// Takes a byte for each view.
class Bytes final : public ViewsWithinRoom {
 public:
  using ViewsWithinRoom::ViewsWithinRoom;

 private:
  void Put(const RenderFrame&, const std::vector<const View*>&) override {}
  void DropView(const View&) override {}
  void DropAll() override {}
  size_t BytesOf(const View&) const override { return 1; }
  size_t MostBytesOf(const RenderFrame& frame) const override { return frame.views.size(); }
};

TEST(ManyViews, RoomForHalfOfThem) {
  ExpectNearLinear([](int count) {
    const DtrSet set = Sphere(count);
    const RenderScene scene = DescribeRenderScene(set);
    const RenderOptions options = AllViews();
    const PinholeCamera novel(1, 1, 1, 1, 0.5, 0.5);
    const auto half = static_cast<size_t>(count) / 2;
    Bytes within(half);
    return StepsOf([&] {
      for (const double x : {-50.0, 50.0}) {
        const ViewSelection selection = SelectViews(scene, Outwards(x), options);
        RenderFrame frame = MakeFrame(scene, novel, Outwards(x), options, selection);
        EXPECT_EQ(within.Prepare(frame, NearestFirst(scene, selection)), half);
        EXPECT_EQ(frame.views.size(), half);
      }
    });
  });
}

}  // namespace
}  // namespace dtr
