#include "dtr/render/view_stream.h"

#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>

#include "datasets/exact/analytic_scene.h"
#include "dtr/base/error.h"
#include "dtr/base/random.h"
#include "dtr/render/geometry.h"
#include "dtr/render/time_steps.h"
#include "dtr/render/valid_views.h"
#include "tests/support/on_threads.h"

namespace dtr {
namespace {

using namespace dtr::testing;

constexpr int kViews = 12;

/// A set "on disk": views along a line before a plane, described without pixels.
struct Disk {
  std::map<std::string, View> files;
  std::map<std::string, std::string> broken;  ///< id, error
  DtrSet set;
  std::atomic<int> reads{0};
  size_t view_bytes = 0;

  Disk() {
    set.frames.resize(1);
    for (int i = 0; i < kViews; ++i) {
      Shot shot;
      shot.id = "v" + std::string(1, static_cast<char>('a' + i));
      shot.cam_from_world = LookAt({0.5 * (i - kViews / 2), 0, 0}, {0, 0, 10});
      set.frames[0].views.push_back(Photograph(Plane({0, 0, 1}, 10), shot));
    }
    FinishGeometry(set);
    for (View& view : set.frames[0].views) {
      files[view.id] = view;
      view_bytes = view.image.data().size() + sizeof(float) * view.depth.grid().data().size();
      view.image = {};
      view.depth = {};
    }
  }
  ViewStream::Loader Loader() {
    return [this](View& view) {
      ++reads;
      if (broken.contains(view.id)) throw Error(broken.at(view.id));
      view.image = files.at(view.id).image;
      view.depth = files.at(view.id).depth;
    };
  }
  Pose Camera(double x) const { return LookAt({x, 0.1, 0}, {0, 0, 10}); }
};

RenderOptions Nearest(int views) {
  RenderOptions options;
  options.views = views;
  return options;
}

/// The ids that an image is drawn from, nearest first; every one must be whole.
std::vector<std::string> Drawn(const Disk& disk, const RenderScene& scene, const Pose& camera,
                               const RenderOptions& options) {
  std::vector<std::string> ids;
  for (const int index : SelectViews(scene, camera, options).views) {
    const View& view = *scene.views[static_cast<size_t>(index)];
    EXPECT_EQ(view.image, disk.files.at(view.id).image);
    EXPECT_EQ(view.depth, disk.files.at(view.id).depth);
    ids.push_back(view.id);
  }
  return ids;
}

std::vector<std::string> Expected(Disk& disk, const Pose& camera, const RenderOptions& options) {
  const RenderScene scene = DescribeRenderScene(disk.set);
  std::vector<std::string> ids;
  for (const int index : SelectViews(scene, camera, options).views) {
    ids.push_back(scene.views[static_cast<size_t>(index)]->id);
  }
  return ids;
}

ViewStream::Settings Room(size_t bytes, std::vector<std::string>* warnings = nullptr) {
  ViewStream::Settings settings;
  settings.host_bytes = bytes;
  settings.warn = [warnings](const std::string& line) {
    if (warnings != nullptr) warnings->push_back(line);
  };
  return settings;
}

TEST(ViewStream, ReadsWhatAPictureNeedsAndNothingElse) {
  Disk disk;
  ViewStream stream(disk.set, DescribeRenderScene(disk.set), disk.Loader(), {});
  const Pose camera = disk.Camera(-1.2);
  const RenderScene scene = stream.SceneFor(camera, Nearest(3), ViewStream::Wait::kForAll);
  EXPECT_EQ(Drawn(disk, scene, camera, Nearest(3)), Expected(disk, camera, Nearest(3)));
  EXPECT_EQ(disk.reads, 3);
  EXPECT_EQ(stream.bytes(), 3 * disk.view_bytes);
  stream.SceneFor(camera, Nearest(3), ViewStream::Wait::kForAll);
  EXPECT_EQ(disk.reads, 3);
}

TEST(ViewStream, DropsWhatWasUsedLongestAgo) {
  Disk disk;
  ViewStream stream(disk.set, DescribeRenderScene(disk.set), disk.Loader(),
                    Room(4 * disk.view_bytes));
  const auto draw = [&](double x) {
    const Pose camera = disk.Camera(x);
    const RenderScene scene = stream.SceneFor(camera, Nearest(2), ViewStream::Wait::kForAll);
    EXPECT_EQ(Drawn(disk, scene, camera, Nearest(2)), Expected(disk, camera, Nearest(2)));
    EXPECT_LE(stream.bytes(), 4 * disk.view_bytes);
  };
  draw(-2.3);
  draw(0.2);
  draw(-2.3);
  EXPECT_EQ(disk.reads, 4);
  draw(2.2);  // the two of 0.2 go
  EXPECT_EQ(disk.reads, 6);
  draw(-2.3);
  EXPECT_EQ(disk.reads, 6);
  draw(0.2);
  EXPECT_EQ(disk.reads, 8);
}

TEST(ViewStream, DrawsFromTheNearestThatFitAndSaysSoOnce) {
  Disk disk;
  std::vector<std::string> warnings;
  ViewStream stream(disk.set, DescribeRenderScene(disk.set), disk.Loader(),
                    Room(3 * disk.view_bytes + 1, &warnings));
  for (const double x : {-2.3, 1.9}) {
    const Pose camera = disk.Camera(x);
    std::vector<std::string> nearest = Expected(disk, camera, Nearest(8));
    nearest.resize(3);
    const RenderScene scene = stream.SceneFor(camera, Nearest(8), ViewStream::Wait::kForAll);
    EXPECT_EQ(Drawn(disk, scene, camera, Nearest(8)), nearest);
  }
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("drawn from the nearest 3 of 8 views"), std::string::npos)
      << warnings[0];
  // Less than one view: one is kept all the same.
  ViewStream tiny(disk.set, DescribeRenderScene(disk.set), disk.Loader(), Room(1));
  for (View& view : disk.set.frames[0].views) view.image = {}, view.depth = {};
  const Pose camera = disk.Camera(0.2);
  EXPECT_EQ(
      Drawn(disk, tiny.SceneFor(camera, Nearest(8), ViewStream::Wait::kForAll), camera, Nearest(8))
          .size(),
      1u);
}

TEST(ViewStream, AViewThatCannotBeReadIsNamedAndAnotherTakesItsPlace) {
  Disk disk;
  std::vector<std::string> warnings;
  const Pose camera = disk.Camera(0.2);
  const std::vector<std::string> order = Expected(disk, camera, Nearest(5));
  disk.broken[order[0]] = "depth/x.png: gone";
  disk.broken[order[2]] = "images/y.png: cut short";
  ViewStream stream(disk.set, DescribeRenderScene(disk.set), disk.Loader(),
                    Room(3 * disk.view_bytes, &warnings));
  const RenderScene scene = stream.SceneFor(camera, Nearest(3), ViewStream::Wait::kForAll);
  EXPECT_EQ(Drawn(disk, scene, camera, Nearest(3)),
            (std::vector<std::string>{order[1], order[3], order[4]}));
  EXPECT_EQ(stream.lost().size(), 2u);
  ASSERT_EQ(warnings.size(), 2u);
  for (const std::string& line : warnings) EXPECT_NE(line.find("is left out: "), std::string::npos);
  for (const auto& [id, view] : disk.files) disk.broken[id] = "gone";
  ViewStream none(disk.set, DescribeRenderScene(disk.set), disk.Loader(), Room(1 << 30));
  EXPECT_THROW(none.SceneFor(camera, Nearest(3), ViewStream::Wait::kForAll), Error);
}

TEST(ViewStream, WithoutWaitingDrawsWhatIsThereAndTheRestComesLater) {
  Disk disk;
  std::mutex mutex;
  std::condition_variable condition;
  bool open = false;
  const auto slow = [&, load = disk.Loader()](View& view) {
    std::unique_lock lock(mutex);
    condition.wait(lock, [&] { return open; });
    lock.unlock();
    load(view);
  };
  ViewStream stream(disk.set, DescribeRenderScene(disk.set), slow, Room(1 << 30));
  const Pose camera = disk.Camera(0.2);
  EXPECT_TRUE(stream.SceneFor(camera, Nearest(3), ViewStream::Wait::kForNone).views.empty());
  {
    const std::lock_guard lock(mutex);
    open = true;
  }
  condition.notify_all();
  const RenderScene all = stream.SceneFor(camera, Nearest(3), ViewStream::Wait::kForAll);
  const RenderScene now = stream.SceneFor(camera, Nearest(3), ViewStream::Wait::kForNone);
  EXPECT_EQ(now.views.size(), 3u);
  EXPECT_EQ(Drawn(disk, now, camera, Nearest(3)), Drawn(disk, all, camera, Nearest(3)));
}

// Cameras at random, read ahead or not, with little room: what a waiting call gives never depends
// on the threads or on what came before. The thread sanitizer runs this, too.
TEST(ViewStream, GivesTheSameForAnyThreadsRoomAndHistory) {
  for (const int threads : {1, 2, 5}) {
    for (const size_t views : {3u, 5u, 12u}) {
      Disk disk;
      ViewStream::Settings settings = Room(views * disk.view_bytes);
      const ThreadLimit limit(threads);
      const std::vector<std::string> sound = Expected(disk, disk.Camera(0), Nearest(kViews));
      disk.broken[sound[4]] = "gone";
      Disk without;
      ViewStream stream(disk.set, DescribeRenderScene(disk.set), disk.Loader(), settings);
      Random random(5);
      double next = random.Uniform(-3, 3);
      for (int k = 0; k < 40; ++k) {
        const Pose camera = disk.Camera(next);
        if (k % 5 == 2) stream.SceneFor(camera, Nearest(3), ViewStream::Wait::kForNone);
        const RenderScene scene = stream.SceneFor(camera, Nearest(3), ViewStream::Wait::kForAll);
        std::vector<std::string> expected = Expected(without, camera, Nearest(4));
        std::erase(expected, sound[4]);
        expected.resize(3);
        next = random.Uniform(-3, 3);
        if (k % 3 != 0) stream.Prefetch(disk.Camera(next), Nearest(3));
        EXPECT_EQ(Drawn(disk, scene, camera, Nearest(3)), expected) << k;
        EXPECT_LE(stream.bytes(), settings.host_bytes);
      }
    }
  }
}

TEST(ViewStream, ReleasedViewsAreDrawnFromWithoutPixelsAndReadAgainWhenThoseAreNeeded) {
  Disk disk;
  ViewStream stream(disk.set, DescribeRenderScene(disk.set), disk.Loader(), Room(4 << 20));
  const Pose camera = disk.Camera(-1.2);
  const std::vector<std::string> expected = Expected(disk, camera, Nearest(3));
  RenderScene scene = stream.SceneFor(camera, Nearest(3), ViewStream::Wait::kForAll);
  const View& nearest =
      *scene.views[static_cast<size_t>(SelectViews(scene, camera, Nearest(3)).views.front())];
  stream.Release(nearest);
  EXPECT_TRUE(nearest.image.empty());
  EXPECT_TRUE(nearest.depth.empty());
  EXPECT_EQ(stream.bytes(), 2 * disk.view_bytes);
  EXPECT_EQ(stream.decoded_bytes(), 3 * disk.view_bytes);
  for (const auto wait : {ViewStream::Wait::kForNone, ViewStream::Wait::kForAll}) {
    scene = stream.SceneFor(camera, Nearest(3), wait, ViewStream::Pixels::kOrReleased);
    std::vector<std::string> ids;
    for (const int index : SelectViews(scene, camera, Nearest(3)).views) {
      ids.push_back(scene.views[static_cast<size_t>(index)]->id);
    }
    EXPECT_EQ(ids, expected);
    EXPECT_EQ(disk.reads, 3);
    EXPECT_TRUE(nearest.image.empty());
  }
  // A moving image that needs the pixels does not go without the view it had.
  scene = stream.SceneFor(camera, Nearest(3), ViewStream::Wait::kForNone);
  EXPECT_EQ(Drawn(disk, scene, camera, Nearest(3)), expected);
  EXPECT_EQ(disk.reads, 4);
  EXPECT_EQ(stream.bytes(), 3 * disk.view_bytes);
  EXPECT_EQ(stream.decoded_bytes(), 3 * disk.view_bytes);
}

TEST(ViewStream, FilesThatComeBackAreReadAgain) {
  Disk disk;
  std::vector<std::string> warnings;
  const Pose camera = disk.Camera(0.2);
  const std::vector<std::string> order = Expected(disk, camera, Nearest(4));
  disk.broken[order[0]] = "images/x.jpg: gone";
  ViewStream stream(disk.set, DescribeRenderScene(disk.set), disk.Loader(),
                    Room(8 * disk.view_bytes, &warnings));
  const auto drawn = [&] {
    const RenderScene scene = stream.SceneFor(camera, Nearest(3), ViewStream::Wait::kForAll);
    return Drawn(disk, scene, camera, Nearest(3));
  };
  const std::vector<std::string> without{order[1], order[2], order[3]};
  const std::vector<std::string> whole{order[0], order[1], order[2]};
  EXPECT_EQ(drawn(), without);
  ASSERT_EQ(stream.lost().size(), 1u);
  EXPECT_EQ(stream.lost()[0].view->id, order[0]);
  const int reads = disk.reads;
  EXPECT_EQ(stream.RetryLost([](const View&) { return false; }), 0u);
  EXPECT_EQ(drawn(), without);
  EXPECT_EQ(disk.reads, reads);
  // Tried in vain: lost again, but not complained of again.
  EXPECT_EQ(stream.RetryLost([](const View&) { return true; }), 1u);
  EXPECT_EQ(drawn(), without);
  EXPECT_EQ(stream.lost().size(), 1u);
  EXPECT_EQ(warnings.size(), 1u);
  disk.broken.clear();
  EXPECT_EQ(stream.RetryLost([](const View&) { return true; }), 1u);
  EXPECT_EQ(drawn(), whole);
  EXPECT_TRUE(stream.lost().empty());
  EXPECT_LE(stream.bytes(), 8 * disk.view_bytes);
}

TEST(ViewStream, FramesOfADynamicSetShareTheRoomAndNothingElse) {
  Disk disk;
  Frame later = disk.set.frames[0];
  for (View& view : later.views) {
    const View still = disk.files.at(view.id);
    view.id = "w" + view.id;
    disk.files[view.id] = still;
    disk.files[view.id].id = view.id;
    for (std::uint8_t& level : disk.files[view.id].image.data()) level /= 2;
  }
  disk.set.frames.push_back(later);
  ViewStream stream(disk.set, DescribeFrames(disk.set), disk.Loader(), Room(4 * disk.view_bytes));
  const Pose camera = disk.Camera(0.2);
  const auto drawn = [&](size_t frame) {
    stream.ShowFrame(frame);
    const RenderScene scene = stream.SceneFor(camera, Nearest(3), ViewStream::Wait::kForAll);
    EXPECT_LE(stream.bytes(), 4 * disk.view_bytes);
    return Drawn(disk, scene, camera, Nearest(3));
  };
  const std::vector<std::string> first = drawn(0);
  std::vector<std::string> second = first;
  for (std::string& id : second) id = "w" + id;
  EXPECT_EQ(drawn(1), second);
  EXPECT_EQ(disk.reads, 6);
  EXPECT_EQ(drawn(1), second);
  EXPECT_EQ(disk.reads, 6);
  EXPECT_EQ(drawn(0), first);
  // A time step of which nothing can be read is no reason to go without the others.
  for (const auto& [id, view] : disk.files) {
    if (!id.starts_with("w")) disk.broken[id] = "gone";
  }
  ViewStream half(disk.set, DescribeFrames(disk.set), disk.Loader(), Room(1 << 30));
  for (Frame& frame : disk.set.frames) {
    for (View& view : frame.views) DropPixels(view);
  }
  EXPECT_THROW(half.SceneFor(camera, Nearest(3), ViewStream::Wait::kForAll), Error);
  half.ShowFrame(1);
  const RenderScene scene = half.SceneFor(camera, Nearest(3), ViewStream::Wait::kForAll);
  EXPECT_EQ(Drawn(disk, scene, camera, Nearest(3)), second);
}

}  // namespace
}  // namespace dtr
