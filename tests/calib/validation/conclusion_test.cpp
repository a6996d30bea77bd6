#include "calib/validation/conclusion.h"

#include <gmock/gmock.h>

#include <limits>

#include "calib/validation/photos.h"
#include "datasets/exact/bundle.h"
#include "tests/calib/validation/injected_faults.h"

namespace dtr::calib {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(LineOf, SaysWhichSideOfTheLimitIsGood) {
  EXPECT_EQ(LineOf(AtLeast("min_tilt_deg", 89.2, 15, "left: largest angle")),
            "passed min_tilt_deg: 89.2 (at least 15): left: largest angle");
  EXPECT_EQ(LineOf(AtMost("held_out_rms_px", 1.25, 1, "many")),
            "FAILED held_out_rms_px: 1.25 (at most 1): many");
  EXPECT_EQ(LineOf(NotTested("halves_ratio", 3, "too few")),
            "FAILED halves_ratio: not measured (at most 3): too few");
}

TEST(Conclusion, SaysWhatFailedAndWhatToDo) {
  const Check good = AtMost("held_out_rms_px", 0.2, 1, ""), few = AtLeast("min_views", 5, 8, "");
  EXPECT_EQ(Conclusion(std::vector{good}, Validated::kBoards),
            "validation passed: all tests (1) are within their limits");
  const std::string one = Conclusion(std::vector{good, few}, Validated::kBoards);
  EXPECT_THAT(one, HasSubstr("validation FAILED: 1 of 2 tests is beyond its limit: min_views 5 "
                             "(at least 8); take more photos of the board"));
  EXPECT_THAT(Conclusion({}, Validated::kPhotos), HasSubstr("FAILED: nothing could be tested"));
}

// The remedy is that of what causes the rest, wherever it stands in the list.
TEST(Conclusion, NamesACauseBeforeWhatItCauses) {
  std::vector<Check> tests;
  for (const char* name :
       {"image_shift_px", "halves_ratio", "stored_rms_px", "mean_residual_px", "degeneracies"}) {
    tests.push_back(AtMost(name, 9, 1, ""));
  }
  const std::string line = Conclusion(tests, Validated::kPhotos);
  EXPECT_THAT(line, HasSubstr("and 1 more; " + RemedyOf("degeneracies", Validated::kPhotos)));
  EXPECT_THAT(line, Not(HasSubstr("\n")));
}

TEST(AnswerLine, IsRightWrongOrNotDecidable) {
  const Check good = AtMost("held_out_rms_px", 0.2, 1, ""),
              few = AtMost("cameras_untested", 2, 0, "0003.jpg"),
              unmeasured = NotTested("halves_ratio", 3, "too few points"),
              bad = AtMost("camera_difference_sigmas", 35, 5, "0003.jpg: its stored pose");
  EXPECT_EQ(AnswerOf(std::vector{good}), Answer::kRight);
  EXPECT_EQ(AnswerLine(std::vector{good}, 16, 0.842),
            "right: 95 % of what 16 photos show lies within 0.84 px of where the other photos "
            "predict it");
  EXPECT_EQ(AnswerOf(std::vector{good, few, unmeasured}), Answer::kUndecided);
  EXPECT_THAT(
      AnswerLine(std::vector{few}, 16, 1),
      HasSubstr("not decidable: cameras_untested: 2 (at most 0): 0003.jpg; take more photos"));
  EXPECT_EQ(AnswerOf(std::vector{few, bad}), Answer::kWrong);
  EXPECT_THAT(AnswerLine(std::vector{few, bad}, 16, 1),
              HasSubstr("wrong: camera_difference_sigmas: 35 (at most 5): 0003.jpg"));
  EXPECT_EQ(AnswerOf({}), Answer::kUndecided);
}

// What no validation has made yet has no remedy; what one makes has.
TEST(RemedyOf, EveryTestHasOne) {
  EXPECT_EQ(RemedyOf("frobnicate", Validated::kBoards), "");
  const auto has_all = [](const std::vector<Check>& tests, Validated what) {
    for (const Check& test : tests) EXPECT_NE(RemedyOf(test.name, what), "") << test.name;
  };
  has_all(ValidateBoards(testing::Honest(1).calibration, {}, {}).tests, Validated::kBoards);
  has_all(ValidatePhotos(
              dtr::testing::bundle::MakeBundle({.images = 6, .points = 200, .noise_px = 0.3}), {})
              .tests,
          Validated::kPhotos);
  for (const char* name : {"test_rms_px", "test_rms_ratio", "rig_scale_sigmas"}) {
    EXPECT_NE(RemedyOf(name, Validated::kBoards), "") << name;
  }
  for (const char* name :
       {"held_out_rms_px", "worst_camera_rms_px", "worst_camera_ratio", "stored_rms_px",
        "mean_residual_px", "worst_camera_mean_residual_px", "impossible_share", "cameras_untested",
        "cross_depth_px", "worst_view_cross_depth_px", "rig_places_px", "given_cameras_px"}) {
    EXPECT_NE(RemedyOf(name, Validated::kPhotos), "") << name;
  }
}

}  // namespace
}  // namespace dtr::calib
