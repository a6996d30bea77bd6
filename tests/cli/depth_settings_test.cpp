// Presets, what overrides them, what of it a set remembers; depth that COLMAP makes.
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/io/set_io.h"
#include "tests/calib/colmap/fake_colmap.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::Contains;
using ::testing::IsEmpty;

class DepthSettings : public ::testing::Test {
 protected:
  // Cameras once for all tests: a set of 4 source views without depth.
  static void SetUpTestSuite() {
    shared_ = new TemporaryFolder;
    const fs::path courtyard = *shared_ / "courtyard";
    MakeSmallCourtyard(courtyard);
    DtrOk({"build", (courtyard / "images").string(), "-o", Cameras().string(), "--poses",
           (courtyard / "sparse").string(), "--holdout", "0001,0003,0005", "--engine", "none"});
  }
  static void TearDownTestSuite() { delete shared_; }
  static fs::path Cameras() { return *shared_ / "cameras.dtr"; }

  // Depth by `dtr stereo` with these options.
  static fs::path Stereo(const std::string& run, std::vector<std::string> options) {
    const fs::path set = *shared_ / run / "set.dtr";
    fs::create_directories(set.parent_path());
    options.insert(options.begin(),
                   {"stereo", Cameras().string(), "-o", set.string(), "--threads", "2"});
    DtrOk(options);
    return set;
  }
  // By the cheapest preset; made once.
  static fs::path Fast() {
    const fs::path set = *shared_ / "fast" / "set.dtr";
    return fs::exists(set) ? set : Stereo("fast", {"--preset", "fast"});
  }
  static Json OptionsOf(const fs::path& set) {
    return Json::parse(Text(set / "set.json")).at("provenance").at("options");
  }

  // Options that say what a set recorded.
  static std::vector<std::string> ExplicitlyAs(const Json& recorded) {
    std::vector<std::string> options;
    for (const std::string name : {"neighbours", "pass_neighbours", "iterations", "passes"}) {
      std::string option = "--" + name;
      std::replace(option.begin(), option.end(), '_', '-');
      options.insert(options.end(), {option, std::to_string(recorded.at(name).get<int>())});
    }
    return options;
  }

  static TemporaryFolder* shared_;
  TemporaryFolder folder_;
};
TemporaryFolder* DepthSettings::shared_ = nullptr;

TEST_F(DepthSettings, NormalsAreUnitVectorsTurnedToTheCamera) {
  const fs::path folder = folder_ / "normals";
  const fs::path set = Stereo("normals", {"--preset", "fast", "--normals", folder.string()});
  EXPECT_EQ(Text(set / "set.json"), Text(Fast() / "set.json")) << "the set is the same";
  EXPECT_EQ(FilesIn(folder), 4);
  const auto file = OIIO::ImageInput::open((folder / "0002.exr").string());
  ASSERT_TRUE(file);
  std::vector<float> n(3 * static_cast<size_t>(kCourtyardWidthPx * kCourtyardHeightPx));
  ASSERT_TRUE(file->read_image(0, 0, 0, 3, OIIO::TypeDesc::FLOAT, n.data()));
  const Json camera = Json::parse(Text(set / "set.json"))["frames"][0]["views"][2]["camera"];
  const double lens[] = {camera["fx_px"], camera["fy_px"], camera["cx_px"], camera["cy_px"]};
  int known = 0, turned = 0;
  for (size_t i = 0; i < n.size(); i += 3) {
    const float length = std::hypot(n[i], n[i + 1], n[i + 2]);
    if (length == 0) continue;
    ++known;
    EXPECT_NEAR(length, 1, 1e-5);
    const auto pixel = static_cast<double>(i / 3);
    const double x = std::fmod(pixel, kCourtyardWidthPx) + 0.5;
    const double y = std::floor(pixel / kCourtyardWidthPx) + 0.5;
    turned += n[i] * (x - lens[2]) / lens[0] + n[i + 1] * (y - lens[3]) / lens[1] + n[i + 2] < 0;
  }
  EXPECT_GT(known, 0.5 * kCourtyardWidthPx * kCourtyardHeightPx);
  EXPECT_EQ(turned, known);
  ExpectRejected(Dtr({"stereo", Cameras().string(), "-o", (folder_ / "no.dtr").string(), "--engine",
                      "sgbm", "--normals", (folder_ / "none").string()}),
                 kWrongUsage, "--normals: expected --engine patchmatch");
}

