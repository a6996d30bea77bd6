// pipeline/core/set_rig.h -- a calibrated rig behind the photos of a set.
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calib/bundle/rig_adjust.h"
#include "calib/sfm_model.h"
#include "capture/photo.h"
#include "dtr/types/check.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"

namespace dtr::pipeline {

/// A rig as `dtr calibrate rig` found it.
struct SetRig {
  std::string file;                        ///< its name, without folders
  std::vector<std::string> names;          ///< of the cameras
  calib::KnownRig known;                   ///< in the board's unit
  LengthUnit unit = LengthUnit::kUnknown;  ///< of that: metre where the board was given with one
};

/// The rig that the views of panoramas are (capture::SplitPanoramas): one centre, exact rotations
/// and intrinsics, no unit. Empty where the photos are no such views. Throws Error where some are
/// and some are not, or they differ in size.
std::optional<SetRig> RigOfPanoramas(const capture::Capture& capture);

/// Reads what `dtr calibrate rig` wrote. Throws UsageError unless it is a .json file that exists,
/// Error where it is broken or holds a single camera.
SetRig ReadSetRig(const std::filesystem::path& file);

/// Which camera took each photo and at which time step, by name (rig_names.h). Throws Error naming
/// the first photo that no camera of the rig took or that is not of its camera's size, and where no
/// time step was seen by two cameras that stand apart.
std::map<std::string, calib::RigPhoto> PhotosOfRig(const SetRig& rig,
                                                   const capture::Capture& capture);

/// Lets photos of one camera share a lens in structure from motion, which begins at the rig's
/// focal lengths.
void TellPhotosTheirLens(const SetRig& rig, capture::Capture& capture);

/// Bundle adjustment of `model` by calib::RefineRig. Cameras keep the ids that structure from
/// motion gave them. Throws Interrupted where `progress` asks for it.
calib::RigReport PlaceByRig(const SetRig& rig, const capture::Capture& capture,
                            calib::SfmModel& model, const Progress& progress);

/// The rig in a set's provenance, without its lenses; empty for sets that were built without a rig.
/// Throws Error where it is broken.
std::optional<SetRig> RigOfSet(const DtrSet& set);

/// `rig_places_px`: do the set's cameras stand to each other as the rig's do? Of every time step,
/// the points of a view, moved along when the rig's place (in the set's unit) relative to the time
/// step's first view replaces its own, in RMS pixels; the worst view. Views without observations
/// are left out; empty where no time step has two others, as after views were pruned.
std::optional<Check> RigPlaces(const DtrSet& set, const SparseScene& sparse, const SetRig& rig);

}  // namespace dtr::pipeline
