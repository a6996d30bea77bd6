// dtr/render/camera_path.h -- a fly-through between the cameras of a set.
#pragma once
#include <span>
#include <vector>

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
/// the capture, thinned to at most 8 keys, and joined by centripetal Catmull-Rom positions (Yuksel
/// et al. 2011) and squad rotations (Shoemake 1987), at even steps along the path. The first and
/// last frames are source cameras. All frames have the first key's intrinsics. Deterministic; does
/// not depend on the order of the views. Throws dtr::UsageError when frames < 1 and dtr::Error when
/// there is no source view.
std::vector<NovelCamera> FlyThrough(const DtrSet& set, int frames);

/// The same through given cameras in their order, none left out. One key gives a path that stands
/// still. Throws dtr::UsageError when frames < 1 and std::invalid_argument without a key.
std::vector<NovelCamera> PathThrough(std::span<const NovelCamera> keys, int frames);

}  // namespace dtr
