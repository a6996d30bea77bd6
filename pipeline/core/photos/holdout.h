// pipeline/core/photos/holdout.h -- which photos are kept back to measure with.
#pragma once
#include <span>
#include <string>
#include <vector>

namespace dtr::pipeline {

/// For each of `names` (accepted photos in byte order) whether `spec` holds it out.
/// "": none. "every:N": index i with i % N == 0, N >= 2. Otherwise names separated by commas, each
/// with or without its extension.
/// Throws UsageError for a malformed spec, a name that is not there, or fewer than two photos left.
std::vector<bool> ChooseHeldOut(const std::string& spec, std::span<const std::string> names);

/// The same of views of panoramas: every:N counts panoramas, and a name (of a panorama, or of a
/// view of it) means all views of the panorama, as these may share pixels. `panorama_of`: per
/// photo, the panorama's name.
std::vector<bool> ChooseHeldOutPanoramas(const std::string& spec,
                                         std::span<const std::string> names,
                                         std::span<const std::string> panorama_of);

/// Whether `spec` holds out the photo called `name` by its name.
bool IsNamed(const std::string& spec, const std::string& name);

}  // namespace dtr::pipeline
