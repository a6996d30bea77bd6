// The pure half of depth_io.h: depths to codes and back.
#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <span>
#include <sstream>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "dtr/io/depth_io.h"
#include "dtr/types/inverse_depth_code.h"

namespace dtr::io {
namespace {

constexpr double kMillimetres = 1000;     // codes per metre
constexpr float kHalfMax = 65504;         // largest finite half
constexpr float kHalfMin = 0x1.0p-14f;    // smallest half with full precision
constexpr double kNarrowestRange = 1e-3;  // relative width of the range of a map of one depth

std::string Pixel(int x, int y) {
  return "depth pixel (" + std::to_string(x) + ", " + std::to_string(y) + ")";
}

std::string Number(double value) {
  std::ostringstream out;
  out.precision(9);  // enough to tell any two floats apart
  out << value;
  return out.str();
}

void ExpectRange(double near_z, double far_z) {
  if (InverseDepthCode::IsRange(near_z, far_z)) return;
  throw Error("depth range: expected 0 < near < far, found near " + Number(near_z) + ", far " +
              Number(far_z));
}

void ExpectSteps(int steps) {
  if (steps >= 1 && steps <= InverseDepthCode::kSteps) return;
  throw Error("depth steps: expected 1 to " + std::to_string(InverseDepthCode::kSteps) +
              ", found " + std::to_string(steps));
}

// Calls `visit(x, y, z)` for every pixel with depth. Only 0 may stand for a hole: NaN, infinity
// and negative numbers come from a slip further up and must not be stored as honest holes.
template <typename Visit>
void ForEachDepth(const DepthImage& depth, const Visit& visit) {
  if (depth.empty() || depth.kind() != DepthKind::kPlaneZ) {
    throw Error("depth map: expected plane z, found " +
                std::string(depth.empty() ? "an empty map" : "ray distances"));
  }
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      const float z = depth(x, y);
      if (z == 0) continue;
      if (DepthImage::IsHole(z)) {
        throw Error(Pixel(x, y) + ": expected a positive finite depth or 0, found " + Number(z));
      }
      visit(x, y, z);
    }
  }
}

void ExpectWithin(int x, int y, float z, double low, double high) {
  if (z >= static_cast<float>(low) && z <= static_cast<float>(high)) return;
  throw Error(Pixel(x, y) + ": expected a depth in [" + Number(low) + ", " + Number(high) +
              "], found " + Number(z));
}

// Nearest half, as float; `z` must be in half's normal range. Ties to even, like F16C and IEEE 754.
float RoundToHalf(float z) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(z);
  constexpr int kDropped = 13;  // 23 mantissa bits of float, 10 of half
  const std::uint32_t odd = (bits >> kDropped) & 1u;
  const std::uint32_t rounded = bits + ((1u << (kDropped - 1)) - 1u) + odd;
  return std::bit_cast<float>(rounded & ~((1u << kDropped) - 1u));
}

}  // namespace

const char* NameOf(DepthCoding coding) {
  switch (coding) {
    case DepthCoding::kExrFloat:
      return "exr-float";
    case DepthCoding::kExrHalf:
      return "exr-half";
    case DepthCoding::kPng16Millimetre:
      return "png16-mm";
    case DepthCoding::kZstdInverseDepth:
      return "zstd-inverse";
    case DepthCoding::kPng16InverseDepth:
      break;
  }
  return "png16-inverse";
}

DepthCoding DepthCodingFromName(const std::string& name) {
  for (const auto coding :
       {DepthCoding::kExrFloat, DepthCoding::kExrHalf, DepthCoding::kPng16Millimetre,
        DepthCoding::kPng16InverseDepth, DepthCoding::kZstdInverseDepth}) {
    if (name == NameOf(coding)) return coding;
  }
  throw UsageError(
      "depth coding: expected exr-float, exr-half, png16-mm, png16-inverse or zstd-inverse, "
      "found '" +
      name + "'");
}

