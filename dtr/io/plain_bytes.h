// dtr/io/plain_bytes.h -- internal to dtr/io: numbers as they lie in memory, little endian.
#pragma once
#include <bit>
#include <string>

namespace dtr::io {

static_assert(std::endian::native == std::endian::little, "bytes are copied as they lie in memory");

template <typename T>
void Append(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

}  // namespace dtr::io