TEST_F(DepthSettings, AnImportedSetThatKnowsNoneGetsThem) {
  const fs::path courtyard = *shared_ / "courtyard", set = folder_ / "imported.dtr";
  DtrOk({"import", "--format", "colmap", "--cameras", (courtyard / "sparse").string(), "--images",
         (courtyard / "images").string(), "-o", set.string()});
  ASSERT_FALSE(Json::parse(Text(set / "set.json")).at("provenance").contains("options"));
  DtrOk({"stereo", set.string(), "--preset", "fast", "--threads", "2"});
  EXPECT_EQ(OptionsOf(set).at("engine"), "patchmatch");
}

TEST_F(DepthSettings, BalancedIsWhatRunsUnlessToldOtherwise) {
  const auto plain = Contents(Stereo("plain", {}));
  EXPECT_THAT(DifferingFiles(plain, Contents(Stereo("named", {"--preset", "balanced"}))),
              IsEmpty());
  EXPECT_THAT(DifferingFiles(plain, Contents(Fast())), Contains("depth/0000.png"));
}

TEST_F(DepthSettings, WhatASetRecordsGivenExplicitlyMakesTheSameBytes) {
  const auto explicitly = ExplicitlyAs(OptionsOf(Fast()));
  EXPECT_THAT(DifferingFiles(Contents(Fast()), Contents(Stereo("explicit", explicitly))),
              IsEmpty());
}

TEST_F(DepthSettings, ATimeBudgetPicksSettingsThatMakeTheSameBytesAgain) {
  const fs::path hurried = Stereo("hurried", {"--time-budget", "0.001"});
  EXPECT_EQ(OptionsOf(hurried).at("passes"), 0);
  const auto again = Contents(Stereo("unhurried", ExplicitlyAs(OptionsOf(hurried))));
  EXPECT_THAT(DifferingFiles(Contents(hurried), again), IsEmpty());
  // What is given explicitly stays.
  EXPECT_EQ(OptionsOf(Stereo("partly", {"--time-budget", "0.001", "--passes", "1"})).at("passes"),
            1);
  ExpectRejected(Dtr({"stereo", Cameras().string(), "-o", (folder_ / "no.dtr").string(), "--engine",
                      "sgbm", "--time-budget", "9"}),
                 2, "--time-budget: picks settings of --engine patchmatch");
}

TEST_F(DepthSettings, AnExplicitOptionOverridesThePreset) {
  const Json options = OptionsOf(Stereo("override", {"--preset", "fast", "--passes", "0"}));
  EXPECT_EQ(options.at("passes"), 0);
  EXPECT_EQ(OptionsOf(Stereo("old_name", {"--preset", "fast", "--rounds", "0"})).at("passes"), 0);
  EXPECT_EQ(options.at("neighbours"), OptionsOf(Fast()).at("neighbours"));
}

TEST_F(DepthSettings, AnEngineRecordsOnlyWhatItMakesUseOf) {
  const Json options = OptionsOf(Stereo("sgbm", {"--engine", "sgbm"}));
  EXPECT_TRUE(options.contains("neighbours"));
  EXPECT_FALSE(options.contains("passes"));
}

