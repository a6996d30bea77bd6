// datasets/convert/converters.h -- the converters behind ConvertDataset. Internal.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/sized_image.h"
#include "dtr/types/depth_image.h"

namespace dtr::datasets {

/// The folder a converter fills; images, depth and masks under their usual names.
class ConvertedFolder {
 public:
  explicit ConvertedFolder(std::filesystem::path folder);
  /// Copies an image to images/NAME, byte by byte.
  void CopyImage(const std::filesystem::path& from, const std::string& name) const;
  std::filesystem::path ImageFile(const std::string& name) const;
  /// Writes depth/STEM.exr for the photo `name` and returns its file name.
  std::string WriteDepth(const std::string& name, const DepthImage& depth_z) const;
  /// Writes masks/STEM.png for the photo `name` and returns its file name.
  std::string WriteMask(const std::string& name, const Mask& mask) const;

 private:
  std::filesystem::path folder_;
};

/// Name and size of an image of the source.
io::SizedImage ImageAt(const std::filesystem::path& folder, const std::string& name);

/// Names of the files in `folder` that end in `ending`, in byte order; throws Error if none does.
std::vector<std::string> FilesEndingIn(const std::filesystem::path& folder,
                                       const std::string& ending);

io::CameraList ConvertFountain(const std::filesystem::path& source, const ConvertedFolder& out);
io::CameraList ConvertDtu(const std::filesystem::path& source, const ConvertedFolder& out);
io::CameraList ConvertTemple(const std::filesystem::path& source, const ConvertedFolder& out);
io::CameraList ConvertFern(const std::filesystem::path& source, const ConvertedFolder& out);
io::CameraList ConvertPlaza(const std::filesystem::path& source, const ConvertedFolder& out);
io::CameraList ConvertLego(const std::filesystem::path& source, const ConvertedFolder& out);
io::CameraList ConvertLivingRoom(const std::filesystem::path& source, const ConvertedFolder& out);
io::CameraList Convert7Scenes(const std::filesystem::path& source, const ConvertedFolder& out);

}  // namespace dtr::datasets
