#include "dtr/io/stored_bytes.h"

#include "dtr/base/error.h"
#include "dtr/io/oiio_files.h"

namespace dtr::io {

Grid<std::uint8_t> ReadStoredBytes(const std::filesystem::path& file, std::uint64_t limit_px) {
  const auto in = OpenImage(file, {limit_px});
  const ImageFacts& facts = in->facts();
  if (facts.sample != Sample::kUint8) {
    throw Error(file.string() + ": expected an image of 8 bits, found one of " + facts.sample_name);
  }
  Grid<std::uint8_t> bytes(facts.width, facts.height);
  ReadPixels(*in, file, 0, 1, Sample::kUint8, bytes.data().data());
  return bytes;
}

}  // namespace dtr::io
