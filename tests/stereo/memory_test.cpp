// A limit on memory is kept, to the byte that is allocated, and changes no result.
#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <map>
#include <mutex>
#include <new>

#include "datasets/exact/stereo_quality.h"
#include "stereo/depth_maps.h"
#include "tests/support/on_threads.h"
#include "tests/support/test_data.h"

namespace {
std::atomic<long> held_bytes{0}, peak_bytes{0};

void* Counted(void* block) {
  if (block == nullptr) throw std::bad_alloc();
  const long now = held_bytes += static_cast<long>(malloc_usable_size(block));
  long peak = peak_bytes;
  while (now > peak && !peak_bytes.compare_exchange_weak(peak, now)) {
  }
  return block;
}
void Uncounted(void* block) {
  if (block == nullptr) return;
  held_bytes -= static_cast<long>(malloc_usable_size(block));
  std::free(block);
}
}  // namespace

void* operator new(size_t bytes) { return Counted(std::malloc(bytes)); }
void* operator new[](size_t bytes) { return Counted(std::malloc(bytes)); }
void* operator new(size_t bytes, std::align_val_t align) {
  const auto a = static_cast<size_t>(align);
  return Counted(std::aligned_alloc(a, (bytes + a - 1) / a * a));
}
void operator delete(void* block) noexcept { Uncounted(block); }
void operator delete[](void* block) noexcept { Uncounted(block); }
void operator delete(void* block, size_t) noexcept { Uncounted(block); }
void operator delete[](void* block, size_t) noexcept { Uncounted(block); }
void operator delete(void* block, std::align_val_t) noexcept { Uncounted(block); }
void operator delete(void* block, size_t, std::align_val_t) noexcept { Uncounted(block); }

namespace dtr::stereo::testing {
namespace {

namespace fs = std::filesystem;

const PinholeCamera kCamera(200, 150, 190, 190, 100, 75);
constexpr int kViews = 9;

/// Grids in a file, one after another; all of one size.
template <typename... Grids>
void WriteGrids(const fs::path& file, const Grids&... grids) {
  std::ofstream out(file, std::ios::binary);
  (out.write(reinterpret_cast<const char*>(grids.data().data()),
             static_cast<std::streamsize>(grids.data().size() * sizeof(grids.data()[0]))),
   ...);
}
template <typename... Grids>
void ReadGrids(const fs::path& file, Grids&... grids) {
  std::ifstream in(file, std::ios::binary);
  (in.read(reinterpret_cast<char*>(grids.data().data()),
           static_cast<std::streamsize>(grids.data().size() * sizeof(grids.data()[0]))),
   ...);
}

/// Everything of a run on disk.
class OnDisk final : public PlaneMapStore, public EstimateStore {
 public:
  bool Has(int pass, int view) const override { return fs::exists(Planes(pass, view)); }
  std::shared_ptr<const PlaneMap> Load(int pass, int view) override {
    const int w = kCamera.width_px(), h = kCamera.height_px();
    auto map = std::make_shared<PlaneMap>(
        PlaneMap{Grid<float>(w, h), Grid<float>(w, h), Grid<float>(w, h)});
    ReadGrids(Planes(pass, view), map->inverse_depth, map->slope_x, map->slope_y);
    const std::lock_guard lock(mutex_);
    map->unit_z = units_.at({pass, view});
    ++loads;
    return map;
  }
  void Save(int pass, int view, PlaneMap&& map) override {
    WriteGrids(Planes(pass, view), map.inverse_depth, map.slope_x, map.slope_y);
    const std::lock_guard lock(mutex_);
    units_[{pass, view}] = map.unit_z;
  }
  void Drop(int) override {}
  bool Has(int view) const override { return fs::exists(Estimate(view)); }
  std::shared_ptr<const DepthEstimate> Load(int view) override {
    const int w = kCamera.width_px(), h = kCamera.height_px();
    auto estimate =
        std::make_shared<DepthEstimate>(DepthEstimate{DepthImage(w, h), Grid<float>(w, h)});
    ReadGrids(Estimate(view), estimate->depth.grid(), estimate->inverse_depth_sigma);
    return estimate;
  }
  void Save(int view, DepthEstimate&& estimate) override {
    WriteGrids(Estimate(view), estimate.depth.grid(), estimate.inverse_depth_sigma);
  }
  StereoPixels Pixels(int view) const {
    StereoPixels pixels{ImageRgb8(kCamera.width_px(), kCamera.height_px(), 3), {}};
    ReadGrids(folder_ / ("image" + std::to_string(view)), pixels.image);
    return pixels;
  }
  void SavePixels(int view, const ImageRgb8& image) const {
    WriteGrids(folder_ / ("image" + std::to_string(view)), image);
  }
  int loads = 0;

