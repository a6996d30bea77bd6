// Most of a short run is the loader's: OpenImageIO with what it needs is 260 shared libraries, 0.3
// s of processor time. A command that needs none of them loads none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <regex>

#include "dtr/base/temporary_folder.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/environment.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class StartUp : public ::testing::Test {
 protected:
  void SetUp() override {
#ifdef DTR_SANITIZED
    GTEST_SKIP() << "programs under a sanitizer link what others load on demand";
#endif
  }

  /// What a run loads, by the dynamic loader's own record.
  std::vector<std::string> LibrariesOf(const std::vector<std::string>& args) {
    const fs::path record = folder_ / "loaded";
    const Environment debug("LD_DEBUG", "files");
    const Environment output("LD_DEBUG_OUTPUT", record.string());
    EXPECT_EQ(DtrByItself(args).code, 0);
    std::string text;
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      if (!entry.path().filename().string().starts_with("loaded.")) continue;
      text += Text(entry.path());
      fs::remove(entry.path());
    }
    static const std::regex initialised("calling init: (\\S+)");
    std::vector<std::string> libraries;
    for (std::sregex_iterator at(text.begin(), text.end(), initialised), end; at != end; ++at) {
      libraries.push_back((*at)[1]);
    }
    return libraries;
  }

  TemporaryFolder folder_;
};

// 320 before they were loaded on demand.
constexpr size_t kMostLibraries = 80;

TEST_F(StartUp, HelpLoadsNoLibraryOfImagesOrVideos) {
  for (const std::vector<std::string>& args :
       {std::vector<std::string>{"--help"}, {"--version"}, {"help", "build"}}) {
    const auto libraries = LibrariesOf(args);
    EXPECT_GT(libraries.size(), 5u);
    EXPECT_LE(libraries.size(), kMostLibraries) << args.front();
    EXPECT_THAT(libraries, Not(Contains(HasSubstr("libOpenImageIO")))) << args.front();
    EXPECT_THAT(libraries, Not(Contains(HasSubstr("libav")))) << args.front();
  }
}

TEST_F(StartUp, ASetOfPngFilesIsDescribedAndRenderedWithoutThemAndPhotosAreReadWithThem) {
  const std::string scene = (folder_ / "plane").string(), set = (folder_ / "plane.dtr").string();
  DtrOk(
      {"dataset", "make", "plane", "-o", scene, "--views", "3", "--width", "64", "--height", "48"});
  DtrOk({"import", "--cameras", scene + "/cameras.json", "--images", scene + "/images", "--depth",
         scene + "/depth", "-o", set});
  EXPECT_LE(LibrariesOf({"info", set}).size(), kMostLibraries);
  const std::string image = (folder_ / "x.png").string();
  EXPECT_LE(LibrariesOf({"render", set, "--like", "0001", "--renderer", "cpu", "-o", image}).size(),
            kMostLibraries);
  EXPECT_THAT(LibrariesOf({"capture", scene + "/images", "-o", (folder_ / "capture").string()}),
              Contains(HasSubstr("libOpenImageIO")));
}

}  // namespace
}  // namespace dtr::testing
