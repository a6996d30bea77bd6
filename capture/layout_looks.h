// capture/layout_looks.h -- internal to capture: what the pixels of an image say it is.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "capture/layout_names.h"
#include "dtr/types/grid.h"

namespace dtr::capture {

/// The header of an image, upright; width_px 0: it is none.
struct ImageSize {
  int width_px = 0, height_px = 0;
  bool one_channel = false;
  bool deep = false;  ///< more than 8 bits or float
  bool is_float = false;
  bool jpeg = false;
};

/// What a sample of its pixels says.
struct ImageLook {
  bool readable = false;
  bool grey = false;      ///< all channels alike
  bool binary = false;    ///< grey, and dark or bright but for the seams, or 0 and 1
  bool two_ends = false;  ///< holds both 0 and 255; an image that is dark all over does not
  bool normals = false;   ///< unit vectors as colours
  bool few_colours = false;
  bool flat = false;    ///< most pixels equal their neighbours, areas of 0 and of 255 left out
  bool labels = false;  ///< few colours in flat areas: neither noise nor shading
  Grid<std::uint8_t> thumbnail;
};

/// Reads each file at most once.
class Looks {
 public:
  /// `memory_gb`: as io::ImageReadOptions; images that take more are unreadable.
  Looks(const std::filesystem::path& folder, double memory_gb)
      : folder_(folder), memory_gb_(memory_gb) {}
  const ImageSize& SizeOf(const std::string& name);
  const ImageLook& LookOf(const std::string& name);

  /// What the pixels of these samples of a folder show without any word: masks, normal maps or
  /// label maps where all readable ones agree; else photos. A JPEG is a photo. `called_masks`: a
  /// word says so, and images that are dark or bright all over may be masks too.
  ImageKind KindOf(const std::vector<std::string>& samples, bool called_masks);

  /// Whether `smaller` has the size of `larger` divided by one factor, which is above 1.
  bool IsReducedSize(const std::string& smaller, const std::string& larger);
  /// How far two images differ, of the contrast of the first; infinite where one is unreadable.
  double Difference(const std::string& a, const std::string& b);

 private:
  std::filesystem::path folder_;
  double memory_gb_;
  std::map<std::string, ImageSize> sizes_;
  std::map<std::string, ImageLook> looks_;
};

}  // namespace dtr::capture
