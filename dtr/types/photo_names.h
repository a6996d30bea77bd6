// dtr/types/photo_names.h -- photos as people name them.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace dtr {

/// Indices of the photos in `names` that somebody may mean by `word`: the one called exactly so, or
/// else those called so without their extension. More than one: nobody knows which is meant.
std::vector<size_t> PhotosCalled(std::span<const std::string> names, const std::string& word);

}  // namespace dtr
