// dtr/prune/judge.h -- what a change of a set costs, by what one sees.
#pragma once
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dtr/eval/held_out.h"
#include "dtr/render/camera_path.h"

namespace dtr::prune {

/// Makes a renderer anew. One exists at a time: renderers with OpenGL own the current context.
using RendererMaker = std::function<eval::RenderFunction()>;

/// Pictures from some cameras, holes filled, source views in `without` left out.
std::vector<ImageRgb8> Pictures(const DtrSet& set, std::span<const std::string> without,
                                std::span<const NovelCamera> cameras, const RenderOptions& options,
                                const eval::RenderFunction& render);

/// How far a set's pictures are from photos: the mean squared difference of 8-bit values, over all
/// pixels, holes filled, at photos it was not made from, or, where the set has none, at up to
/// `at_most` source views, each left out in turn. Photos are shrunk by `shrink` first.
double ErrorAgainstPhotos(const DtrSet& set, const RenderOptions& options, int shrink, int at_most,
                          const eval::RenderFunction& render);

/// PSNR of each held-out photo against the picture from its place, dB; empty where there are none.
std::vector<double> PhotoPsnr(const DtrSet& set, std::span<const std::string> without,
                              const RenderOptions& options, const eval::RenderFunction& render);

/// What a difference between pictures before and after a change means, as a loss of PSNR against
/// photos that nobody has from there, mean over the pictures in dB:
/// 10 log10(1 + D / E), D the mean squared difference of a picture and E that of pictures before
/// the change against photos (`error`): the change's error comes on top of what was wrong already.
/// It assumes the two errors independent; where photos exist they are asked themselves.
double LossDb(std::span<const ImageRgb8> before, std::span<const ImageRgb8> after, double error);

/// Cameras with pictures of 1/shrink the size.
std::vector<NovelCamera> Shrunk(std::vector<NovelCamera> cameras, int shrink);

}  // namespace dtr::prune
