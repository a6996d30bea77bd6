// dtr/io/still_once.h -- depth of a dynamic set in which what stands still is stored once.
#pragma once
#include <filesystem>

#include "dtr/base/progress.h"
#include "dtr/types/dtr_set.h"

namespace dtr::io {

/// Stores depth, completed depth and sigma of each camera (views of equal name) again: once the
/// codes that most time steps have at each pixel (files in still/), and of each time step the
/// differences to them (docs/FORMAT.md, section 4.3). All numbers stay the same to the bit. Kinds
/// of data whose codings differ between time steps, or that take no fewer bytes so, stay as they
/// are. `set`: its files lie in `set_folder`; entries of the files are replaced, meshes of depth
/// stored again are taken away. Files of before stay where they are; those of differences have
/// names of their own. Cameras in memory at a time take at most `memory_gb` (GB of 1e9 bytes). The
/// same bytes for any number of threads. Throws Error as LoadPixels.
void StoreStillOnce(const std::filesystem::path& set_folder, DtrSet& set, double memory_gb,
                    Progress& progress);

}  // namespace dtr::io
