#include "dtr/io/formats/scene_text.h"

#include "dtr/base/text_file.h"

namespace dtr::io::internal {
namespace {

constexpr std::uintmax_t kMaxSceneTextBytes = 512u << 20;

}  // namespace

SceneText::SceneText(const std::filesystem::path& file)
    : TextNumbers(ReadTextFile(file, kMaxSceneTextBytes), file.string()) {}

std::array<std::uint8_t, 3> SceneText::Colour() {
  std::array<std::uint8_t, 3> rgb{};
  for (std::uint8_t& channel : rgb) {
    channel = static_cast<std::uint8_t>(Int("a colour of 0 to 255", 0, 255));
  }
  return rgb;
}

}  // namespace dtr::io::internal
