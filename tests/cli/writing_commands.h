// tests/cli/writing_commands.h -- every command that writes, once, on small inputs.
#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "calib/colmap/model_io.h"
#include "tests/cli/fake_sfm.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

/// A command in a folder of its own.
struct WritingCommand {
  std::string name;
  std::string words;  // IN/ is that folder, OF/ that of what is given, DATA/ DTR_DATA
  // A set that lies in the folder already and is replaced.
  std::string replaces = {};
  // Bytes that hold times or paths, or are COLMAP's own, differ from run to run.
  bool repeats = true;
  // How often too little room must have been met: 1 for a single small file.
  int min_stops = 2;
  // Where whole files may appear one by one before all are there.
  std::string one_by_one = {};

  friend void PrintTo(const WritingCommand& command, std::ostream* out) { *out << command.words; }
};

inline const WritingCommand kWritingCommands[] = {
    {.name = "capture", .words = "capture OF/courtyard/images -o IN/capture"},
    {.name = "import",
     .words = "import --cameras OF/courtyard/cameras.json --images OF/courtyard/images --depth "
              "OF/courtyard/depth -o IN/set.dtr"},
    {.name = "join", .words = "join OF/good.dtr OF/good.dtr -o IN/moving.dtr"},
    {.name = "stereo",
     .words = "stereo IN/set.dtr --neighbours 2 --pass-neighbours 2 --iterations 1 --passes 1",
     .replaces = "cameras.dtr"},
    {.name = "scale",
     .words = "calibrate scale IN/set.dtr --distance 0000,0006=2m",
     .replaces = "cameras.dtr"},
    {.name = "scale_with_depth",
     .words = "calibrate scale IN/set.dtr --distance 0001,0006=2m",
     .replaces = "good.dtr"},
    {.name = "refine", .words = "calibrate refine OF/courtyard/sparse -o IN/refined"},
    {.name = "calibrate_photos",
     .words = "calibrate photos OF/courtyard/images -o IN/model --sfm colmap",
     .repeats = false,
     .one_by_one = "model/"},
    {.name = "prune",
     .words =
         "prune OF/good.dtr -o IN/small.dtr --max-loss-db 1 --probes 2 --checks 2 --renderer cpu",
     .repeats = false},
    {.name = "render",
     .words = "render OF/good.dtr --fly-through 3 -o IN/path --renderer cpu",
     .one_by_one = "path/"},
    {.name = "render_video",
     .words = "render OF/good.dtr --fly-through 3 -o IN/path.mp4 --renderer cpu"},
    {.name = "export", .words = "export OF/cameras.dtr -o IN/colmap"},
    {.name = "export_ply", .words = "export OF/good.dtr --format ply -o IN/cloud.ply"},
    {.name = "export_las", .words = "export OF/good.dtr --format las -o IN/cloud.las"},
    {.name = "export_mesh", .words = "export OF/good.dtr --format mesh -o IN/mesh.glb"},
    {.name = "export_splat", .words = "export OF/good.dtr --format splat -o IN/scene.ply"},
    {.name = "export_depth", .words = "export OF/good.dtr --format depth -o IN/depth"},
    {.name = "export_nerfstudio", .words = "export OF/good.dtr --format nerfstudio -o IN/nerf"},
    {.name = "export_mvsnet", .words = "export OF/good.dtr --format mvsnet -o IN/mvsnet"},
    {.name = "export_openmvs", .words = "export OF/good.dtr --format openmvs -o IN/openmvs"},
    {.name = "export_miv", .words = "export OF/good.dtr --format miv -o IN/miv"},
    {.name = "bench",
     .words = "bench OF/good.dtr --stage storage --max-points 1 -o IN/bench --renderer cpu",
     .repeats = false,
     .one_by_one = "bench/"},
    {.name = "dataset",
     .words = "dataset make courtyard --views 3 --width 96 --height 64 -o IN/made"},
    {.name = "inspect", .words = "inspect OF/good.dtr -o IN/report.html", .min_stops = 1},
    {.name = "advise", .words = "advise OF/good.dtr -o IN/advice.html", .min_stops = 1},
    {.name = "evaluate",
     .words = "evaluate OF/good.dtr --leave-one-out --images IN/compare --renderer cpu",
     .one_by_one = "compare/"},
    {.name = "validate",
     .words = "validate OF/cameras.dtr --report IN/report.html",
     .min_stops = 1},
    {.name = "board",
     .words = "calibrate board DATA/chessboard_stereo_640x480 --images left0*.jpg --board "
              "chessboard:9x6:1 --model brown4 -o IN/left.json",
     .min_stops = 1},
    {.name = "rig",
     .words =
         "calibrate rig DATA/chessboard_stereo_640x480 --board chessboard:9x6:1 --model brown4 "
         "-o IN/rig.json -o IN/rig.yml",
     .min_stops = 1},
    {.name = "json",
     .words = "info OF/good.dtr --json IN/info.json",
     .repeats = false,
     .min_stops = 1},
};

/// Inputs that no command may change, and a folder of each test's own.
class WritingCommandTest : public ::testing::TestWithParam<WritingCommand> {
 protected:
  static void SetUpTestSuite() {
    shared_ = new TemporaryFolder;
    MakeSmallCourtyard(*shared_ / "courtyard");
    ImportSmallCourtyard(*shared_ / "courtyard", *shared_ / "good.dtr");
    DtrOk({"build", Of() + "courtyard/images", "-o", Of() + "cameras.dtr", "--poses",
           Of() + "courtyard/sparse", "--engine", "none"});
  }
  static void TearDownTestSuite() { delete shared_; }
  static std::string Of() { return shared_->path().string() + "/"; }

  void SetUp() override { LeaveModel(colmap_, colmap::ReadModel(Of() + "courtyard/sparse")); }
  std::vector<std::string> In(const std::filesystem::path& folder) const {
    std::vector<std::string> words;
    std::istringstream stream(GetParam().words + " --threads 1");
    for (std::string word; stream >> word;) {
      if (word.starts_with("IN/")) word = (folder / word.substr(3)).string();
      if (word.starts_with("OF/")) word = Of() + word.substr(3);
      if (word.starts_with("DATA/")) word = (DataFolder() / word.substr(5)).string();
      words.push_back(word);
    }
    return words;
  }
  void Prepare(const std::filesystem::path& folder) const {
    std::filesystem::create_directories(folder);
    const std::string& set = GetParam().replaces;
    if (!set.empty())
      std::filesystem::copy(Of() + set, folder / "set.dtr",
                            std::filesystem::copy_options::recursive);
  }
  /// The data that a command needs is not there.
  static bool LacksData() {
    return GetParam().words.find("DATA/") != std::string::npos &&
           !std::filesystem::exists(DataFolder() / "chessboard_stereo_640x480");
  }

  static inline TemporaryFolder* shared_ = nullptr;
  colmap::testing::FakeColmap colmap_;
  TemporaryFolder folder_;
};

}  // namespace dtr::testing
