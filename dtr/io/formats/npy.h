// dtr/io/formats/npy.h -- arrays written by numpy.save.
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "dtr/types/grid.h"

namespace dtr::io {

/// A numeric array in C order: the last index runs fastest.
struct NpyArray {
  std::vector<size_t> shape;
  std::vector<double> values;  ///< product of `shape` numbers
  bool whole_numbers = false;  ///< of an integer type
};

/// What else than finite float32 and float64 is read.
struct NpyOptions {
  bool half = false;             ///< float16
  bool integers = false;         ///< of 8, 16 and 32 bits, signed or not
  bool any_value = false;        ///< NaN and infinity too
  size_t max_values = 1u << 27;  ///< larger arrays are rejected before they are allocated
};

/// Reads a .npy file, format versions 1, 2 and 3 (numpy's NEP 1), of float32 or float64 in either
/// byte order, C or Fortran order. Throws Error when the header is damaged, the type another (no
/// pickled objects, ever), the shape does not fit the file's size exactly, or a value not finite;
/// `options` allow more.
NpyArray ReadNpy(const std::filesystem::path& file, const NpyOptions& options = {});

/// The same from the bytes of a file; `source` is what messages call it.
NpyArray ParseNpy(std::string_view bytes, const std::string& source,
                  const NpyOptions& options = {});

/// Whether a .npy file holds an integer type. Throws Error as ReadNpy does for a damaged header.
bool NpyHoldsWholeNumbers(const std::filesystem::path& file);

/// Writes float32 of shape (height, width), or (height, width, channels), in C order, little
/// endian, format version 1; atomic. Throws Error when the file cannot be written.
void WriteNpy(const std::filesystem::path& file, const Grid<float>& grid);

}  // namespace dtr::io
