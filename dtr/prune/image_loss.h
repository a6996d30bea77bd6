// dtr/prune/image_loss.h -- what a change of a set costs, by what one sees.
#pragma once
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dtr/eval/held_out.h"
#include "dtr/render/camera_path.h"

namespace dtr::prune {

/// Makes a renderer again. One exists at a time: renderers with OpenGL own the current context.
using RendererMaker = std::function<eval::RenderFunction()>;

/// A place to look from. Where a photo was taken, it is there too.
struct Place {
  NovelCamera novel;
  ImageRgb8 photo;  ///< of the camera's size; empty: nobody has been there
  Mask mask;        ///< what counts of images from here; empty: all
  /// Ids of the source views whose place it is (one, and its copies); an image from here goes
  /// without them.
  std::vector<std::string> left_out;
};

/// The held-out photos of the set's first frame.
std::vector<Place> HeldOutPlaces(const DtrSet& set);
/// `count` source views spread evenly over the set in byte order of their ids (all where there are
/// fewer), to be left out when drawing from their places: of each photo a window of 1/crop of its
/// size per axis, at another part of the frame each time. Windows and not smaller images: these
/// would favour smaller images, since renderers do not filter.
std::vector<Place> LeftOutPlaces(const DtrSet& set, int count, int crop);
/// `count` of the source views that are not among `deciding`, spread as above, their photos whole;
/// where all decide, of all.
std::vector<Place> WitnessPlaces(const DtrSet& set, std::span<const Place> deciding, int count);
/// Of each camera a window of 1/crop of its image per axis, at another part each time.
std::vector<NovelCamera> Windows(std::vector<NovelCamera> cameras, int crop);
/// Places without photos.
std::vector<Place> NovelPlaces(const std::vector<NovelCamera>& cameras);

/// Images from the places, holes filled, without the source views in `without` and each place's
/// own; `coverage`, unless null, becomes what of each some view saw.
std::vector<ImageRgb8> Images(const DtrSet& set, std::span<const std::string> without,
                              std::span<const Place> places, const RenderOptions& options,
                              const eval::RenderFunction& render,
                              std::vector<Mask>* coverage = nullptr);

/// Mean squared differences of 8-bit values over all pixels that count at places with photos.
struct Errors {
  double before = 0, after = 0;   ///< of images against photos
  double change = 0;              ///< of images after against those before
  double psnr_loss_db = 0;        ///< mean over places of PSNR before - PSNR after
  double psnr_loss_error_db = 0;  ///< of that mean: StandardError
  /// Of a change of an image's pixels, the part that is new error: (after - before) / change. 1
  /// where it is independent of what was wrong already, 0 where it puts one error in the place of
  /// another. At least kMinShare: some of what is wrong here already is right elsewhere.
  double NewErrorShare() const;
};
inline constexpr double kMinShare = 0.25;
/// Of the mean of `values`, by their spread; 0 for fewer than two.
double StandardError(std::span<const double> values);
Errors CompareWithPhotos(std::span<const Place> places, std::span<const ImageRgb8> before,
                         std::span<const ImageRgb8> after);

/// For each place the mean squared difference, of what counts there, of images after and before.
std::vector<double> Changes(std::span<const Place> places, std::span<const ImageRgb8> before,
                            std::span<const ImageRgb8> after);

/// What changes mean from places that have no photo, in dB for each: 10 log10(1 + (share C + R) /
/// E). C (`recoded`): by how views are stored and drawn; E and share of the same from where photos
/// are. R (`removed`): by what is there no more. It counts whole: photos of views that are left out
/// in turn tell little of it, since there the view that shows a thing best is gone anyway.
std::vector<double> LossesDb(std::span<const double> recoded, std::span<const double> removed,
                             const Errors& where_photos_are);
double MeanOf(std::span<const double> values);  ///< 0 for none

}  // namespace dtr::prune
