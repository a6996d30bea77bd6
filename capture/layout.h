// capture/layout.h -- which images of a project's folder are its photos.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "capture/contents.h"
#include "capture/photo.h"

namespace dtr::capture {

/// The images of a folder, sorted by their part in it.
struct Layout {
  std::vector<std::string> photos;           ///< sorted
  std::map<std::string, std::string> masks;  ///< by the photo's name
  std::vector<Skipped> skipped;
  FolderContents contents;  ///< what was ignored is added; photos, masks and depth maps counted
};

/// Tells photos from what belongs to them, in folders as COLMAP, nerfstudio, mip-NeRF 360,
/// Meshroom, OpenDroneMap, RGB-D recorders and others lay them out.
///
/// Images belong together when their names are equal but for words for a kind of image (images,
/// masks, depth, normals, ...) in the name or in the folders above. Images that say that they were
/// rendered (io::IsRendered) are none, unless all do. Among the others are
/// - masks: NAME_mask.EXT beside NAME.EXT; else grey images called masks, or of two values only
///   (0 and 255) in a folder beside the photos, of the photo's size. They become the masks of their
///   photos;
/// - depth maps: 16-bit or float images of one channel, or images called depth;
/// - normal maps and label maps, by their values; confidence maps and previews, by their words
///   where their values agree, as "normal" and "preview" are names of cameras and exposures too;
/// - reduced copies: images of a folder that holds names of another one, smaller by one factor in
///   both axes, which show the same (in a comparison of thumbnails);
/// - other copies of the same size: those that show the same, or that lie in what a program is
///   known to write (COLMAP's undistorted images, OpenDroneMap's, Meshroom's results);
/// - raw files beside a developed photo of their name.
/// Folders of several cameras with equal names show different things, and all stay photos. What a
/// folder holds is decided by several samples that agree: a camera may begin in the dark. Images
/// that take more than `memory_gb` to read (1e9 bytes; 0: no bound) are taken for photos.
Layout SortImages(const std::filesystem::path& folder, const std::vector<std::string>& images,
                  FolderContents contents, double memory_gb = io::kImageMemoryGb);

}  // namespace dtr::capture
