// calib/bundle/rig_adjust.h -- bundle adjustment of photos from cameras that are fixed to each
// other.
#pragma once
#include <map>
#include <span>
#include <string>
#include <vector>

#include "calib/bundle/adjust.h"
#include "calib/sfm_model.h"

namespace dtr::calib {

/// Which camera of the rig took an image, and at which time step.
struct RigImage {
  int frame = 0;
  Pose cam_from_rig;  ///< in the bundle's unit
};

/// As Adjust, but every frame is one unknown pose, rig_from_world: image i stands at
/// images[i].cam_from_rig * rig_from_world[frame], and the distances between a rig's cameras give
/// the scale. The bundle's own poses are replaced. Without priors on positions the gauge is near
/// the start's, held by nothing. `options` must not fix poses. Throws Error as Adjust does.
Adjusted AdjustRig(const Bundle& bundle, std::span<const RigImage> images,
                   const std::vector<Pose>& rig_from_world, const AdjustOptions& options);

/// A calibrated rig, as a model's photos meet it.
struct KnownRig {
  std::vector<LensCamera> lenses;
  std::vector<Pose> cam_from_rig;  ///< per camera, in the rig's unit
};

/// Whether all cameras of a rig stand in one point, as the views of a panorama do: no distance
/// gives a scale then.
bool HasOneCentre(const KnownRig& rig);

/// Camera (index into KnownRig) and time step of a photo.
struct RigPhoto {
  size_t camera = 0;
  std::string frame;
};

/// Per time step, rig_from_world that most of its images in `model` agree on, in the model's unit.
/// Of rigs with one centre.
std::map<std::string, Pose> RigPosesOf(const SfmModel& model, const KnownRig& rig,
                                       const std::map<std::string, RigPhoto>& photo_of);

/// What RefineRig did, without the model: numbers for records.
struct RigReport {
  double scale = 1;         ///< rig units per unit of the model that was given
  double scale_spread = 0;  ///< of single pairs of cameras: 1.4826 median deviation over the scale;
                            ///< of a rig with one centre: of the cameras' centres
  int frames = 0, pairs = 0;
  double free_sigma_px = 0;  ///< of the solve without the rig, lenses known
  AdjustSummary solve;       ///< with it
  int points_dropped = 0;
};

struct RigRefined : RigReport {
  SfmModel model;     ///< in the rig's unit; its cameras are the rig's, ids from 1
  Adjusted adjusted;  ///< of the solve with the rig; bundle emptied
};

/// Poses and points of a model, given the lenses and places of a rig: lenses are held, the model is
/// brought to the rig's unit by the cameras that saw a time step together, and all is adjusted with
/// every frame rigid. `photo_of` must know every image by name. A rig with one centre keeps the
/// model's unit; there the scatter is that of the centres, over the median distance of neighbouring
/// frames.
/// Throws Error where an image has another size than its camera, where no frame has two cameras
/// that stand apart, where the photos contradict the rig (single scales scatter by more than a
/// fifth, or the residuals grow by half or a tenth of the observations is lost for the rig), and
/// where a solve does not converge. `progress`: AdjustOptions::progress.
RigRefined RefineRig(const SfmModel& model, const KnownRig& rig,
                     const std::map<std::string, RigPhoto>& photo_of,
                     const Progress* progress = nullptr);

}  // namespace dtr::calib
