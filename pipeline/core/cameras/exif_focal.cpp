#include "pipeline/core/cameras/exif_focal.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "calib/bundle/refine.h"
#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"

namespace dtr::pipeline {
namespace {

// Held-out observations are clearly better predicted where half of them lie nearer by this share.
constexpr double kClearlyBetter = 0.9;
// A model of fewer photos, or that explains fewer observations, than these shares of another's is
// no rival: what it left out could not contradict it.
constexpr double kEnoughPhotos = 0.75, kEnoughObservations = 0.5;

struct Attempt {
  PhotoRefinement refined;
  bool fixed = false;  // intrinsics held at EXIF's focal length
  double error_px = 0;
  int observations = 0;
};

Attempt Refined(const SfmRun& run, const CalibrateOptions& options, const sfm::SfmResult& sfm,
                const std::string& sfm_model, const std::string& folder, Progress& progress) {
  Attempt attempt;
  attempt.fixed = options.fixed_intrinsics;
  attempt.refined =
      RefinePhotos(run.capture, options, run.groups, sfm.model, run.workspace / "sfm" / sfm_model,
                   run.workspace / folder, progress);
  attempt.error_px =
      calib::HeldOutErrorPx(attempt.refined.model, options.seed, &attempt.observations);
  return attempt;
}

std::string WhyUndetermined(const SfmRun& run, const calib::SfmModel& model, Progress& progress) {
  calib::RefineOptions refine;
  refine.seed = run.options.seed;
  refine.progress = &progress;
  return calib::WhyUndetermined(model, refine);
}

// A model that was mapped with EXIF's focal length: free where the observations determine it, and
// then say what EXIF does.
Attempt FromExif(const SfmRun& run, const CalibrateOptions& options, const sfm::SfmResult& sfm,
                 const std::string& sfm_model, Progress& progress) {
  CalibrateOptions fixed = options;
  fixed.fixed_intrinsics = true;
  if (options.refine && WhyUndetermined(run, sfm.model, progress).empty()) {
    Attempt free = Refined(run, options, sfm, sfm_model, "refined_from_exif", progress);
    if (!ContradictsExif(free.refined.model, run.inputs)) return free;
  }
  return Refined(run, fixed, sfm, sfm_model, "refined_exif", progress);
}

std::string Line(const FocalContradiction& focal, const Attempt& taken, const Attempt* other) {
  std::string line = fmt::format(
      "focal length: EXIF gives {:.0f} px, structure from motion found "
      "{:.0f} px; ",
      focal.exif_px, focal.found_px);
  if (other == nullptr) return line;
  return line +
         fmt::format("held-out error {:.3g} px against {:.3g} px", taken.error_px, other->error_px);
}

// The focal length that lies furthest from EXIF's, by more than `log_limit` in the logarithm.
std::optional<FocalContradiction> FurthestFromExif(const calib::SfmModel& model,
                                                   const std::vector<sfm::SfmImageInput>& photos,
                                                   double log_limit) {
  std::map<std::string, double> prior_of;
  for (const sfm::SfmImageInput& photo : photos) {
    if (photo.focal_prior_px) prior_of[photo.name] = *photo.focal_prior_px;
  }
  std::map<std::uint32_t, std::vector<double>> priors;
  for (const calib::SfmImage& image : model.images) {
    const auto found = prior_of.find(image.name);
    if (found != prior_of.end()) priors[image.camera_id].push_back(found->second);
  }
  std::optional<FocalContradiction> worst;
  double most = log_limit;
  for (auto& [id, of_camera] : priors) {
    const double exif_px = UpperMedian(of_camera);
    const double found_px = model.cameras.at(id).params.front();
    const double off = std::abs(std::log(found_px / exif_px));
    if (!(off > most)) continue;
    most = off;
    worst = FocalContradiction{exif_px, found_px};
  }
  return worst;
}

bool IsEnough(size_t part, size_t of, double share) {
  return static_cast<double>(part) >= share * static_cast<double>(of);
}

PhotoRefinement Report(Attempt& taken, ExifFocal focal, bool exif_taken, const std::string& line,
                       Progress& progress) {
  focal.exif_taken = exif_taken;
  focal.focal_fixed = taken.fixed;
  taken.refined.report.exif_focal = focal;
  progress.Note(line);
  return std::move(taken.refined);
}

std::string Undetermined(const FocalContradiction& focal, const Attempt& exif) {
  return Line(focal, exif, nullptr) + "the observations do not determine it; " +
         (exif.fixed ? "EXIF's is used" : "EXIF's is taken and adjusted");
}

// Of a model whose observations do not determine its cameras, near EXIF's focal length as it may
// be: the one with EXIF's, where that is known of all photos. Empty: `sfm` is determined, or the
// other is no rival.
std::optional<PhotoRefinement> WithExifHeld(const SfmRun& run, const CalibrateOptions& options,
                                            sfm::SfmResult& sfm, Progress& progress) {
  const auto focal = FurthestFromExif(sfm.model, run.inputs, 0);
  if (!focal || WhyUndetermined(run, sfm.model, progress).empty()) return std::nullopt;
  auto fixed_sfm = sfm::MapWithFixedIntrinsics(run.workspace / "photos", run.inputs,
                                               run.workspace / "sfm", run.sfm_options, progress);
  if (!fixed_sfm ||
      !IsEnough(fixed_sfm->model.images.size(), sfm.model.images.size(), kEnoughPhotos)) {
    return std::nullopt;
  }
  Attempt exif = FromExif(run, options, *fixed_sfm, sfm::kFixedModel, progress);
  sfm.model = std::move(fixed_sfm->model);
  return Report(
      exif,
      {.exif_px = focal->exif_px, .found_px = focal->found_px, .exif_error_px = exif.error_px},
      true, Undetermined(*focal, exif), progress);
}

}  // namespace

std::optional<FocalContradiction> ContradictsExif(const calib::SfmModel& model,
                                                  const std::vector<sfm::SfmImageInput>& photos) {
  return FurthestFromExif(model, photos, std::log1p(kExifFocalError));
}

PhotoRefinement RefineSfm(const SfmRun& run, sfm::SfmResult& sfm, Progress& progress) {
  CalibrateOptions options = run.options;
  options.advice = sfm.report.lack_of_parallax;
  const bool given = options.rig || options.lens;
  const auto as_found = [&] {
    return RefinePhotos(run.capture, options, run.groups, sfm.model,
                        run.workspace / "sfm" / "model", run.workspace / "refined", progress);
  };
  if (given) return as_found();
  const auto report = [&](Attempt& taken, const ExifFocal& focal, bool exif_taken,
                          const std::string& line) {
    return Report(taken, focal, exif_taken, line, progress);
  };
  if (sfm.report.fixed_intrinsics) {
    Attempt taken = FromExif(run, options, sfm, "model", progress);
    const double focal_px = sfm.model.cameras.begin()->second.params.front();
    return report(taken, {.exif_px = focal_px}, true,
                  fmt::format("focal length: there is a sound model only with EXIF's {:.0f} px; {}",
                              focal_px, taken.fixed ? "it is fixed" : "adjusted afterwards"));
  }
  const auto contradiction = ContradictsExif(sfm.model, run.inputs);
  if (!contradiction) {
    try {
      return as_found();
    } catch (const Interrupted&) {
      throw;
    } catch (const Error&) {  // perhaps since the observations do not determine the cameras
      if (auto held = WithExifHeld(run, options, sfm, progress)) return std::move(*held);
      throw;
    }
  }
  ExifFocal focal{.exif_px = contradiction->exif_px, .found_px = contradiction->found_px};
  auto fixed_sfm = sfm::MapWithFixedIntrinsics(run.workspace / "photos", run.inputs,
                                               run.workspace / "sfm", run.sfm_options, progress);
  if (!fixed_sfm ||
      !IsEnough(fixed_sfm->model.images.size(), sfm.model.images.size(), kEnoughPhotos)) {
    Attempt taken = Refined(run, options, sfm, "model", "refined", progress);
    return report(taken, focal, false,
                  Line(*contradiction, taken, nullptr) +
                      "with EXIF's fewer photos are registered; the found one is taken");
  }
  const bool undetermined = !WhyUndetermined(run, sfm.model, progress).empty();
  Attempt exif = FromExif(run, options, *fixed_sfm, sfm::kFixedModel, progress);
  focal.exif_error_px = exif.error_px;
  if (!undetermined) {
    Attempt found = Refined(run, options, sfm, "model", "refined", progress);
    focal.found_error_px = found.error_px;
    const bool rival = IsEnough(static_cast<size_t>(found.observations),
                                static_cast<size_t>(exif.observations), kEnoughObservations);
    const bool exif_is_rival =
        IsEnough(static_cast<size_t>(exif.observations), static_cast<size_t>(found.observations),
                 kEnoughObservations);
    if (!exif_is_rival || (rival && found.error_px < kClearlyBetter * exif.error_px)) {
      return report(found, focal, false,
                    Line(*contradiction, found, &exif) +
                        "; the found one is taken (photos that were cropped or zoomed digitally?)");
    }
    sfm.model = std::move(fixed_sfm->model);
    return report(exif, focal, true,
                  Line(*contradiction, exif, &found) + "; " +
                      (exif.fixed ? "EXIF's is used" : "EXIF's is taken and adjusted"));
  }
  sfm.model = std::move(fixed_sfm->model);
  return report(exif, focal, true, Undetermined(*contradiction, exif));
}

}  // namespace dtr::pipeline
