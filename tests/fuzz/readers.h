// tests/fuzz/readers.h -- every reader of files that strangers may have made, ready to be given bad
// ones.
#pragma once
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace dtr::fuzz {

/// A reader with a folder of its own, in which all other files that it wants are good.
struct Reader {
  std::filesystem::path file;      ///< what an input is written to before `read`
  std::vector<std::string> seeds;  ///< good contents of `file`, at least one
  std::function<void()> read;      ///< throws Error, and nothing else, for a file that is not good
  long buffer_bytes = 0;           ///< what a library takes beyond the input, whatever its size
};

/// OpenImageIO converts samples in a buffer of this size, however small the image.
inline constexpr long kImageBufferBytes = (64L << 20) + (1L << 17);

struct ReaderKind {
  const char* name;
  Reader (*open)(const std::filesystem::path& folder);  ///< `folder`: empty, its to fill
};

std::span<const ReaderKind> SetReaders();     ///< sets, their depth, meshes and points
std::span<const ReaderKind> CameraReaders();  ///< lists of cameras and float maps of other programs
std::span<const ReaderKind> SceneReaders();   ///< cameras and points of other programs
std::span<const ReaderKind> ColmapReaders();  ///< COLMAP's models, depth maps and database
std::span<const ReaderKind> CalibReaders();   ///< calibrations, captures, working files
std::span<const ReaderKind> WorkReaders();    ///< what a run leaves for the next one
std::span<const ReaderKind> ImageReaders();   ///< photos and masks, as far as they are ours
std::vector<ReaderKind> AllReaders();

}  // namespace dtr::fuzz
