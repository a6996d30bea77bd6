// pipeline/core/depth/grid_files.h -- working files of float32 grids of one size.
#pragma once
#include <filesystem>
#include <initializer_list>
#include <span>

#include "dtr/types/grid.h"

namespace dtr::pipeline {

/// Bytes of a file: int32 width, height (both 0: no grids), a double that says what unit the values
/// have, then the grids' values as float32, row-major, in the host's byte order. The file appears
/// whole or not at all. Throws Error when it cannot be written.
void WriteGridFile(const std::filesystem::path& file, std::span<const Grid<float>* const> grids,
                   double unit = 1);

/// Reads it into `grids`, which stay empty when the file holds none, and returns the unit. Throws
/// Error naming the file when it is not what WriteGridFile writes, a number is not finite or the
/// unit is not positive.
double ReadGridFile(const std::filesystem::path& file, std::span<Grid<float>* const> grids);

}  // namespace dtr::pipeline
