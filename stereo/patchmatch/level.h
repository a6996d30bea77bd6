// stereo/patchmatch/level.h -- one level of the pyramid: images, projections, planes.
#pragma once
#include <span>
#include <vector>

#include "stereo/engine.h"
#include "stereo/patchmatch/kernel.h"
#include "stereo/sgbm/grey_image.h"

namespace dtr::stereo::patchmatch {

/// A neighbour's images from full size down, as textures.
struct SourcePyramid {
  const StereoView* view = nullptr;
  std::vector<PinholeCamera> cameras;
  std::vector<Texture> textures;
  const PlaneMap* surface = nullptr;  ///< its planes at full size, if known; borrowed
};

/// The image and its halvings, `levels` in all. Requires sizes of at least 2^(levels - 1).
std::vector<GreyImage> Pyramid(GreyImage full, int levels);

/// Throws Error for photos wider than kWidestTexture.
SourcePyramid MakeSource(const StereoView& view, int levels);

/// Sets up matching `reference` (a level's image of `view`) with the sources' images at
/// `index`.
Level MakeLevel(const StereoView& view, const GreyImage& reference,
                std::span<const SourcePyramid> sources, size_t index, const DepthRange& range,
                std::uint64_t seed);

/// Planes of nothing: cost infinite everywhere, equal weights.
State EmptyState(const Level& level);

/// Planes of all pixels in scene units, and back; weights and costs are not kept.
PlaneMap PlanesOf(const Level& level, const State& state, const DepthRange& range);
State StateOf(const Level& level, const PlaneMap& map, const DepthRange& range);

/// Which pixels of a level, a block of `side` x `side` pixels of the mask each, hold one that is
/// open; `open` covers the level, as the image of the view does.
BorderedGrid OpenPixels(const Level& level, const Mask& open, int side);

/// A plane at every pixel, as a suggestion; w is 0 where `map` has none.
State::Hypothesis HypothesisOf(const Level& level, const PlaneMap& map, const DepthRange& range);

/// Planes of a coarser level on the grid of the next finer one.
State Upsampled(const State& coarse, const Level& coarse_level, const Level& level);

}  // namespace dtr::stereo::patchmatch
