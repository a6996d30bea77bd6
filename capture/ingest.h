// capture/ingest.h -- a folder of photos becomes a Capture.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "capture/photo.h"
#include "dtr/base/progress.h"

namespace dtr::capture {

struct IngestOptions {
  bool recurse = true;  ///< photos of sub-folders too, as COLMAP takes them
  /// Tell photos from what belongs to them (SortImages); false: every image is a photo.
  bool sort = true;
  /// Decode every photo: finds damaged ones now instead of hours later, and measures the rest.
  bool screen = true;
  /// Photos in memory at a time take at most so many 1e9 bytes, and one that alone takes more is
  /// skipped; 0: no bound.
  double memory_gb = 0;
};

/// The photos of a folder in byte order of their names. A photo is a file with the extension of an
/// image format that OpenImageIO reads (any case) which SortImages takes for a photo: copies,
/// masks, depth maps and other maps of a project's folder are none. What is ignored is counted in
/// Capture::contents, and one Note of `progress` says all counts. Skipped, with the reason: files
/// that should be photos but hold no readable image, names that are no UTF-8, links to folders, and
/// sub-folders that are D+TR sets or captures. A photo whose mask cannot be used is skipped. A
/// folder that WriteCapture made is read as that capture, with its original names. The result is
/// the same for any number of threads. Throws UsageError when the folder does not exist, Error when
/// it cannot be listed or holds no photo at all.
Capture IngestPhotos(const std::filesystem::path& folder, const IngestOptions& options,
                     Progress& progress);

/// What IngestPhotos would find in a folder, by names and samples alone: for commands that look at
/// its photos in another way. Counts no cameras. Throws as WalkFolder does.
FolderContents ContentsOf(const std::filesystem::path& folder, bool recurse);
/// The same by the kinds of files alone: every image counts as a photo.
FolderContents ContentsOfFiles(const std::filesystem::path& folder, bool recurse);

/// Whether a folder is one that this program made: a set, a capture, an export (kExportFile), the
/// workspace of a calibration, unfinished work. Its images are photos, or made from them, that lie
/// elsewhere.
bool IsOwnFolder(const std::filesystem::path& folder);

/// A focal length in pixels and where it comes from.
struct FocalPrior {
  std::optional<double> focal_px;
  std::string source = "none";
};

/// Focal length from EXIF. First choice is the 35 mm equivalent, by the diagonal as CIPA DCG-001
/// defines it and current COLMAP reads it: f35 * diagonal_px / 43.27 mm. (COLMAP 3.8 takes
/// f35 * long_side_px / 35 mm: 3 % more for 3:2 photos, 1 % less for 4:3.) Else the focal length in
/// millimetres times the pixels per millimetre of FocalPlaneXResolution. A result outside
/// [0.1, 100] times the long side is a broken tag and is not taken.
FocalPrior FocalFromExif(const io::ImageHeader& header);

/// True for the extension of an image format that OpenImageIO reads, with or without the dot, in
/// any case. Video and volume formats are no image formats here.
bool IsImageExtension(const std::string& extension);
/// The same for raw files of cameras.
bool IsRawExtension(const std::string& extension);
/// The same for the videos that are read, with the dot.
bool IsVideoExtension(const std::string& extension);
/// The same for those that cameras write beside a video of full resolution.
bool IsProxyVideoExtension(const std::string& extension);

}  // namespace dtr::capture
