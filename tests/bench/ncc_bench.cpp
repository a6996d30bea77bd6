// tests/bench/ncc_bench.cpp -- how many samples of windows does the PatchMatch engine compare in a
// second: the kernel alone, and inside the loops that estimate depth?
//
//   ncc_bench [REPEATS]
//
// A sample is one pixel of a window of the reference compared with its place in one neighbour; only
// windows that lie in the neighbour count. One thread, CPU seconds, median of REPEATS (default 10)
// after a warm-up; the last lines compare one thread with two, by CPU and by wall seconds.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <functional>
#include <string>

#include "datasets/exact/stereo_quality.h"
#include "stereo/patchmatch/hypotheses.h"
#include "stereo/patchmatch/level.h"
#include "tests/support/on_threads.h"

namespace {

using namespace dtr;
using namespace dtr::stereo;
using namespace dtr::stereo::patchmatch;

constexpr int kWidth = 640, kHeight = 480, kViews = 5;
constexpr DepthRange kRange{2.5, 8};

double CpuSeconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double WallSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Rate {
  double per_second = 0, spread = 0;  ///< median, and (largest - least) / median
};

/// `run` does the work once and returns how many samples that were; `prepare` is not timed.
Rate Measure(int repeats, const std::function<void()>& prepare,
             const std::function<std::int64_t()>& run) {
  std::vector<double> rates;
  for (int i = -1; i < repeats; ++i) {
    prepare();
    const double start = CpuSeconds();
    const auto samples = static_cast<double>(run());
    if (i >= 0) rates.push_back(samples / (CpuSeconds() - start));
  }
  std::sort(rates.begin(), rates.end());
  const double median = rates[rates.size() / 2];
  return {median, (rates.back() - rates.front()) / median};
}

/// A sphere before a wall from the middle and from five places around it.
struct Scene {
  Scene() {
    const PinholeCamera camera(kWidth, kHeight, 560, 560, 0.5 * kWidth, 0.5 * kHeight);
    std::vector<Pose> poses = {testing::Facing({0, 0, 0})};
    for (int i = 0; i < kViews; ++i) {
      const double angle = 2 * std::numbers::pi * i / kViews;
      poses.push_back(testing::Facing({0.4 * std::cos(angle), 0.4 * std::sin(angle), 0}, 5 * i));
    }
    shots = testing::ShotsOf(testing::SphereBeforeWall(), camera, poses);
    views = testing::ViewsOf(shots);
    for (size_t i = 1; i < views.size(); ++i) sources.push_back(MakeSource(views[i], 1));
    picture = MakeGreyImage(views[0]);
    for (const testing::Shot& shot : shots) {
      truth.push_back({Grid<float>(kWidth, kHeight), Grid<float>(kWidth, kHeight),
                       Grid<float>(kWidth, kHeight)});
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          truth.back().inverse_depth(x, y) = 1 / shot.truth(x, y);
        }
      }
    }
  }

  /// With what the neighbours know or without.
  Level At(bool with_surfaces) {
    for (size_t i = 0; i < sources.size(); ++i) {
      sources[i].surface = with_surfaces ? &truth[i + 1] : nullptr;
    }
    return MakeLevel(views[0], picture, sources, 0, kRange, 1);
  }

  std::vector<testing::Shot> shots;
  std::vector<StereoView> views;
  std::vector<SourcePyramid> sources;
  GreyImage picture;
  std::vector<PlaneMap> truth;
};

std::int64_t SweepAll(const Level& level, Sweep sweep, State* state) {
  std::int64_t samples = 0;
  for (sweep.colour = 0; sweep.colour < 2; ++sweep.colour) {
    for (int y = 0; y < kHeight; ++y) samples += SweepRow(level, sweep, y, state);
  }
  return samples;
}

void Print(const std::string& what, const Rate& rate, double alone) {
  fmt::print("{:<34}{:>8.0f} million samples/s  {:>5.1f} %  spread {:.0f} %\n", what,
             1e-6 * rate.per_second, 100 * rate.per_second / alone, 100 * rate.spread);
}

void PrintScaling(const Scene& scene) {
  double cpu[2], wall[2];
  for (const int threads : {1, 2}) {
    const double c = CpuSeconds(), w = WallSeconds();
    OnThreads(threads, [&] { return testing::EstimateFirstBy("patchmatch", scene.views, kRange); });
    cpu[threads - 1] = CpuSeconds() - c;
    wall[threads - 1] = WallSeconds() - w;
    fmt::print("{} thread{}: {:.2f} CPU s, {:.2f} wall s, {:.2f} cores in use\n", threads,
               threads == 1 ? " " : "s", cpu[threads - 1], wall[threads - 1],
               cpu[threads - 1] / wall[threads - 1]);
  }
  fmt::print("2 threads are {:.2f} times as fast\n", wall[0] / wall[1]);
}

void Run(int repeats) {
  Scene scene;
  const auto nothing = [] {};
  const Level level = scene.At(false);
  const State planes = StateOf(level, scene.truth[0], kRange);
  std::vector<float> steps(64);
  for (size_t i = 0; i < steps.size(); ++i) steps[i] = 1e-4f * static_cast<float>(i);
  std::vector<float> costs(steps.size() * kWidth);
  fmt::print("instruction set {}, {}x{}, {} neighbours, windows of {} samples\n", InstructionSet(),
             kWidth, kHeight, kViews, kTaps);
  const Rate alone = Measure(repeats, nothing, [&] {
    std::int64_t samples = 0;
    for (int y = 0; y < kHeight; y += 8) {
      samples += ScoreRow(level, planes, y, steps, costs.data());
    }
    return samples;
  });
  Print("kernel alone", alone, alone.per_second);

  State state;
  Sweep sweep;
  sweep.step_px = 2;
  sweep.jump = false;
  Print("search, full size",
        Measure(
            repeats, [&] { state = planes; }, [&] { return SweepAll(level, sweep, &state); }),
        alone.per_second);

  const Level known = scene.At(true);
  State guessed = StateOf(known, scene.truth[0], kRange);
  HypothesesFromSurfaces(known, &guessed);
  sweep.step_px = 1;
  sweep.far_regions = 0;
  Print("consistency round",
        Measure(
            repeats, [&] { state = guessed; }, [&] { return SweepAll(known, sweep, &state); }),
        alone.per_second);
  PrintScaling(scene);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Run(argc > 1 ? std::max(1, std::stoi(argv[1])) : 10);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
