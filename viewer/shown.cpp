#include "viewer/shown.h"

#include <algorithm>
#include <stdexcept>

#include "dtr/report/false_color.h"

namespace dtr::viewer {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

constexpr Rgb kSeen{230, 230, 230};

/// `colour_at` gives the colour of pixel index p, which some view saw.
template <typename ColourAt>
ImageRgb8 Painted(const RenderResult& result, const ColourAt& colour_at) {
  ImageRgb8 image(result.image.width(), result.image.height(), 3);
  for (size_t p = 0; p < result.coverage.data().size(); ++p) {
    const Rgb colour = result.coverage.data()[p] != 0 ? colour_at(p) : report::kHoleColor;
    std::copy(colour.begin(), colour.end(),
              image.data().begin() + static_cast<std::ptrdiff_t>(3 * p));
  }
  return image;
}

}  // namespace

const char* NameOf(Shown shown) {
  switch (shown) {
    case Shown::kColour:
      return "colour";
    case Shown::kDepth:
      return "depth";
    case Shown::kViewCount:
      return "view count";
    case Shown::kCoverage:
      return "coverage";
  }
  return "";
}

const char* LegendOf(Shown shown) {
  switch (shown) {
    case Shown::kColour:
      return "what the views show, blended";
    case Shown::kDepth:
      return "closer is brighter; green: no view saw it";
    case Shown::kViewCount:
      return "brighter: more views blended; green: none";
    case Shown::kCoverage:
      return "light: some view saw it; green: none did";
  }
  return "";
}

ImageRgb8 FalseColour(Shown shown, const RenderResult& result, int views) {
  switch (shown) {
    case Shown::kColour:
      break;
    case Shown::kDepth:
      return report::ColorizeDepth(result.depth);
    case Shown::kViewCount:
      return Painted(result, [&](size_t p) {
        return report::PaletteColor(
            report::Palette::kColor,
            static_cast<double>(result.view_count.data()[p]) / std::max(views, 1));
      });
    case Shown::kCoverage:
      return Painted(result, [](size_t) { return kSeen; });
  }
  throw std::invalid_argument("FalseColour: colours are not false");
}

}  // namespace dtr::viewer
