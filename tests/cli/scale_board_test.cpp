// `dtr calibrate scale --board` on a set of rendered photos of a board whose size is known.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "calib/solve/board_solve.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "tests/calib/boards/rendered_board.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

using Json = nlohmann::json;

constexpr double kUnit = 0.4;  // metres that a unit of the set is
constexpr int kViews = 6;
constexpr char kBoardText[] = "chessboard:7x5:30mm";
const PinholeCamera kCamera(480, 360, 520, 520, 240, 180);

// From all sides, 0.5 m away, in metres.
Pose CamFromBoard(const calib::Board& board, int i) {
  const double about = 2 * std::numbers::pi * i / kViews;
  Pose pose;
  pose.rotation = Eigen::AngleAxisd(0.45, Eigen::Vector3d(std::cos(about), std::sin(about), 0)) *
                  Eigen::AngleAxisd(0.1 * i, Eigen::Vector3d::UnitZ());
  pose.translation = Eigen::Vector3d(0.01 * i, -0.01, 0.5) - pose.rotation * calib::MiddleOf(board);
  return pose;
}

class ScaleByBoard : public ::testing::Test {
 protected:
  // A set of these photos, in the first `shown` of which the board is to be seen; in those of
  // `moved` it lies 3 to 5 cm aside, each time elsewhere.
  void MakeSet(const std::string& name, const std::vector<int>& moved = {}, int shown = kViews) {
    const calib::Board board = calib::BoardFromText(kBoardText);
    const auto photos = folder_ / (name + "_photos");
    std::filesystem::create_directories(photos);
    io::CameraList list;
    for (int i = 0; i < kViews; ++i) {
      const Pose pose = CamFromBoard(board, i);
      Pose seen = pose;
      const bool elsewhere = std::find(moved.begin(), moved.end(), i) != moved.end();
      if (elsewhere)
        seen =
            pose * Pose{Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.03, 0.02 * (i - 3), 0)};
      const auto grey =
          calib::testing::Photo(board, kCamera, seen, 1, static_cast<std::uint64_t>(i));
      ImageRgb8 image(grey.width(), grey.height(), 3);
      for (int y = 0; y < grey.height(); ++y) {
        for (int x = 0; x < grey.width(); ++x) {
          for (int c = 0; c < 3; ++c) image(x, y, c) = i < shown ? grey(x, y) : 128;
        }
      }
      io::NamedCamera camera;
      camera.name = fmt::format("{:04}.png", i);
      camera.camera = kCamera;
      camera.cam_from_world = {pose.rotation, pose.translation / kUnit};
      camera.depth_file = fmt::format("{:04}.exr", i);
      io::WriteImage(photos / camera.name, image);
      // Nothing here looks at depth, but a set tells where its scene is: the board's distance.
      Grid<float> depth(grey.width(), grey.height());
      std::fill(depth.data().begin(), depth.data().end(), static_cast<float>(0.5 / kUnit));
      io::WriteExr(photos / camera.depth_file, depth);
      list.cameras.push_back(std::move(camera));
    }
    io::WriteCamerasJson(folder_ / (name + ".json"), list);
    DtrOk({"import", "--cameras", In(name + ".json"), "--images", photos.string(), "--depth",
           photos.string(), "-o", In(name)});
  }
  std::string In(const std::string& name) const { return (folder_ / name).string(); }
  Ran Scale(const std::string& set, const std::string& board) {
    return Dtr(
        {"calibrate", "scale", In(set), "--board", board, "-o", In("metric.dtr"), "--json", "-"});
  }
  TemporaryFolder folder_;
};

TEST_F(ScaleByBoard, TheBoardMakesTheSetMetric) {
  MakeSet("still.dtr");
  const Ran ran = Scale("still.dtr", kBoardText);
  ASSERT_EQ(ran.code, 0) << ran.err;
  const Json json = Json::parse(ran.out);
  EXPECT_EQ(json["method"], "board");
  EXPECT_EQ(json["views"].size(), static_cast<size_t>(kViews));
  const double sigma = json["relative_sigma"];
  // Corners of rendered photos err together by some 0.03 px: that is more than their scatter says.
  EXPECT_NEAR(json["metres_per_unit"], kUnit, kUnit * std::max(4 * sigma, 5e-4));
  EXPECT_LT(sigma, 2e-3);
  EXPECT_LT(json["rms_px"], 0.2);
  const DtrSet metric = io::ReadSet(folder_ / "metric.dtr");
  EXPECT_EQ(metric.unit, LengthUnit::kMetre);
  const auto& views = metric.frames.front().views;
  const calib::Board board = calib::BoardFromText(kBoardText);
  const double truth = (CamFromBoard(board, 0).TargetOriginInSource() -
                        CamFromBoard(board, 3).TargetOriginInSource())
                           .norm();
  EXPECT_NEAR((views[0].CenterInWorld() - views[3].CenterInWorld()).norm(), truth, 2e-3 * truth);
  EXPECT_EQ(Json::parse(metric.provenance_json)["scale"][0]["board"], "chessboard:7x5:0.03m");
}

TEST_F(ScaleByBoard, AViewOfABoardThatWasMovedIsLeftOutByName) {
  MakeSet("once.dtr", {2});
  const Ran ran = Scale("once.dtr", kBoardText);
  ASSERT_EQ(ran.code, 0) << ran.err;
  const Json json = Json::parse(ran.out);
  ASSERT_EQ(json["left_out"].size(), 1u) << json;
  EXPECT_EQ(json["left_out"][0]["name"], "0002.png");
  EXPECT_NEAR(json["metres_per_unit"], kUnit, 2e-3 * kUnit);
}

TEST_F(ScaleByBoard, BoardsThatTellNothingAreRejected) {
  MakeSet("moving.dtr", {1, 2, 3, 5});
  ExpectRejected(Scale("moving.dtr", kBoardText), kFailed,
                 "scale by a board: expected views that agree where the board lies, found that");
  ExpectRejected(
      Scale("moving.dtr", "charuco:5x6:30mm:0.7"), kWrongUsage,
      "3 of 3 photos looked at show a chessboard of 7x5 inner corners, none the given one; "
      "give chessboard:7x5:SQUARE");
  MakeSet("two.dtr", {}, 2);
  ExpectRejected(Scale("two.dtr", kBoardText), kFailed,
                 "--board chessboard:7x5:0.03m: expected it in 3 views of");
  ExpectRejected(Scale("moving.dtr", "chessboard:7x5:30"), kWrongUsage,
                 "--board chessboard:7x5:30: expected a square in mm, cm or m, found a length "
                 "without a unit");
  ExpectRejected(Dtr({"calibrate", "scale", In("moving.dtr"), "--board", kBoardText, "--distance",
                      "0000,0001=1m"}),
                 kWrongUsage,
                 "expected --distance (once or more), --board or --gps, found several");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "metric.dtr"));
}

}  // namespace
}  // namespace dtr::testing
