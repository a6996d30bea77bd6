#include "dtr/io/formats/scene_text.h"

#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::io::internal {
namespace {

constexpr std::uintmax_t kMaxSceneTextBytes = 512u << 20;

std::string WholeText(const std::filesystem::path& file) {
  std::string text = ReadFile(file, kMaxSceneTextBytes);
  if (!text.empty() && text.back() == '\n') return text;
  throw Error(file.string() +
              ": expected a line end at the end of the file, found none; the file is cut short "
              "(add the line end if it is not)");
}

}  // namespace

SceneText::SceneText(const std::filesystem::path& file)
    : TextNumbers(WholeText(file), file.string()) {}

std::array<std::uint8_t, 3> SceneText::Colour() {
  std::array<std::uint8_t, 3> rgb{};
  for (std::uint8_t& channel : rgb) {
    channel = static_cast<std::uint8_t>(Int("a colour of 0 to 255", 0, 255));
  }
  return rgb;
}

}  // namespace dtr::io::internal
