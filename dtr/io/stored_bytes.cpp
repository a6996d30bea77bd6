#include "dtr/io/stored_bytes.h"

#include "dtr/base/error.h"
#include "dtr/io/oiio_files.h"

namespace dtr::io {

Grid<std::uint8_t> ReadStoredBytes(const std::filesystem::path& file, std::uint64_t limit_px) {
  const auto in = OpenImage(file, {limit_px});
  const OIIO::ImageSpec& spec = in->spec();
  if (spec.format.basetype != OIIO::TypeDesc::UINT8) {
    throw Error(file.string() + ": expected an image of 8 bits, found one of " +
                std::string(spec.format.c_str()));
  }
  Grid<std::uint8_t> bytes(spec.width, spec.height);
  ReadPixels(*in, file, 0, 1, OIIO::TypeDesc::UINT8, bytes.data().data());
  return bytes;
}

}  // namespace dtr::io