 private:
  fs::path Planes(int pass, int view) const {
    return folder_ / ("planes" + std::to_string(pass) + "_" + std::to_string(view));
  }
  fs::path Estimate(int view) const { return folder_ / ("estimate" + std::to_string(view)); }
  dtr::testing::TemporaryFolder folder_;
  std::mutex mutex_;
  std::map<std::pair<int, int>, double> units_;
};

struct Computed {
  std::vector<DepthEstimate> maps;
  long peak_bytes = 0;  ///< above what there was before
};

class MemoryLimit : public ::testing::Test {
 protected:
  void SetUp() override {
    Random random(3);
    for (int v = 0; v < kViews; ++v) {
      const Shot shot = Photograph(Slanted(), kCamera, Facing({0.15 * v, 0.02 * (v % 3), 0}), 0.35);
      views_.push_back({kCamera, shot.cam_from_world, nullptr, nullptr});
      images_.push_back(shot.image);
    }
    for (int i = 0; i < 200; ++i) {
      const Vector3d from(random.Uniform(0, 1), 0, 0),
          ray(random.Uniform(-0.4, 0.4), random.Uniform(-0.3, 0.3), 1);
      scene_.points.push_back({from + *Slanted()(from, ray) * ray});
      for (int v = 0; v < kViews; ++v) scene_.observations.push_back({v, i, {0, 0}});
    }
    std::sort(scene_.observations.begin(), scene_.observations.end(),
              [](const auto& a, const auto& b) { return a.view < b.view; });
  }

  Computed Compute(const Engine& engine, std::uint64_t memory_bytes, int threads) {
    OnDisk disk;
    for (int v = 0; v < kViews; ++v) disk.SavePixels(v, images_[static_cast<size_t>(v)]);
    DepthMapsOptions options;
    options.neighbours.count = engine.Neighbours();
    const ThreadLimit limit(threads);
    options.planes = &disk;
    options.estimates = &disk;
    options.load_pixels = [&](int view) { return disk.Pixels(view); };
    options.memory_bytes = memory_bytes;
    SilentProgress progress;
    Computed run;
    run.maps.resize(kViews);
    const long before = held_bytes;
    peak_bytes = before;
    ComputeDepthMaps(views_, scene_, engine, options, progress, {},
                     [&](int view, DepthEstimate&& estimate, const DepthRange&) {
                       // Written elsewhere and forgotten, as a set's writer does.
                       const long kept = held_bytes;
                       run.maps[static_cast<size_t>(view)] = estimate;
                       held_bytes = kept;
                     });
    run.peak_bytes = peak_bytes - before;
    loads_ = disk.loads;
    return run;
  }

  std::uint64_t Least(const Engine& engine) {
    try {
      Compute(engine, 1, 1);
    } catch (const NotEnoughMemory& error) {
      return error.min_bytes();
    }
    ADD_FAILURE() << "one byte is enough?";
    return 0;
  }

  std::vector<StereoView> views_;
  std::vector<ImageRgb8> images_;
  SparseScene scene_;
  int loads_ = 0;
};

TEST_F(MemoryLimit, IsKeptAtTheLeastThatWorksWithTheSameBytes) {
  for (const int passes : {2, 0}) {
    const auto engine = MakeEngine(
        "patchmatch", {.neighbours = 3, .pass_neighbours = 4, .iterations = 1, .passes = passes});
    const std::uint64_t least = Least(*engine);
    const Computed ample = Compute(*engine, 0, 2);
    const int loads_when_ample = loads_;
    {
      const Computed tight = Compute(*engine, least, 1);
      EXPECT_LE(tight.peak_bytes, static_cast<long>(least)) << passes << " passes";
      // A number that is far from what is needed would keep memory free for nothing.
      EXPECT_GE(tight.peak_bytes, static_cast<long>(0.7 * static_cast<double>(least)));
      for (int v = 0; v < kViews; ++v) {
        const auto k = static_cast<size_t>(v);
        EXPECT_EQ(tight.maps[k].depth.grid(), ample.maps[k].depth.grid());
        EXPECT_EQ(tight.maps[k].inverse_depth_sigma, ample.maps[k].inverse_depth_sigma);
      }
    }
    if (passes > 0) {
      EXPECT_GT(ample.peak_bytes, static_cast<long>(least));
      EXPECT_GT(loads_, loads_when_ample);
    }
    for (const std::uint64_t views : {2u, 3u}) {  // side by side
      const Computed some = Compute(*engine, views * least, 5);
      EXPECT_LE(some.peak_bytes, static_cast<long>(views * least)) << views << " views";
      for (size_t k = 0; k < kViews; ++k) {
        EXPECT_EQ(some.maps[k].depth.grid(), ample.maps[k].depth.grid());
        EXPECT_EQ(some.maps[k].inverse_depth_sigma, ample.maps[k].inverse_depth_sigma);
      }
    }
  }
}

// Priors on the finest grid there is, that of the views.
TEST_F(MemoryLimit, CountsPriors) {
  const DepthPrior prior{[] {
                           DepthImage map(kCamera.width_px(), kCamera.height_px());
                           std::fill(map.grid().data().begin(), map.grid().data().end(), 4.0f);
                           return map;
                         },
                         {{4}, {0.05}}};
  for (StereoView& view : views_) view.prior = &prior;
  const auto engine = MakeEngine(
      "patchmatch", {.neighbours = 3, .pass_neighbours = 4, .iterations = 1, .passes = 1});
  const std::uint64_t least = Least(*engine);
  const Computed tight = Compute(*engine, least, 1);
  EXPECT_LE(tight.peak_bytes, static_cast<long>(least));
  EXPECT_GE(tight.peak_bytes, static_cast<long>(0.7 * static_cast<double>(least)));
}

TEST_F(MemoryLimit, TooLittleIsSaidBeforeAnyWork) {
  const auto engine = MakeEngine("patchmatch");
  const std::uint64_t least = Least(*engine);
  EXPECT_THROW(Compute(*engine, least - 1, 1), NotEnoughMemory);
}

}  // namespace
}  // namespace dtr::stereo::testing
