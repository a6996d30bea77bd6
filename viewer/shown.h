// viewer/shown.h -- what the pixels of the image mean.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "dtr/render/camera_path.h"
#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "dtr/render/scene.h"
#include "dtr/types/dtr_set.h"
#include "viewer/probe.h"

namespace dtr::viewer {

enum class Shown { kColour, kDepth, kSigma, kWeights, kViewCount, kCoverage, kWireframe };
inline constexpr std::array kAllShown{Shown::kColour,   Shown::kDepth,     Shown::kSigma,
                                      Shown::kWeights,  Shown::kViewCount, Shown::kCoverage,
                                      Shown::kWireframe};

/// As people and scripts call it: "colour", "depth", ...
const char* NameOf(Shown shown);
/// One line that says how to read it.
const char* LegendOf(Shown shown);

using Rgb = std::array<std::uint8_t, 3>;

/// The colours by which kWeights and wireframes tell views apart: of one set always the same,
/// whatever is drawn from. Views of one name at several time steps share one. Neighbours differ.
class ViewColours {
 public:
  ViewColours() = default;
  explicit ViewColours(const DtrSet& set);
  /// Of a source view of that set; black for others.
  Rgb Of(const View& view) const;

 private:
  std::map<std::string, Rgb> by_name_;
};

/// What was drawn, and of what.
struct Drawn {
  const RenderResult& result;
  const RenderScene& scene;
  const NovelCamera& camera;
  const RenderOptions& options;
  const ViewColours& colours;
};

/// Values at the dark and the bright end of report::Palette::kColor.
struct Scale {
  enum class Unit { kLength, kShare, kViews };
  double dark = 0, bright = 0;
  Unit unit = Unit::kLength;
};
/// A value as text: "1.25 m", "0.4 %", "8 views". `length_unit`: "m" or "units".
std::string TextOf(double value, Scale::Unit unit, const std::string& length_unit);

struct FalseColours {
  ImageRgb8 image;
  std::optional<Scale> scale;  ///< none where colours stand for no number
};
/// False colours; pixels that no view saw have report::kHoleColor. Not for kColour, which is the
/// image itself, nor for kWireframe, which keeps meshes (viewer/wireframe.h).
FalseColours FalseColour(Shown shown, const Drawn& drawn, const SigmaOf& sigma_of);

}  // namespace dtr::viewer
