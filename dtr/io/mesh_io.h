// dtr/io/mesh_io.h -- internal to dtr/io: the file of a view's reduced mesh (docs/FORMAT.md).
#pragma once
#include <filesystem>

#include "dtr/types/block_cover.h"

namespace dtr::io {

/// Writes the file atomically; throws Error for a mesh that ReadMesh would reject.
void WriteMesh(const std::filesystem::path& file, const StoredMesh& mesh);

/// Throws Error for anything but a whole and consistent file. Whether it is of a view's depth is
/// the caller's to ask.
StoredMesh ReadMesh(const std::filesystem::path& file);

}  // namespace dtr::io
