#include "dtr/io/oiio_files.h"

#include <OpenImageIO/filesystem.h>

#include <array>
#include <mutex>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/io/file_checks.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

// One line, without the full stop and line breaks that decoders add.
std::string OneLine(std::string text) {
  for (char& c : text) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.pop_back();
  return text;
}

// Our loops run over files, so OpenImageIO's own threads would only compete with them.
void SetUpOnce() {
  static std::once_flag once;
  std::call_once(once, [] {
    OIIO::attribute("threads", 1);
    OIIO::attribute("exr_threads", -1);
  });
}

// Photos come out 7 % larger than at zlib's own level 6, in a third of the time (docs/FORMAT.md).
constexpr int kPngLevel = 2;

}  // namespace

std::unique_ptr<OIIO::ImageInput> OpenImage(const fs::path& file, std::uint64_t limit_px,
                                            const std::optional<RawBalance>& raw_balance) {
  SetUpOnce();
  std::error_code error;
  if (!fs::is_regular_file(file, error)) {
    throw Error(file.string() + ": expected an image file, found " +
                (fs::exists(file, error) ? "something else" : "nothing"));
  }
  ExpectImageKind(file);
  ExpectWholeFile(file);
  OIIO::ImageSpec wishes;  // raw colours: alpha is dropped, not multiplied in
  wishes.attribute("oiio:UnassociatedAlpha", 1);
  // Of raw files: brightness as exposed, for neighbouring photos must show one surface alike.
  wishes.attribute("raw:auto_bright", 0);
  wishes.attribute("raw:adjust_maximum_thr", 0.0f);
  if (raw_balance) {
    const std::array<float, 4> factors{
        static_cast<float>((*raw_balance)[0]), static_cast<float>((*raw_balance)[1]),
        static_cast<float>((*raw_balance)[2]), static_cast<float>((*raw_balance)[1])};
    wishes.attribute("raw:use_camera_wb", 0);
    wishes.attribute("raw:user_mul", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 4), factors.data());
  }
  auto in = OIIO::ImageInput::open(file.string(), &wishes);
  if (!in) throw Error(file.string() + ": no readable image: " + OneLine(OIIO::geterror()));
  const OIIO::ImageSpec& spec = in->spec();
  if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0 || spec.depth > 1) {
    throw Error(file.string() + ": expected a flat image, found " + std::to_string(spec.width) +
                "x" + std::to_string(spec.height) + "x" + std::to_string(spec.depth) + " with " +
                std::to_string(spec.nchannels) + " channels");
  }
  const auto found_px =
      static_cast<std::uint64_t>(spec.width) * static_cast<std::uint64_t>(spec.height);
  if (found_px > limit_px) {
    throw Error(file.string() + ": expected at most " + std::to_string(limit_px) +
                " pixels, found " + std::to_string(spec.width) + "x" + std::to_string(spec.height));
  }
  ExpectPlausibleSize(file, spec.width, spec.height);
  return in;
}

void ReadPixels(OIIO::ImageInput& in, const fs::path& file, int first_channel, int end_channel,
                OIIO::TypeDesc type, void* pixels) {
  const bool read = in.read_image(0, 0, first_channel, end_channel, type, pixels);
  const std::string complaint = in.geterror();
  if (!read || !complaint.empty()) {
    throw Error(file.string() + ": damaged image: " + OneLine(complaint));
  }
}

std::string EncodeImage(const std::string& extension, const OIIO::ImageSpec& spec,
                        OIIO::TypeDesc type, const void* pixels) {
  SetUpOnce();
  const std::string name = "memory" + extension;
  auto out = OIIO::ImageOutput::create(name);
  OIIO::ImageSpec with_quality = spec;
  with_quality.attribute("png:compressionLevel", kPngLevel);
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  if (!out || !out->set_ioproxy(&memory) || !out->open(name, with_quality) ||
      !out->write_image(type, pixels) || !out->close()) {
    throw Error("image cannot be encoded as " + extension + ": " +
                OneLine(out ? out->geterror() : OIIO::geterror()));
  }
  return {bytes.begin(), bytes.end()};
}

void ExpectSize(const OIIO::ImageInput& in, const fs::path& file, int width_px, int height_px) {
  if (in.spec().width == width_px && in.spec().height == height_px) return;
  throw Error(file.string() + ": expected " + std::to_string(width_px) + "x" +
              std::to_string(height_px) + " pixels, found " + std::to_string(in.spec().width) +
              "x" + std::to_string(in.spec().height));
}

}  // namespace dtr::io
