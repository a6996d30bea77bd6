// dtr/io/sparse_io.h -- the sparse points behind a calibration (docs/FORMAT.md, section 6).
#pragma once
#include <filesystem>

#include "dtr/types/sparse_scene.h"

namespace dtr::io {

/// Writes points and observations, little-endian; the same scene gives the same bytes. Atomic.
/// Throws Error when a number is not finite, an index is out of range or the observations are not
/// sorted by (view, point).
void WriteSparse(const std::filesystem::path& file, const SparseScene& scene);

/// Reads them back. Throws Error when the file is cut short, too long, of another version, or
/// breaks one of WriteSparse's rules. View indices are only checked for being non-negative.
SparseScene ReadSparse(const std::filesystem::path& file);

}  // namespace dtr::io