const char* ExtensionOf(DepthCoding coding) {
  if (coding == DepthCoding::kZstdInverseDepth) return ".dtz";
  return coding == DepthCoding::kExrFloat || coding == DepthCoding::kExrHalf ? ".exr" : ".png";
}

DepthFormat CompletedFormatOf(const View& view) {
  return {DepthCoding::kZstdInverseDepth, view.completed_near_z, view.completed_far_z,
          LengthUnit::kUnknown, view.completed_steps};
}

std::string DepthHashOf(const View& view) {
  if (!view.completed_file) return view.depth_file->sha256;
  const std::string both = view.depth_file->sha256 + view.completed_file->sha256;
  return Sha256(std::as_bytes(std::span(both)));
}

DepthFormat FormatOf(const View& view, LengthUnit unit) {
  DepthFormat format{view.depth_coding, view.near_z, view.far_z, unit};
  if (view.depth_coding == DepthCoding::kZstdInverseDepth) format.steps = view.depth_steps;
  return format;
}

Grid<std::uint16_t> EncodeInverseDepth(const DepthImage& depth, double near_z, double far_z,
                                       int steps) {
  ExpectRange(near_z, far_z);
  ExpectSteps(steps);
  const InverseDepthCode code(near_z, far_z, steps);
  Grid<std::uint16_t> codes;
  ForEachDepth(depth, [&](int x, int y, float z) {
    ExpectWithin(x, y, z, near_z, far_z);
    if (codes.empty()) codes = Grid<std::uint16_t>(depth.width(), depth.height());
    codes(x, y) = code.Encode(z);
  });
  return codes.empty() ? Grid<std::uint16_t>(depth.width(), depth.height()) : codes;
}

DepthImage DecodeInverseDepth(const Grid<std::uint16_t>& codes, double near_z, double far_z,
                              int steps) {
  ExpectRange(near_z, far_z);
  ExpectSteps(steps);
  const InverseDepthCode code(near_z, far_z, steps);
  std::vector<float> depth_of(static_cast<size_t>(steps) + 2);  // few codes, many pixels
  for (size_t c = 0; c < depth_of.size(); ++c) {
    depth_of[c] = code.Decode(static_cast<std::uint16_t>(c));
  }
  DepthImage depth(codes.width(), codes.height());
  std::transform(codes.data().begin(), codes.data().end(), depth.grid().data().begin(),
                 [&](std::uint16_t c) {
                   if (c < depth_of.size()) return depth_of[c];
                   throw Error("depth codes: expected at most " + std::to_string(steps + 1) +
                               ", found " + std::to_string(c));
                 });
  return depth;
}

namespace {

// The steps; none where 16 bits or float32 are not that exact.
std::optional<int> StepsKeeping(double near_z, double far_z, double error) {
  ExpectRange(near_z, far_z);
  // Reading back rounds z to float32, which moves 1/z by 2^-24 of itself at most (and a little, as
  // the nearest code was found with rounded numbers).
  const double of_step = error - 0x1.02p-24 / near_z;
  const double steps = std::ceil((1 / near_z - 1 / far_z) / (2 * of_step));
  if (of_step > 0 && steps <= InverseDepthCode::kSteps) return std::max(1, static_cast<int>(steps));
  return {};
}

// `error` without what the view's coding may have rounded already.
double ErrorLeft(const View& view, double error) {
  const DepthFormat format = FormatOf(view, LengthUnit::kUnknown);
  const bool in_steps = format.coding == DepthCoding::kPng16InverseDepth ||
                        format.coding == DepthCoding::kZstdInverseDepth;
  if (in_steps) error -= InverseDepthCode(view.near_z, view.far_z, StepsOf(format)).step() / 2;
  return error;
}

}  // namespace

int StepsForError(double near_z, double far_z, double error) {
  if (const auto steps = StepsKeeping(near_z, far_z, error)) return *steps;
  throw Error("depth error: expected a bound that 16 bits can keep over depths of " +
              Number(near_z) + " to " + Number(far_z) + ", found " + Number(error) +
              " of inverse depth; allow a larger one");
}

