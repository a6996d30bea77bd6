// tests/cli/courtyard_and_set.h -- photos with their true cameras and a good set of them, made once
// for all tests of a suite.
#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

class CourtyardAndSet : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new TemporaryFolder;
    MakeSmallCourtyard(*shared_ / "courtyard");
    ImportSmallCourtyard(*shared_ / "courtyard", *shared_ / "good.dtr");
  }
  static void TearDownTestSuite() { delete shared_; }
  /// What no test may change: courtyard/ (MakeSmallCourtyard), good.dtr.
  static std::string Shared(const std::string& name) { return (*shared_ / name).string(); }
  static std::string Photos() { return Shared("courtyard/images"); }
  /// In the test's own folder.
  std::string In(const std::string& name) const { return (folder_ / name).string(); }

  static inline TemporaryFolder* shared_ = nullptr;
  TemporaryFolder folder_;
};

}  // namespace dtr::testing
