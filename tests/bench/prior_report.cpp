// tests/bench/prior_report.cpp -- what does a depth camera's depth add to stereo?
//
//   prior_report maps TRUTH OUT [--shrink 7.5] [--noise 0.01] [--scale 1] [--shift-px 0] [--seed 1]
//                [--faults 0] [--least-confidence 0]
//   prior_report compare TRUTH WITHOUT.dtr WITH.dtr
//
// `maps` reads cameras.json and depth/ of an exact scene (`dtr dataset make`) and writes
// OUT/NAME.png as a phone would measure them: a pixel is the mean of the depths it covers, surfaces
// at both sides of an edge included, with noise of so much of the depth, in whole millimetres;
// shifted by pixels of the photo. With --faults that share of it lies in discs that are 5 to 25 %
// too near or too far, as behind glass and on gloss and black. Each pixel has a confidence of 0 to
// 2, as phones state: 0 in discs and 1 around them, 0 or 1 where a pixel covers both sides of an
// edge; one pixel in ten of a disc has 2 all the same, and 3 % of good ones have 0. Pixels below
// --least-confidence are left out, the others are the same. `compare` scores the depth of two sets
// of the scene against truth: completeness and shares of all true pixels, then errors of the pixels
// where both have a depth. docs/accuracy/DEPTH.md has the figures.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/random.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/foreign_depth.h"
#include "dtr/io/set_io.h"

namespace {

using namespace dtr;
namespace fs = std::filesystem;

struct Sensor {
  double shrink = 7.5, noise = 0.01, scale = 1, shift_px = 0, faults = 0;
  int least_confidence = 0;
  std::uint64_t seed = 1;
};

DepthImage TruthOf(const io::NamedCamera& camera, const fs::path& truth) {
  return io::ReadForeignDepth(truth / "depth" / camera.depth_file, camera.depth_kind, 1,
                              camera.camera.width_px(), camera.camera.height_px());
}

/// The mean of twelve uniform numbers' sum has a variance of 1.
double Normal(Random& random) {
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += random.Uniform(0, 1);
  return sum;
}

/// Where depth is wrong: how many times too large, and what the phone says of it.
struct Faults {
  Grid<float> factor;
  Grid<std::uint8_t> confidence;
};

Faults FaultsOf(int width, int height, double share, Random& random) {
  constexpr double kSmallest = 3, kLargest = 8, kRing = 1.5;  // pixels of the map
  constexpr double kUnnoticed = 0.1, kFalseAlarms = 0.03;
  Faults faults{Grid<float>(width, height, 1, 1.0f), Grid<std::uint8_t>(width, height, 1, 2)};
  double left = share * width * height;
  while (left > 0) {
    const double r = random.Uniform(kSmallest, kLargest);
    const double cx = random.Uniform(0, width), cy = random.Uniform(0, height);
    const double off = random.Uniform(0.05, 0.25) * (random.Uniform() < 0.5 ? -1 : 1);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double distance = std::hypot(x + 0.5 - cx, y + 0.5 - cy);
        std::uint8_t& confidence = faults.confidence(x, y);
        if (distance > r + kRing) continue;
        if (distance > r) {
          confidence = std::min<std::uint8_t>(confidence, 1);
          continue;
        }
        left -= faults.factor(x, y) == 1;
        faults.factor(x, y) = static_cast<float>(1 + off);
        confidence = random.Uniform() < kUnnoticed ? 2 : 0;
      }
    }
  }
  for (std::uint8_t& confidence : faults.confidence.data()) {
    if (random.Uniform() < kFalseAlarms) confidence = 0;
  }
  return faults;
}

Grid<std::uint16_t> Measured(const DepthImage& truth, const Sensor& sensor, Random& random,
                             Random& fault_random) {
  constexpr float kEdge = 1.05f;
  const int width = static_cast<int>(std::lround(truth.width() / sensor.shrink));
  const int height = static_cast<int>(std::lround(truth.height() / sensor.shrink));
  Grid<std::uint16_t> map(width, height);
  const Faults faults = FaultsOf(width, height, sensor.faults, fault_random);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      float near_z = INFINITY, far_z = 0;
      int count = 0;
      const auto begin = [&](int i, int n, int all) { return i * all / n; };
      for (int v = begin(y, height, truth.height()); v < begin(y + 1, height, truth.height());
           ++v) {
        for (int u = begin(x, width, truth.width()); u < begin(x + 1, width, truth.width()); ++u) {
          const int from = u - static_cast<int>(std::lround(sensor.shift_px));
          if (!truth.Contains(from, v) || DepthImage::IsHole(truth(from, v))) continue;
          sum += truth(from, v);
          near_z = std::min(near_z, truth(from, v));
          far_z = std::max(far_z, truth(from, v));
          ++count;
        }
      }
      if (count == 0) continue;
      const double z =
          sum / count * sensor.scale * (1 + sensor.noise * Normal(random)) * faults.factor(x, y);
      int confidence = faults.confidence(x, y);
      if (far_z > kEdge * near_z) confidence = std::min(confidence, (x + y) % 5 == 0 ? 1 : 0);
      if (confidence < sensor.least_confidence) continue;
      map(x, y) = static_cast<std::uint16_t>(std::clamp(std::lround(1000 * z), 0L, 65534L));
    }
  }
  return map;
}

