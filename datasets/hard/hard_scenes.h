// datasets/hard/hard_scenes.h -- scenes with repeated structure; used by the hard sets only.
#pragma once
#include "datasets/scene.h"

namespace dtr::datasets {

/// A house of four facades whose opposite ones are equal, relief included, on a floor that is plain
/// or paved.
Scene HardHouse(bool plain_floor);

/// Two equal facades side by side before a wall.
Scene HardStreet();

}  // namespace dtr::datasets
