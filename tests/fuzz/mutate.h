// tests/fuzz/mutate.h -- bad files out of good ones.
#pragma once
#include <string>
#include <vector>

#include "dtr/base/random.h"

namespace dtr::fuzz {

/// One of `corpus`, changed in one to eight places: bits, bytes, whole numbers of 1 to 8 bytes
/// (either byte order), numbers written as text, pieces taken out, doubled, moved or put in from
/// another file, ends cut off. At most `limit_bytes` long.
std::string Mutated(const std::vector<std::string>& corpus, Random& random, size_t limit_bytes);

}  // namespace dtr::fuzz
