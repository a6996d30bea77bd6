// No command writes anywhere but to its output, the work beside it and the folder for what is
// temporary: every call that changes a file is recorded (tests/support/record_files.cpp) and held
// against that list.
#include <cstdlib>
#include <set>

#include "tests/cli/writing_commands.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

// Paths that a run made, changed or removed.
std::set<std::string> Changed(const fs::path& record) {
  std::set<std::string> paths;
  std::istringstream lines(fs::exists(record) ? Text(record) : "");
  for (std::string line; std::getline(lines, line);) {
    paths.insert(fs::path(line.substr(line.find(' ') + 1)).lexically_normal().string());
  }
  return paths;
}

// Places of the system that are nobody's files. OpenGL's library looks for its cache where it may
// not write.
bool IsOfTheSystem(const std::string& path) {
  return path.starts_with("/dev/") || path.starts_with("/proc/") || path.starts_with("/sys/");
}

class FileCallsOf : public WritingCommandTest {
 protected:
  // What the command says it writes: words below IN/, and the set that it replaces.
  std::vector<std::string> Outputs(const fs::path& folder) const {
    std::vector<std::string> outputs;
    std::istringstream words(GetParam().words);
    for (std::string word; words >> word;) {
      if (word.starts_with("IN/")) outputs.push_back((folder / word.substr(3)).string());
    }
    return outputs;
  }
};

TEST_P(FileCallsOf, StayWithinItsOutputItsWorkAndTheTemporaryFolder) {
#ifdef DTR_SANITIZED
  GTEST_SKIP() << "SKIPPED: sanitizers want to be loaded first";
#endif
  if (LacksData()) GTEST_SKIP() << "SKIPPED: no " << DataFolder() / "chessboard_stereo_640x480";
  const fs::path here = folder_ / "here", temporary = folder_ / "temporary";
  Prepare(here);
  fs::create_directories(temporary);
  const std::string record = (folder_ / "record").string();
  const auto words = In(here);
  setenv("TMPDIR", temporary.c_str(), 1);
  setenv("DTR_RECORD_FILES", record.c_str(), 1);
  setenv("LD_PRELOAD", DTR_RECORDER, 1);
  const Ran ran = DtrByItself(words);
  for (const char* name : {"TMPDIR", "DTR_RECORD_FILES", "LD_PRELOAD"}) unsetenv(name);
  EXPECT_TRUE(IsDone(ran)) << ran.err;
  const std::set<std::string> changed = Changed(record);
  EXPECT_FALSE(changed.empty());
  const auto is_allowed = [&](const std::string& path) {
    if (IsOfTheSystem(path) || path.starts_with(temporary.string() + "/")) return true;
    for (const std::string& output : Outputs(here)) {
      // The output itself, what lies in it, and names that begin with it and a full stop: its work.
      if (path == output || path.starts_with(output + "/") || path.starts_with(output + ".")) {
        return true;
      }
    }
    return path.starts_with(
        (colmap_ / "calls").parent_path().string());  // the fake program's own notes
  };
  for (const std::string& path : changed) EXPECT_TRUE(is_allowed(path)) << path;
  EXPECT_TRUE(fs::is_empty(temporary));
}

std::vector<WritingCommand> AllCommands() {
  std::vector<WritingCommand> all(std::begin(kWritingCommands), std::end(kWritingCommands));
  const std::string build =
      " OF/courtyard/images -o IN/set.dtr --poses OF/courtyard/sparse --preset fast";
  all.push_back({.name = "build", .words = "build" + build});
  all.push_back({.name = "build_from_photos",
                 .words = "build OF/courtyard/images -o IN/set.dtr --sfm colmap --engine none"});
  all.push_back({.name = "batch",
                 .words = "batch --local 1 OF/courtyard/images -o IN/set.dtr --poses "
                          "OF/courtyard/sparse --engine none"});
  all.push_back(
      {.name = "stereo_with_normals",
       .words = "stereo OF/cameras.dtr -o IN/set.dtr --preset fast --normals IN/normals"});
  all.push_back({.name = "export_web", .words = "export OF/good.dtr --format web -o IN/page.html"});
  return all;
}

INSTANTIATE_TEST_SUITE_P(, FileCallsOf, ::testing::ValuesIn(AllCommands()),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace dtr::testing
