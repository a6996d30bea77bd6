// dtr/types/dtr_set.h -- a Depth + Texture Representation of a scene.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "dtr/types/view.h"

namespace dtr {

/// What one scene unit is. Nothing guesses it.
enum class LengthUnit { kUnknown, kArbitrary, kMetre };
/// "unknown", "arbitrary" or "metre", as files and people call it.
const char* NameOf(LengthUnit unit);

/// Axis-aligned box in the set's world frame; empty while min > max.
struct Bounds {
  Eigen::Vector3d min = Eigen::Vector3d::Constant(1);
  Eigen::Vector3d max = Eigen::Vector3d::Constant(-1);
  bool empty() const { return (min.array() > max.array()).any(); }
};

/// The views of one time step. A still scene has exactly one.
struct Frame {
  double time_s = 0;
  std::vector<View> views;
  std::string extra_json;  ///< fields this version does not know, kept verbatim ("" = none)
};

/// The set: what set.json says and, for loaded views, the pixels.
/// World frame: right-handed; a point p of the user's world is stored as p - world_origin, so that
/// float data stay small at any offset.
struct DtrSet {
  LengthUnit unit = LengthUnit::kUnknown;
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d scene_center =
      Eigen::Vector3d::Zero();  ///< from the data; angles are measured there
  Bounds bounds;
  std::vector<Frame> frames;
  std::optional<StoredFile> sparse_file;  ///< points and observations behind the calibration
  std::string provenance_json = "{}";     ///< source photos, engines, options, tool version
  std::string validation_json = "{}";     ///< what `validate` found; {} = not validated
  std::string extra_json;                 ///< unknown top-level fields, kept verbatim
};

}  // namespace dtr