void SetDepthError(View& view, double error) {
  view.depth_steps = StepsForError(view.near_z, view.far_z, ErrorLeft(view, error));
  view.depth_coding = DepthCoding::kZstdInverseDepth;
  ClampToRange(view);
}

bool TrySetDepthError(View& view, double error) {
  if (!StepsKeeping(view.near_z, view.far_z, ErrorLeft(view, error))) return false;
  SetDepthError(view, error);
  return true;
}

void ClampToRange(View& view) {
  const auto near = static_cast<float>(view.near_z), far = static_cast<float>(view.far_z);
  for (float& z : view.depth.grid().data()) {
    if (!DepthImage::IsHole(z)) z = std::clamp(z, near, far);
  }
}

Grid<std::uint16_t> EncodePng16Millimetre(const DepthImage& depth_m) {
  Grid<std::uint16_t> codes;
  ForEachDepth(depth_m, [&](int x, int y, float z) {
    const double code = std::round(z * kMillimetres);
    if (code < 1 || code > UINT16_MAX) {
      throw Error(Pixel(x, y) + ": expected a depth in [0.001, 65.535] m for png16-mm, found " +
                  Number(z) + "; choose another depth coding");
    }
    if (codes.empty()) codes = Grid<std::uint16_t>(depth_m.width(), depth_m.height());
    codes(x, y) = static_cast<std::uint16_t>(code);
  });
  return codes.empty() ? Grid<std::uint16_t>(depth_m.width(), depth_m.height()) : codes;
}

DepthImage DecodePng16Millimetre(const Grid<std::uint16_t>& codes) {
  DepthImage depth(codes.width(), codes.height());
  for (size_t i = 0; i < codes.data().size(); ++i) {
    depth.grid().data()[i] = static_cast<float>(codes.data()[i] / kMillimetres);
  }
  return depth;
}

int StepsOf(const DepthFormat& format) {
  return format.coding == DepthCoding::kZstdInverseDepth ? format.steps : InverseDepthCode::kSteps;
}

DepthImage RoundToCoding(const DepthImage& depth, const DepthFormat& format) {
  switch (format.coding) {
    case DepthCoding::kPng16InverseDepth:
    case DepthCoding::kZstdInverseDepth: {
      const int steps = StepsOf(format);
      return DecodeInverseDepth(EncodeInverseDepth(depth, format.near_z, format.far_z, steps),
                                format.near_z, format.far_z, steps);
    }
    case DepthCoding::kPng16Millimetre:
      if (format.unit != LengthUnit::kMetre) {
        throw Error("depth coding png16-mm: expected a set in metres; choose another depth coding");
      }
      return DecodePng16Millimetre(EncodePng16Millimetre(depth));
    case DepthCoding::kExrHalf: {
      DepthImage rounded = depth;
      ForEachDepth(depth, [&](int x, int y, float z) {
        if (z < kHalfMin || z > kHalfMax) {
          throw Error(Pixel(x, y) +
                      ": expected a depth in [6.10352e-05, 65504] for exr-half, found " +
                      Number(z) + "; choose another depth coding");
        }
        rounded(x, y) = RoundToHalf(z);
      });
      return rounded;
    }
    case DepthCoding::kExrFloat:
      break;
  }
  ForEachDepth(depth, [](int, int, float) {});  // rejects what no coding may hold
  return depth;
}

DepthRangeOfMap RangeOf(const DepthImage& depth) {
  DepthRangeOfMap range{HUGE_VAL, 0};
  ForEachDepth(depth, [&](int, int, float z) {
    range.near_z = std::min<double>(range.near_z, z);
    range.far_z = std::max<double>(range.far_z, z);
  });
  if (range.far_z == 0) return {};
  if (range.near_z == range.far_z) range.far_z *= 1 + kNarrowestRange;
  return range;
}

}  // namespace dtr::io