void WriteMaps(const fs::path& truth, const fs::path& out, const Sensor& sensor) {
  fs::create_directories(out);
  Random random(sensor.seed), fault_random(sensor.seed + 1);
  for (const io::NamedCamera& camera : io::ReadCamerasJson(truth / "cameras.json").cameras) {
    const fs::path file = out / fs::path(camera.name).replace_extension(".png");
    fs::create_directories(file.parent_path());
    io::WritePng16(file, Measured(TruthOf(camera, truth), sensor, random, fault_random));
  }
}

/// Depth of a set's views, full size, by the photo's name.
std::map<std::string, DepthImage> DepthOf(const fs::path& folder) {
  DtrSet set = io::ReadSet(folder);
  std::map<std::string, DepthImage> maps;
  for (View& view : set.frames.front().views) {
    if (view.role != ViewRole::kSource || !view.depth_file) continue;
    io::LoadPixels(folder, view, {});
    maps[view.name] = view.depth;
  }
  return maps;
}

struct Tally {
  long true_pixels = 0, kept[2] = {}, near[2][2] = {};  ///< of each set: within 1 and 2 %
  std::vector<float> both[2];                           ///< errors where both have a depth
};

void Add(const DepthImage& truth, const DepthImage& a, const DepthImage& b, Tally& tally) {
  const DepthImage* maps[2] = {&a, &b};
  if (a.width() != truth.width() || b.width() != truth.width()) {
    throw Error("expected sets of the size of the truth (--max-size 0), found another");
  }
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      const float z = truth(x, y);
      if (DepthImage::IsHole(z)) continue;
      ++tally.true_pixels;
      float error[2];
      bool has[2];
      for (int i = 0; i < 2; ++i) {
        const float found = (*maps[i])(x, y);
        has[i] = !DepthImage::IsHole(found);
        error[i] = std::abs(found / z - 1);
        if (!has[i]) continue;
        ++tally.kept[i];
        tally.near[i][0] += error[i] <= 0.01f;
        tally.near[i][1] += error[i] <= 0.02f;
      }
      if (!has[0] || !has[1]) continue;
      for (int i = 0; i < 2; ++i) tally.both[i].push_back(error[i]);
    }
  }
}

void Compare(const fs::path& truth, const fs::path& without, const fs::path& with) {
  const auto a = DepthOf(without), b = DepthOf(with);
  Tally tally;
  for (const io::NamedCamera& camera : io::ReadCamerasJson(truth / "cameras.json").cameras) {
    if (!a.contains(camera.name) || !b.contains(camera.name)) continue;
    Add(TruthOf(camera, truth), a.at(camera.name), b.at(camera.name), tally);
  }
  const auto percent = [&](long count) {
    return 100.0 * static_cast<double>(count) / static_cast<double>(tally.true_pixels);
  };
  for (int i = 0; i < 2; ++i) {
    std::vector<float>& errors = tally.both[i];
    const auto worse = [&](float limit) {
      return 100.0 *
             static_cast<double>(
                 std::count_if(errors.begin(), errors.end(), [&](float e) { return e > limit; })) /
             static_cast<double>(errors.size());
    };
    const double past_2 = worse(0.02f), past_5 = worse(0.05f);
    const double median = QuantileOf(errors, 0.5), high = QuantileOf(errors, 0.9);
    fmt::print(
        "{}: depth {:.1f} %, within 1 % {:.1f} %, within 2 % {:.1f} % of true pixels; where both: "
        "median {:.3f} %, 90 % below {:.3f} %, past 2 % {:.2f} %, past 5 % {:.2f} %\n",
        (i == 0 ? without : with).filename().string(), percent(tally.kept[i]),
        percent(tally.near[i][0]), percent(tally.near[i][1]), 100 * median, 100 * high, past_2,
        past_5);
  }
}

int Run(int argc, char** argv) {
  const std::string mode = argc > 1 ? argv[1] : "";
  if (mode == "compare" && argc == 5) {
    Compare(argv[2], argv[3], argv[4]);
    return 0;
  }
  if (mode != "maps" || argc < 4) {
    throw UsageError("usage: prior_report maps TRUTH OUT [--option value ...] | compare TRUTH A B");
  }
  Sensor sensor;
  for (int i = 4; i + 1 < argc; i += 2) {
    const std::string name = argv[i];
    const double value = std::stod(argv[i + 1]);
    if (name == "--shrink")
      sensor.shrink = value;
    else if (name == "--noise")
      sensor.noise = value;
    else if (name == "--scale")
      sensor.scale = value;
    else if (name == "--shift-px")
      sensor.shift_px = value;
    else if (name == "--faults")
      sensor.faults = value;
    else if (name == "--least-confidence")
      sensor.least_confidence = static_cast<int>(value);
    else if (name == "--seed")
      sensor.seed = static_cast<std::uint64_t>(value);
    else
      throw UsageError("no option is called " + name);
  }
  WriteMaps(argv[2], argv[3], sensor);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