TEST_F(DepthSettings, TheLeastMemoryThatWorksIsNamedAndMakesTheSameBytes) {
  const std::string set = (folder_ / "tight/set.dtr").string();
  fs::create_directories(folder_ / "tight");
  // Of as many threads fewer run at a time: the result is that of any number.
  const auto with_memory = [&](const std::string& gb) {
    return Dtr({"stereo", Cameras().string(), "-o", set, "--preset", "fast", "--memory", gb,
                "--threads", "64"});
  };
  const Ran refused = with_memory("0.27");
  ExpectRejected(refused, 2, "--memory 0.27: expected at least");
  const std::string words = "expected at least ";
  const std::string least =
      refused.err.substr(refused.err.find(words) + words.size(), std::string("0.000").size());
  EXPECT_EQ(with_memory(least).code, 0) << least;
  EXPECT_THAT(DifferingFiles(Contents(Fast()), Contents(set)), IsEmpty());
}

// A colmap that leaves the true depth of the courtyard, in files called as images of a set are.
class DepthByColmap : public DepthSettings {
 protected:
  void SetUp() override {
    ImportSmallCourtyard(*shared_ / "courtyard", folder_ / "true.dtr");
    truth_ = io::LoadSet(folder_ / "true.dtr");
  }
  void WriteMaps(const fs::path& folder, const std::string& extension) const {
    fs::create_directories(folder);
    for (const View& view : truth_.frames.front().views) {
      std::string bytes =
          fmt::format("{}&{}&1&", view.depth.grid().width(), view.depth.grid().height());
      bytes.append(reinterpret_cast<const char*>(view.depth.grid().data().data()),
                   view.depth.grid().data().size() * sizeof(float));
      const std::string stem = fs::path(view.name).replace_extension().string();
      WriteFileAtomically(folder / (stem + extension + ".geometric.bin"), bytes);
    }
  }
  DtrSet truth_;
};

TEST_F(DepthByColmap, RunsWhereThereIsCudaAndReadsWhatAWorkspaceHas) {
  colmap::testing::FakeColmap fake;
  WriteFileAtomically(fake / "cuda", "");
  WriteMaps(fake / "maps", ".png");
  const fs::path computed = Stereo("computed", {"--engine", "colmap"});
  DtrSet set = io::LoadSet(computed);
  int views = 0;
  for (const View& view : set.frames.front().views) {
    for (const View& exact : truth_.frames.front().views) {
      if (exact.name != view.name) continue;
      ++views;
      int kept = 0;
      for (int y = 0; y < kCourtyardHeightPx; ++y) {
        for (int x = 0; x < kCourtyardWidthPx; ++x) {
          if (DepthImage::IsHole(view.depth(x, y))) continue;
          ++kept;
          EXPECT_NEAR(view.depth(x, y), exact.depth(x, y), 1e-3 * exact.depth(x, y));
        }
      }
      EXPECT_GT(kept, kCourtyardWidthPx * kCourtyardHeightPx / 3) << view.name;
    }
  }
  EXPECT_GE(views, 2);

  const fs::path workspace = folder_ / "workspace";
  DtrOk({"export", Cameras().string(), "--format", "colmap", "-o", workspace.string()});
  WriteMaps(workspace / "stereo/depth_maps", ".png");
  const fs::path read = Stereo("read", {"--engine", "colmap", "--workspace", workspace.string()});
  EXPECT_THAT(DifferingFiles(Contents(computed), Contents(read)), IsEmpty());
}

TEST_F(DepthByColmap, SaysWhatToDoWhereThereIsNoCuda) {
  const colmap::testing::FakeColmap fake;
  ExpectRejected(Dtr({"stereo", Cameras().string(), "-o", (folder_ / "no.dtr").string(), "--engine",
                      "colmap"}),
                 1, "colmap patch_match_stereo: expected a COLMAP with CUDA");
  EXPECT_FALSE(fs::exists(folder_ / "no.dtr.partial"));
  ExpectRejected(Dtr({"stereo", Cameras().string(), "-o", (folder_ / "no.dtr").string(),
                      "--workspace", folder_.path().string()}),
                 2, "--workspace: is read by --engine colmap");
}

}  // namespace
}  // namespace dtr::testing
