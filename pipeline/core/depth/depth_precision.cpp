#include "pipeline/core/depth/depth_precision.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "dtr/base/order_statistics.h"
#include "dtr/io/depth_io.h"

namespace dtr::pipeline {
namespace {

constexpr double kSurestShare = 0.1;
const double kStepsPerDeviation = std::sqrt(12.0);  // of numbers rounded to steps of 1

}  // namespace

double RoundingInSigmas(const View& view) {
  if (!view.inverse_depth_sigma) return 0;
  const std::vector<float> sure =
      QuantilesOfPositive(view.inverse_depth_sigma->data(), std::array{kSurestShare});
  if (sure.empty()) return 0;
  const io::DepthRangeOfMap own = io::RangeOf(view.depth);
  const bool given = view.far_z > 0;  // else codes will span the map's own depths
  const double step =
      InverseDepthCode(given ? view.near_z : own.near_z, given ? view.far_z : own.far_z).step();
  return step / kStepsPerDeviation / static_cast<double>(sure.front());
}

void ChooseDepthCoding(View& view) {
  if (view.depth_coding != DepthCoding::kPng16InverseDepth) return;
  if (RoundingInSigmas(view) > kMaxRoundingInSigmas) view.depth_coding = DepthCoding::kExrFloat;
}

std::string SayDepthCodings(const std::vector<View>& views) {
  const auto with = [&](DepthCoding coding) {
    return std::count_if(views.begin(), views.end(), [&](const View& view) {
      return view.depth_file && view.depth_coding == coding;
    });
  };
  const auto in_16_bits = with(DepthCoding::kPng16InverseDepth),
             in_floats = with(DepthCoding::kExrFloat);
  if (in_floats > 0) {
    return fmt::format(
        "depth in floats in {} of {} views: asked for, or 16 bits would add to its error",
        in_floats, in_16_bits + in_floats);
  }
  if (in_16_bits == 0) return "";
  return fmt::format("depth in floats left out: 16 bits hold what is known in all {} views",
                     in_16_bits);
}

}  // namespace dtr::pipeline
