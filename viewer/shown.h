// viewer/shown.h -- what the pixels of the picture mean.
#pragma once
#include <array>

#include "dtr/render/camera_path.h"
#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "dtr/render/scene.h"
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

/// What was drawn, and of what.
struct Drawn {
  const RenderResult& result;
  const RenderScene& scene;
  const NovelCamera& camera;
  const RenderOptions& options;
};

/// A false-colour picture; unseen pixels have report::kHoleColor. Not for kColour, which is the
/// picture itself, nor for kWireframe, which keeps meshes (viewer/wireframe.h).
ImageRgb8 FalseColour(Shown shown, const Drawn& drawn, const SigmaOf& sigma_of);

/// The colour that kWeights gives a view, by its index into the scene's views: neighbours differ.
std::array<std::uint8_t, 3> ViewColour(int index);

}  // namespace dtr::viewer
