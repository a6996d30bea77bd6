// dtr/io/formats/npy.h -- arrays written by numpy.save.
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace dtr::io {

/// A numeric array in C order: the last index runs fastest.
struct NpyArray {
  std::vector<size_t> shape;
  std::vector<double> values;  ///< product of `shape` numbers
};

/// Reads a .npy file, format versions 1, 2 and 3 (numpy's NEP 1), of float32 or float64 in either
/// byte order, C or Fortran order. Throws Error when the header is damaged, the type another (no
/// pickled objects, ever), the shape does not fit the file's size exactly, or a value not finite.
NpyArray ReadNpy(const std::filesystem::path& file);

/// The same from the bytes of a file; `source` is what messages call it.
NpyArray ParseNpy(std::string_view bytes, const std::string& source);

}  // namespace dtr::io
