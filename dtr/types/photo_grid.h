// dtr/types/photo_grid.h -- which pixels of a photo with an EXIF orientation a camera describes.
#pragma once
#include <optional>

namespace dtr {

/// A program that calibrates photos takes them as they are stored (COLMAP, OpenCV), or rotated as
/// their EXIF orientation says.
enum class PhotoGrid { kStored, kUpright };

/// Size of a photo as stored and its EXIF orientation, 1..8.
struct StoredSize {
  int width_px = 0, height_px = 0;
  int exif_orientation = 1;

  /// The orientations 5 to 8 swap width and height.
  bool IsSideways() const { return exif_orientation >= 5; }
  int WidthOn(PhotoGrid grid) const { return Swapped(grid) ? height_px : width_px; }
  int HeightOn(PhotoGrid grid) const { return Swapped(grid) ? width_px : height_px; }

 private:
  bool Swapped(PhotoGrid grid) const { return grid == PhotoGrid::kUpright && IsSideways(); }
};

/// The grid of the photo that has this size; where both have it (square photos, the orientations 2
/// to 4) the one that `convention` names. Empty where neither has it.
inline std::optional<PhotoGrid> GridOfSize(int width_px, int height_px, const StoredSize& photo,
                                           PhotoGrid convention) {
  const PhotoGrid other =
      convention == PhotoGrid::kStored ? PhotoGrid::kUpright : PhotoGrid::kStored;
  for (const PhotoGrid grid : {convention, other}) {
    if (photo.WidthOn(grid) == width_px && photo.HeightOn(grid) == height_px) return grid;
  }
  return std::nullopt;
}

}  // namespace dtr
