// pipeline/core/photos/named_files.h -- files on disk that a camera file of another program
// means.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dtr/io/formats/sized_image.h"

namespace dtr::pipeline {

/// False too where nobody may look.
bool IsFile(const std::filesystem::path& file);

/// The names that a path of another program may have below `folder`, likeliest first: as it is,
/// with
/// '/' for '\', and without leading folders that `folder` itself ends with (images/a.jpg in
/// .../images). Names that leave the folder are left out.
std::vector<std::string> NamesMeant(const std::filesystem::path& folder, const std::string& path);

/// The first of NamesMeant that is a file below `folder`; `path` itself where none is.
std::string NameBelow(const std::filesystem::path& folder, const std::string& path);

/// The image below `folder` that `path` means; a path without an extension, as in NeRF's own files,
/// means the one image called so. Empty where there is none. Throws Error for one that is no image.
std::optional<io::SizedImage> FindImage(const std::filesystem::path& folder,
                                        const std::string& path);

/// An image by its name below `folder`. Throws Error where it is none.
io::SizedImage SizedImageAt(const std::filesystem::path& folder, const std::string& name);

}  // namespace dtr::pipeline
