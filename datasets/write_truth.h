// datasets/write_truth.h -- internal: what a collection holds of one view beside its photo.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "datasets/make.h"
#include "datasets/render_truth.h"
#include "datasets/scene.h"

namespace dtr::datasets {

/// How view `i` is photographed; its noise has the seed `noise_seed`.
PhotoOptions PhotoOptionsOf(const DatasetSpec& spec, int i, std::uint64_t noise_seed);

/// depth/STEM.exr, masks/STEM_visible.png and masks/STEM_texture.png below `folder` of
/// `poses[i]`; `light` is that of its photo by `options`.
void WriteViewTruth(const DatasetSpec& spec, const Scene& scene, const std::vector<Pose>& poses,
                    int i, const Grid<float>& light, const PhotoOptions& options,
                    const std::filesystem::path& folder, const std::string& stem);

/// Throws UsageError naming the field that is out of range.
void CheckSpec(const DatasetSpec& spec);

}  // namespace dtr::datasets
