// Depth maps at the ends of what their codings hold, through files.
#include <algorithm>
#include <cmath>
#include <limits>

#include "cli/selftest/cases.h"
#include "dtr/base/error.h"
#include "dtr/base/random.h"
#include "dtr/base/temporary_folder.h"
#include "dtr/io/depth_io.h"

namespace dtr::selftest {
namespace {

using io::DepthFormat;

constexpr const char* kDepthCodingStage = "Depth coding";
/// Steps of 1/z between the ends of the range; zstd-inverse as finely as it goes, and as coarsely
/// as pruning makes it.
constexpr std::pair<DepthCoding, int> kInverseCodings[] = {
    {DepthCoding::kPng16InverseDepth, InverseDepthCode::kSteps},
    {DepthCoding::kZstdInverseDepth, InverseDepthCode::kSteps},
    {DepthCoding::kZstdInverseDepth, 100}};
constexpr std::pair<DepthCoding, int> kCodings[] = {
    kInverseCodings[0],
    kInverseCodings[1],
    kInverseCodings[2],
    {DepthCoding::kPng16Millimetre, InverseDepthCode::kSteps},
    {DepthCoding::kExrHalf, InverseDepthCode::kSteps},
    {DepthCoding::kExrFloat, InverseDepthCode::kSteps}};

DepthImage ThroughFile(const DepthImage& depth, const DepthFormat& format, Outcome& outcome) {
  const TemporaryFolder folder;
  const std::string name = std::string("depth") + io::ExtensionOf(format.coding);
  try {
    io::WriteDepth(folder / name, depth, format);
    DepthImage back = io::ReadDepth(folder / name, format, depth.width(), depth.height());
    outcome.LookAtAll(back.grid().data());
    return back;
  } catch (const Error& rejection) {  // without the folder, whose name is another each time
    std::string words = rejection.what();
    const std::string prefix = folder.path().string() + "/";
    if (words.starts_with(prefix)) words.erase(0, prefix.size());
    throw Error(words);
  }
}

/// Largest error of 1/z over what the coding promises: half a step of its own, and the rounding of
/// the depth to float.
double ErrorOverPromise(float z, float stored, const DepthFormat& format) {
  constexpr double kFloat = 0x1.01p-24;
  double promised = kFloat / stored;  // of 1/z
  if (format.coding == DepthCoding::kPng16InverseDepth ||
      format.coding == DepthCoding::kZstdInverseDepth) {
    promised += 0.5 * (1 + 1e-9) * (1 / format.near_z - 1 / format.far_z) / io::StepsOf(format);
  } else if (format.coding == DepthCoding::kPng16Millimetre) {
    promised += 0.0005 * (1 + 1e-6) / (static_cast<double>(z) * stored);
  } else if (format.coding == DepthCoding::kExrHalf) {
    // 11 significant bits; below 2^-14 steps of 2^-24.
    promised += std::max(0x1p-11, 0x1p-25 / z) / stored;
  }
  return std::abs(1.0 / stored - 1.0 / z) / promised;
}

/// Errors and validity of maps after their files, the worst of all.
class RoundTrips {
 public:
  void Through(const DepthImage& depth, const DepthFormat& format, Outcome& outcome) {
    const DepthImage back = ThroughFile(depth, format, outcome);
    for (size_t i = 0; i < depth.grid().data().size(); ++i) {
      const float z = depth.grid().data()[i], stored = back.grid().data()[i];
      changed_ += DepthImage::IsHole(z) != DepthImage::IsHole(stored);
      if (DepthImage::IsHole(z) || DepthImage::IsHole(stored)) continue;
      const double error = ErrorOverPromise(z, stored, format);
      worst_ = std::isnan(error) ? 1e300 : std::max(worst_, error);
    }
  }
  void ThroughAllCodings(const DepthImage& depth, double near_z, double far_z, Outcome& outcome) {
    for (const auto& [coding, steps] : kCodings) {
      Through(depth, {coding, near_z, far_z, LengthUnit::kMetre, steps}, outcome);
    }
  }
  void AddTo(Outcome& outcome) const {
    outcome.Add(
        Exactly("pixels that change between hole and depth", changed_, 0, "validity is exact"));
    outcome.Add(AtMost("largest error over the promised one", worst_, 1,
                       "docs/FORMAT.md: half a step of the coding"));
  }

 private:
  double changed_ = 0, worst_ = 0;
};

Outcome AllHoles() {
  Outcome outcome;
  RoundTrips trips;
  trips.ThroughAllCodings(DepthImage(64, 48), 1, 2, outcome);
  trips.AddTo(outcome);
  return outcome;
}

Outcome SinglePixel() {
  Outcome outcome;
  RoundTrips trips;
  DepthImage lone(1, 1), in_holes(64, 48);
  lone(0, 0) = in_holes(31, 17) = 1.7f;
  trips.ThroughAllCodings(lone, 1, 2, outcome);
  trips.ThroughAllCodings(in_holes, 1, 2, outcome);
  trips.AddTo(outcome);
  return outcome;
}

Outcome Checkerboard() {
  Outcome outcome;
  RoundTrips trips;
  DepthImage depth(64, 48);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) depth(x, y) = (x + y) % 2 == 0 ? 0.1f : 60.0f;
  }
  trips.ThroughAllCodings(depth, 0.1f, 60, outcome);
  trips.AddTo(outcome);
  return outcome;
}

