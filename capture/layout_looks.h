// capture/layout_looks.h -- internal to capture: what the pixels of an image say it is.
#pragma once
#include <filesystem>
#include <map>
#include <string>

#include "dtr/types/grid.h"

namespace dtr::capture {

/// The header of an image, upright; width_px 0: it is none.
struct ImageSize {
  int width_px = 0, height_px = 0;
  bool one_channel = false;
  bool deep = false;  ///< more than 8 bits or float
  bool jpeg = false;
};

/// What a sample of its pixels says.
struct ImageLook {
  bool readable = false;
  bool grey = false;     ///< all channels alike
  bool binary = false;   ///< grey, and dark or bright but for the seams
  bool normals = false;  ///< unit vectors as colours
  bool labels = false;   ///< few colours, no noise
  Grid<std::uint8_t> thumbnail;
};

/// Reads each file at most once.
class Looks {
 public:
  explicit Looks(const std::filesystem::path& folder) : folder_(folder) {}
  const ImageSize& SizeOf(const std::string& name);
  const ImageLook& LookOf(const std::string& name);

  /// Whether `smaller` has the size of `larger` divided by one factor, which is above 1.
  bool IsReducedSize(const std::string& smaller, const std::string& larger);
  /// How far two images differ, of the contrast of the first; infinite where one is unreadable.
  double Difference(const std::string& a, const std::string& b);

 private:
  std::filesystem::path folder_;
  std::map<std::string, ImageSize> sizes_;
  std::map<std::string, ImageLook> looks_;
};

}  // namespace dtr::capture
