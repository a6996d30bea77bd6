// tests/cli/refusals.h -- lists of commands that must be rejected, and files to reject them over.
#pragma once
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "dtr/base/files.h"
#include "tests/cli/courtyard_and_set.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

namespace fs = std::filesystem;
using Json = nlohmann::json;

struct Rejection {
  int code;
  std::string words;  // that the line must hold
  std::vector<std::string> args;
};

inline void ExpectAllRejected(const std::vector<Rejection>& rejections) {
  for (const Rejection& rejection : rejections) {
    SCOPED_TRACE(fmt::format("dtr {}", fmt::join(rejection.args, " ")));
    ExpectRejected(Dtr(rejection.args), rejection.code, rejection.words);
  }
}

class Rejections : public CourtyardAndSet {
 protected:
  static void SetUpTestSuite() {
    CourtyardAndSet::SetUpTestSuite();
    // A set of one view, in another unit than the good one.
    Json cameras = Cameras();
    cameras["unit"] = "arbitrary";
    cameras["views"].erase(cameras["views"].begin() + 1, cameras["views"].end());
    WriteFileAtomically(Shared("one.json"), cameras.dump());
    DtrOk({"import", "--cameras", Shared("one.json"), "--images", Photos(), "--depth",
           Shared("courtyard/depth"), "-o", Shared("one.dtr")});
  }
  static Json Cameras() { return Json::parse(Text(Shared("courtyard/cameras.json"))); }

  std::string Write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    WriteFileAtomically(folder_ / name, text);
    return In(name);
  }
  // A folder of this name with nothing in it.
  std::string Folder(const std::string& name) const {
    fs::create_directories(folder_ / name);
    return In(name);
  }
  // A COLMAP model of two photos, of one camera that `camera` describes.
  std::string Model(const std::string& name, const std::string& camera, const std::string& first,
                    const std::string& second) const {
    Write(name + "/cameras.txt", "1 " + camera + "\n");
    Write(name + "/images.txt",
          fmt::format("1 1 0 0 0 0 0 0 1 {}\n\n2 1 0 0 0 1 0 0 1 {}\n\n", first, second));
    Write(name + "/points3D.txt", "");
    return In(name);
  }
  // What the shell makes of these words.
  Ran Shell(const std::string& words) const {
    const int status = std::system(fmt::format("({}) 2> {}", words, In("err")).c_str());
    Ran ran;
    ran.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    ran.err = Text(In("err"));
    return ran;
  }
  // A program of this name, the only one on the PATH that In("bin") is.
  void Program(const std::string& name, const std::string& shell_lines) const {
    Write("bin/" + name, "#!/bin/sh\n" + shell_lines + "\n");
    fs::permissions(In("bin/" + name), fs::perms::owner_all);
  }
};

}  // namespace dtr::testing
