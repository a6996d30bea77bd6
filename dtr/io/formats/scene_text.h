// dtr/io/formats/scene_text.h -- large text files of cameras and points, with line numbers in the
// errors. Internal to dtr/io/formats.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>

#include "dtr/io/formats/text_numbers.h"

namespace dtr::io::internal {

/// Words and numbers of a text of up to 512 MB.
class SceneText : public TextNumbers {
 public:
  static constexpr int kMaxCount = 1 << 30;

  explicit SceneText(const std::filesystem::path& file);
  std::array<std::uint8_t, 3> Colour();  ///< three numbers of 0 to 255
};

}  // namespace dtr::io::internal
