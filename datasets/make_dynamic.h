// datasets/make_dynamic.h -- dynamic scenes on disk: what the fixed cameras of a rig saw, with
// truth for every time step.
#pragma once
#include <filesystem>

#include "datasets/make.h"
#include "dtr/base/progress.h"

namespace dtr::datasets {

/// Renders `spec.steps` time steps, spec.time_s + i / spec.steps_per_second, of spec.views cameras:
///   photos/camNN/TTTT.png    without loss; or, with spec.videos,
///   videos/camNN.mkv         the same frames, FFV1 in RGB (without loss), and
///   videos/timestamps.csv    sync_index, cam_id, frame_index: all clocks are one
///   rig.json                 the exact cameras in the form of `dtr calibrate rig`
///   truth/TTTT/              cameras.json (names camNN, world: the first camera), depth/camNN.exr,
///                            masks/camNN_visible.png and _texture.png as MakeDataset has them
///   dataset.json, SOURCE.md
/// Every photo has noise of its own. Throws as MakeDataset.
void MakeDynamicDataset(const DatasetSpec& spec, const std::filesystem::path& out_folder,
                        Progress& progress);

}  // namespace dtr::datasets
