#include "calib/validation/conclusion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace dtr::calib {
namespace {

constexpr size_t kNamed = 4;  // failed tests that the sentence names

struct Remedy {
  const char* test;
  const char* what_to_do;
  bool is_of_evidence = false;  ///< the photos lack what the test needs; they contradict nothing
};

// In both tables causes stand before what they cause.

constexpr const char* kMoreViews =
    "take more photos of the board: near the borders of the image, tilted by 20 to 45 degrees to "
    "different sides";

constexpr Remedy kOfBoards[] = {
    {"boards_from_behind",
     "take photos that are not mirrored, and give the board as it is printed"},
    {"repeated_views", "leave out the photo that repeats another"},
    {"min_views", kMoreViews},
    {"min_coverage", kMoreViews},
    {"min_tilt_deg", kMoreViews},
    {"undetermined_terms",
     "choose a camera model without the terms that are named (`model`), or take photos of the "
     "board where they show: near the borders of the image"},
    {"lens_difference_sigmas", "calibrate again; the stored intrinsics are not those of the board"},
    {"place_difference_sigmas", "calibrate again; a camera of the rig was moved since"},
    {"rig_scale_sigmas", "measure the squares of the board, and calibrate again with their size"},
    {"time_offset_sigmas",
     "synchronise the cameras, or calibrate with cameras that take their images when they like "
     "(`clocks` free)"},
    {"unsteady_clocks_px", "synchronise the cameras"},
    {"rolling_shutter_px", "hold the board still while a photo is taken"},
    {"board_shape_px", "glue the board to something flat"},
    {"outlier_share", "leave out the photos whose corners are outliers"},
    {"test_rms_px", "calibrate again, with photos as sharp as these"},
    {"held_out_rms_px",
     "leave out the worst photos; sharp photos of a flat board that stands still "
     "have less than this"},
    {"test_rms_ratio", "calibrate again, with photos from the distances and directions of these"},
    {"held_out_rms_ratio", kMoreViews},
    {"worst_region_ratio",
     "take photos of the board in that region, or choose another camera model"},
    {"radial_pattern_px", "choose a camera model with more terms (`model`)"},
    {"regional_pattern_px", "choose a camera model with more terms (`model`), or a flatter board"},
    {"projection_uncertainty_px", kMoreViews},
    {"far_projection_uncertainty_px",
     "take photos of the board from farther away, too, or do not use the camera for what is far"},
    {"min_halves_p", kMoreViews},
};

constexpr const char* kMorePhotos =
    "take more photos between those named and their neighbours, or leave those named out";
constexpr const char* kAgain = "calibrate again from the photos, or leave out the photo named";
constexpr const char* kCameraModel =
    "give the camera, calibrated with a board (`lens`), or another camera model (`lens_model`)";

constexpr Remedy kOfPhotos[] = {
    {"given_cameras_px", "correct the cameras that were given as the test's line says"},
    {"degeneracies",
     "take photos as docs/VALIDATION.md says for what is named, or give the camera (`lens`)", true},
    {"undetermined_terms",
     "give the cameras less freedom: photos of one camera and zoom share their intrinsics "
     "(`camera_per` folder), or give the camera (`lens`)",
     true},
    {"photos_not_validated", kMorePhotos, true},
    {"cameras_untested", kMorePhotos, true},
    {"impossible_share", kAgain},
    {"worst_camera_rms_px", kAgain},
    {"worst_camera_ratio", kAgain},
    {"worst_camera_mean_residual_px", kAgain},
    {"mean_residual_px",
     "calibrate again, or see whether the program that made the cameras has the same pixel "
     "centres"},
    {"rig_places_px", "a camera of the rig was moved since: calibrate the rig again"},
    {"camera_difference_sigmas", kAgain},
    {"lens_difference_sigmas",
     "calibrate again from the photos, or import with `refine`, which adjusts given cameras"},
    {"rolling_shutter_px", "hold the camera still, or take photos in the place of video frames"},
    {"radial_pattern_px", kCameraModel},
    {"regional_pattern_px", kCameraModel},
    {"halves_ratio", kCameraModel},
    {"held_out_rms_px", kCameraModel},
    {"stored_rms_px", kAgain},
    {"image_shift_px", "take more photos, from more sides, of what the view named shows", true},
    {"cross_depth_px", "compute the depth maps again (dtr stereo), or calibrate again"},
    {"worst_view_cross_depth_px",
     "look at the depth map of the view named (dtr inspect); leave it out, or calibrate again"},
};

std::span<const Remedy> RemediesFor(Validated what) {
  return what == Validated::kBoards ? std::span<const Remedy>(kOfBoards)
                                    : std::span<const Remedy>(kOfPhotos);
}

std::string ValueAndLimit(const Check& test) {
  const std::string limit = fmt::format("{} {:.4g}", LimitWords(test), test.limit);
  return std::isnan(test.value) ? fmt::format("not measured ({})", limit)
                                : fmt::format("{:.4g} ({})", test.value, limit);
}

std::string Measured(const Check& test) {
  return fmt::format("{}: {}: {}", test.name, ValueAndLimit(test), test.reason);
}

struct Cause {
  const Check* test;
  std::string what_to_do;
};

// The failed test that explains the others.
Cause CauseOf(std::span<const Check> failed, Validated what) {
  for (const Remedy& remedy : RemediesFor(what)) {
    const auto test = std::find_if(failed.begin(), failed.end(),
                                   [&](const Check& t) { return t.name == remedy.test; });
    if (test != failed.end()) return {&*test, remedy.what_to_do};
  }
  return {&failed.front(), "docs/VALIDATION.md says what each test measures"};
}

std::vector<Check> FailedOf(std::span<const Check> tests) {
  std::vector<Check> failed;
  std::copy_if(tests.begin(), tests.end(), std::back_inserter(failed),
               [](const Check& test) { return !test.passed; });
  return failed;
}

bool IsOfEvidence(const Check& test) {
  const auto named = std::find_if(std::begin(kOfPhotos), std::end(kOfPhotos),
                                  [&](const Remedy& remedy) { return test.name == remedy.test; });
  return std::isnan(test.value) || (named != std::end(kOfPhotos) && named->is_of_evidence);
}

}  // namespace

