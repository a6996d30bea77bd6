// dtr/render/camera_path.h -- a fly-through between the cameras of a set.
#pragma once
#include <span>
#include <vector>

#include "dtr/render/free_space.h"
#include "dtr/types/camera.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/pose.h"

namespace dtr {

/// A camera to render from; `cam_from_world` acts on the set's stored world.
struct NovelCamera {
  PinholeCamera camera{1, 1, 1, 1, 0, 0};
  Pose cam_from_world;
};

/// A smooth path of `frames` cameras through source cameras of the set's first frame: they (of more
/// than 2048 so many at even steps by name) are chained to their nearest neighbours from an end of
/// the capture; of the chain's pieces whose steps are through free space (free_space.h) the longest
/// is thinned to 8 keys, or more where the path would leave free space, and joined by centripetal
/// Catmull-Rom positions (Yuksel et al. 2011) and squad rotations (Shoemake 1987), at even steps of
/// image motion: translation as a share of the scene's depth, and rotation. The first and last
/// frames are source cameras. All frames have the first key's intrinsics. `load_depth` reads the
/// depth of views that are not in memory; where no depth is known, no step is left out and steps
/// are even in distance. Deterministic; does not depend on the order of the views. Throws
/// dtr::UsageError when frames < 1 and dtr::Error when there is no source view.
std::vector<NovelCamera> FlyThrough(const DtrSet& set, int frames,
                                    const DepthLoader& load_depth = {});

/// The same through given cameras in their order, none left out. One key gives a path that stands
/// still. Throws dtr::UsageError when frames < 1 and std::invalid_argument without a key.
std::vector<NovelCamera> PathThrough(std::span<const NovelCamera> keys, int frames);

}  // namespace dtr
