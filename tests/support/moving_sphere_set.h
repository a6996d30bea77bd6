// tests/support/moving_sphere_set.h -- tests of the program on one small dynamic set, made once a
// suite.
#pragma once
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

/// Set() is of a ball that rolls by a third of its radius between time steps half a second apart,
/// seen by four cameras; each time step is a set of its own, too: At("t0.dtr"), At("t0.5.dtr"), ...
/// beside its photos, At("t0"), ... For reading only; every test has a folder of its own.
class MovingSphereSet : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { Make({"0", "0.5"}); }
  static void TearDownTestSuite() {
    delete shared_;
    shared_ = nullptr;
  }
  static void Make(const std::vector<std::string>& times_s) {
    shared_ = new TemporaryFolder;
    std::vector<std::string> join = {"join"};
    for (const std::string& time_s : times_s) {
      const std::string photos = At("t" + time_s), set = photos + ".dtr";
      DtrOk({"dataset", "make", "sphere", "-o", photos, "--views", "4", "--width", "96", "--height",
             "64", "--time", time_s});
      DtrOk({"import", "--cameras", photos + "/cameras.json", "--images", photos + "/images",
             "--depth", photos + "/depth", "-o", set});
      join.push_back(set);
    }
    join.insert(join.end(), {"-o", Set(), "--fps", "2"});
    DtrOk(join);
  }
  static std::string At(const std::string& name) { return (*shared_ / name).string(); }
  static std::string Set() { return At("moving.dtr"); }
  std::string In(const std::string& name) const { return (folder_ / name).string(); }

  TemporaryFolder folder_;

 private:
  inline static TemporaryFolder* shared_ = nullptr;
};

}  // namespace dtr::testing