Outcome EndOfMillimetres() {
  Outcome outcome;
  RoundTrips trips;
  const DepthFormat format{DepthCoding::kPng16Millimetre, 0.0005, 70, LengthUnit::kMetre};
  DepthImage depth(3, 1);
  depth(0, 0) = 65.535f;
  depth(1, 0) = 0.001f;
  trips.Through(depth, format, outcome);
  trips.AddTo(outcome);
  depth(2, 0) = 65.536f;
  ExpectRejection(outcome, "65.536 m", [&] { ThroughFile(depth, format, outcome); });
  return outcome;
}

Outcome EndOfHalf() {
  Outcome outcome;
  RoundTrips trips;
  const DepthFormat format{DepthCoding::kExrHalf, 1e-3, 1e6, LengthUnit::kUnknown};
  DepthImage depth(3, 1);
  depth(0, 0) = 65504.0f;
  depth(1, 0) = 1e-3f;
  trips.Through(depth, format, outcome);
  trips.AddTo(outcome);
  depth(2, 0) = 65536.0f;
  ExpectRejection(outcome, "65 536", [&] { ThroughFile(depth, format, outcome); });
  return outcome;
}

Outcome Denormals() {
  Outcome outcome;
  constexpr float kSmallest = std::numeric_limits<float>::denorm_min();
  DepthImage depth(4, 1);
  depth(0, 0) = 1e-40f;
  depth(1, 0) = 1e-39f;
  depth(2, 0) = kSmallest;
  const DepthFormat as_float{DepthCoding::kExrFloat, kSmallest, 1, LengthUnit::kUnknown};
  const DepthImage back = ThroughFile(depth, as_float, outcome);
  outcome.Add(Exactly("depths that change, exr-float", back.grid() != depth.grid(), 0,
                      "a float survives bit for bit"));
  const DepthFormat as_half{DepthCoding::kExrHalf, kSmallest, 1, LengthUnit::kUnknown};
  ExpectRejection(outcome, "1e-40 as half", [&] { ThroughFile(depth, as_half, outcome); });
  return outcome;
}

// The range reaches from a denormal to 1: 1/near is 1e40, far beyond float.
Outcome RangeFromADenormal() {
  Outcome outcome;
  RoundTrips trips;
  DepthImage depth(3, 1);
  depth(0, 0) = 1e-40f;
  depth(1, 0) = 2e-40f;
  for (const auto& [coding, steps] : kInverseCodings) {
    trips.Through(depth, {coding, static_cast<double>(1e-40f), 1, LengthUnit::kUnknown, steps},
                  outcome);
  }
  trips.AddTo(outcome);
  return outcome;
}

/// Of ten ranges, how often their ends come back changed: through a file, and rounded in memory.
double MovedEnds(DepthCoding coding, int steps, Outcome& outcome) {
  Random random(1);
  double moved = 0;
  for (int round = 0; round < 10; ++round) {
    const auto near_z = static_cast<float>(std::exp(random.Uniform(-7, 7)));
    const auto far_z = static_cast<float>(near_z * std::exp(random.Uniform(0.01, 12)));
    DepthImage depth(2, 1);
    depth(0, 0) = near_z;
    depth(1, 0) = far_z;
    const DepthFormat format{coding, near_z, far_z, LengthUnit::kUnknown, steps};
    moved += ThroughFile(depth, format, outcome).grid() != depth.grid();
    moved += io::RoundToCoding(depth, format).grid() != depth.grid();
  }
  return moved;
}

Outcome RangeEnds() {
  Outcome outcome;
  for (const auto& [coding, steps] : kInverseCodings) {
    outcome.Add(Exactly(std::string("ranges whose ends move, ") + io::NameOf(coding) + " of " +
                            std::to_string(steps) + " steps",
                        MovedEnds(coding, steps, outcome), 0, "the ends are exact by definition"));
  }
  return outcome;
}

Outcome NoNumbers() {
  Outcome outcome;
  for (const auto& [bad, name] :
       {std::pair{std::numeric_limits<float>::quiet_NaN(), "NaN"},
        std::pair{std::numeric_limits<float>::infinity(), "infinity"}, std::pair{-1.0f, "-1"}}) {
    DepthImage depth(2, 1);
    depth(0, 0) = bad;
    for (const auto& [coding, steps] : kCodings) {
      const DepthFormat format{coding, 1, 2, LengthUnit::kMetre, steps};
      ExpectRejection(outcome, std::string(name) + " as " + io::NameOf(coding),
                      [&] { ThroughFile(depth, format, outcome); });
    }
  }
  return outcome;
}

}  // namespace

std::vector<Case> DepthCodingCases() {
  return {{kDepthCodingStage, "all holes", true, AllHoles},
          {kDepthCodingStage, "a single pixel: alone, and among holes", true, SinglePixel},
          {kDepthCodingStage, "checkerboard of near and far, 1 : 600", true, Checkerboard},
          {kDepthCodingStage, "the end of the range, 65.535 m", true, EndOfMillimetres},
          {kDepthCodingStage, "the end of half floats, 65 504", true, EndOfHalf},
          {kDepthCodingStage, "the ends of random ranges", true, RangeEnds},
          {kDepthCodingStage, "denormals", true, Denormals},
          {kDepthCodingStage, "a range that begins at a denormal", true, RangeFromADenormal},
          {kDepthCodingStage, "NaN, infinity, negative depth", true, NoNumbers}};
}

}  // namespace dtr::selftest
