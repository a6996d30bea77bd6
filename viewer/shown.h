// viewer/shown.h -- what the pixels of the picture mean.
#pragma once
#include <array>

#include "dtr/render/result.h"
#include "dtr/types/grid.h"

namespace dtr::viewer {

enum class Shown { kColour, kDepth, kViewCount, kCoverage };
inline constexpr std::array kAllShown{Shown::kColour, Shown::kDepth, Shown::kViewCount,
                                      Shown::kCoverage};

/// As people and scripts call it: "colour", "depth", ...
const char* NameOf(Shown shown);
/// One line that says how to read it.
const char* LegendOf(Shown shown);

/// A false-colour picture of what was drawn with up to `views` views; unseen pixels have
/// report::kHoleColor. Not for kColour, which is the picture itself.
ImageRgb8 FalseColour(Shown shown, const RenderResult& result, int views);

}  // namespace dtr::viewer