std::string LineOf(const Check& test) {
  return fmt::format("{} {}", ResultWord(test.passed), Measured(test));
}

std::string RemedyOf(const std::string& test, Validated what) {
  for (const Remedy& remedy : RemediesFor(what)) {
    if (test == remedy.test) return remedy.what_to_do;
  }
  return "";
}

std::string Conclusion(std::span<const Check> tests, Validated what) {
  if (tests.empty()) {
    return fmt::format("validation {}: nothing could be tested", ResultWord(false));
  }
  const std::vector<Check> failed = FailedOf(tests);
  if (failed.empty()) {
    return fmt::format("validation {}: all tests ({}) are within their limits", ResultWord(true),
                       tests.size());
  }
  std::string named;
  for (size_t i = 0; i < std::min(kNamed, failed.size()); ++i) {
    named += fmt::format("{}{} {}", i == 0 ? "" : ", ", failed[i].name, ValueAndLimit(failed[i]));
  }
  if (failed.size() > kNamed) named += fmt::format(" and {} more", failed.size() - kNamed);
  return fmt::format("validation {}: {} of {} tests {}: {}; {}", ResultWord(false), failed.size(),
                     tests.size(),
                     failed.size() == 1 ? "is beyond its limit" : "are beyond their limits", named,
                     CauseOf(failed, what).what_to_do);
}

Answer AnswerOf(std::span<const Check> tests) {
  const std::vector<Check> failed = FailedOf(tests);
  if (failed.empty()) return tests.empty() ? Answer::kUndecided : Answer::kRight;
  return std::all_of(failed.begin(), failed.end(), IsOfEvidence) ? Answer::kUndecided
                                                                 : Answer::kWrong;
}

std::string AnswerLine(std::span<const Check> tests, size_t photos, double within_px) {
  if (tests.empty()) return "not decidable: nothing could be tested";
  if (AnswerOf(tests) == Answer::kRight) {
    return fmt::format(
        "right: 95 % of what {} photos show lies within {:.2g} px of where the other photos "
        "predict "
        "it",
        photos, within_px);
  }
  std::vector<Check> failed = FailedOf(tests);
  const bool is_wrong = AnswerOf(tests) == Answer::kWrong;
  if (is_wrong) std::erase_if(failed, IsOfEvidence);
  // Without a mistake that it names it says less than any other test.
  const auto is_vague = [](const Check& test) {
    return test.name == "given_cameras_px" && test.reason.find(" px with ") == std::string::npos;
  };
  if (!std::all_of(failed.begin(), failed.end(), is_vague)) std::erase_if(failed, is_vague);
  const Cause cause = CauseOf(failed, Validated::kPhotos);
  return fmt::format("{}: {}; {}", is_wrong ? "wrong" : "not decidable", Measured(*cause.test),
                     cause.what_to_do);
}

}  // namespace dtr::calib
