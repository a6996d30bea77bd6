// dtr/io/shared_files.h -- internal to dtr/io: files of a dynamic set that are stored once.
#pragma once
#include "dtr/types/dtr_set.h"

namespace dtr::io {

/// Of files of equal content all source views name the first one's, whatever their time step.
/// Held-out views are left as they are: nothing here knows their hashes.
void ShareEqualFiles(DtrSet& set);

}  // namespace dtr::io
