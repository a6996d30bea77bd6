// capture/photo.h -- what was photographed: photos and what is known of them before calibration.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/contents.h"
#include "dtr/io/image_io.h"
#include "dtr/types/grid.h"
#include "dtr/types/photo_grid.h"

namespace dtr::capture {

/// What may be wrong with a photo.
enum class Fault { kBlurred, kOverexposed, kUnderexposed, kDuplicate };

/// "blurred", "overexposed", "underexposed", "duplicate".
std::string NameOf(Fault fault);
/// The fault of that name; empty for any other text.
std::optional<Fault> FaultCalled(const std::string& name);

/// What the pixels and bytes of a photo say about its use. It is reported, never acted upon here.
struct Screening {
  /// Variance of the 4-neighbour Laplacian over the variance of the brightness itself: falls with
  /// blur, does not change with contrast. 0 for a photo of one colour.
  double sharpness = 0;
  double overexposed_share = 0;   ///< of the usable pixels: those with a channel at 254 or 255
  double underexposed_share = 0;  ///< pixels with all channels at 0 or 1
  /// Name of the best photo with the same bytes or of the same image (BestCopy); empty where it is
  /// that itself.
  std::string duplicate_of;
  std::vector<Fault> faults;
  std::vector<std::string> remarks;  ///< one line for each fault, with the measure that says so
  /// Luma of the whole photo on at most 64x64 pixels, 1/256 levels; not stored with a capture.
  Grid<std::uint16_t> thumbnail;
};

/// Where a frame of a video comes from.
struct VideoFrame {
  std::string video;  ///< file name
  int number = 0;     ///< from 0
  double time_s = 0;  ///< when the video shows it
};

/// Which pinhole view of which panorama a photo is (split_panoramas.h).
struct FaceOfPanorama {
  std::string panorama;  ///< name of the panorama that was split
  std::string face;      ///< PanoramaFace::name
};

/// What the alpha channel of a photo's file says, where it is not opaque throughout.
struct PhotoAlpha {
  std::int64_t transparent_px = 0;
  std::int64_t partial_px = 0;  ///< neither transparent nor opaque: usable from one half up
  bool masks = false;           ///< some pixels are not usable
};

/// One photo. Sizes and pixels are meant upright, after the EXIF orientation, unless `as_stored`.
struct Photo {
  std::string id;    ///< unique, also where case is ignored; letters, digits, '_' and '-' only
  std::string name;  ///< original path below the photo folder, '/' between parts; kept for ever
  std::filesystem::path file;
  int width_px = 0, height_px = 0;
  int exif_orientation = 1;  ///< of `file`, 1..8
  /// Size and pixels are those of the file, its EXIF orientation not applied (TakeAsStored).
  bool as_stored = false;

  std::optional<double> focal_prior_px;  ///< a first guess for the calibration
  std::string focal_source = "none";     ///< "exif-35mm", "exif-focal-plane" or "none"
  /// make|model|size|focal length, with |orientation where the camera was turned: photos that are
  /// equal in this share a lens. Photos without EXIF share one if they have the same size.
  std::string camera_group;
  std::string make, model, lens_model;
  std::string date_time;  ///< "YYYY:MM:DD HH:MM:SS" or empty
  std::optional<io::GpsPosition> gps;

  /// Of raw files: the white balance to develop it with, one for all of a camera.
  std::optional<io::RawBalance> raw_balance;
  std::optional<VideoFrame> video_frame;
  std::optional<io::PanoramaXmp> panorama;  ///< what its file states; not stored with a capture
  std::optional<FaceOfPanorama> face;       ///< of a panorama that was split

  /// What of the photo may be used, NAME_mask.EXT beside NAME.EXT: an upright image of its size,
  /// dark where the photo is not to be used (moving things, the photographer, the turntable).
  /// Empty: all of it.
  std::filesystem::path mask_file;
  std::string mask_sha256;  ///< of that file, or empty
  std::optional<PhotoAlpha> alpha;
  /// Whether part of the photo is not to be used, by its mask file or its alpha.
  bool HasMask() const { return !mask_file.empty() || (alpha && alpha->masks); }

  double read_bytes = 0;      ///< io::ImageHeader::read_bytes; not stored with a capture: 0
  std::string source_sha256;  ///< of the original file
  std::optional<Screening> screening;
};

/// A file that looked like a photo and is none.
struct Skipped {
  std::string name;
  std::string reason;
};

/// What of a file was converted on the way, or is not used: one line each. The rest of it is used.
struct Remark {
  std::string name;
  std::string text;
};

/// Photos in byte order of their names.
struct Capture {
  std::vector<Photo> photos;
  std::vector<Skipped> skipped;
  std::vector<Remark> remarks;
  FolderContents contents;  ///< of the folder that the photos come from; counts alone if stored
};

/// Takes out the photos that have one of these faults and lists them under `skipped`. Where the one
/// that others are duplicates of has another of them, the best of its duplicates stays.
void DropFaulty(Capture& capture, const std::vector<Fault>& faults);

/// What a camera group says of turned photos, with the orientation behind it.
inline constexpr char kTurnedGroup[] = "|turned";
/// Whether EXIF data turned the photo upright, or a capture that it comes from did.
bool IsTurned(const Photo& photo);

/// Memory that a photo takes while it is looked at, rotated or written, bytes.
double MemoryOf(const Photo& photo);
/// Throws Error where that is more than the limit, 1e9 bytes (0: none).
void RequireMemoryFor(const Photo& photo, double memory_gb);

/// Size of the file's pixels, before the EXIF orientation.
StoredSize StoredSizeOf(const Photo& photo);

/// The photo as its file stores it, for cameras that were found in such pixels. Nothing changes
/// where it has no EXIF orientation.
void TakeAsStored(Photo& photo);

/// A scene needs two photos. Throws Error naming `where`, the number found and what was skipped.
void RequireEnoughPhotos(const Capture& capture, const std::filesystem::path& where);

/// The photo upright (or as stored, where the photo says so), 8-bit sRGB, without colours that its
/// alpha hides (io::ReadImageAndMask). Throws Error when the file is unreadable or has no longer
/// the size it had when it was ingested.
ImageRgb8 ReadPhoto(const Photo& photo);

/// What of the photo may be used, on the photo's grid, by its mask file and by its alpha, which
/// must both allow it; empty where it has neither. A mask is an upright image, but one that fits
/// only the photo as it is stored is taken as that. Throws Error when the mask is unreadable, is
/// not of the photo's size, or nothing is left.
Mask ReadPhotoMask(const Photo& photo);

/// Both at once, with what the alpha says whatever `photo` tells of it.
struct PhotoPixels {
  ImageRgb8 image;
  Mask mask;
  std::optional<PhotoAlpha> alpha;
};
PhotoPixels ReadPhotoAndMask(const Photo& photo);

/// One line about the alpha of the photos; empty where none has any.
std::string AlphaLine(const std::vector<Photo>& photos);

}  // namespace dtr::capture
