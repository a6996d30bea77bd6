// tests/support/small_courtyard_set.h -- tests of the program on one small set, made once a suite.
#pragma once
#include <gtest/gtest.h>

#include <string>

#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

/// Set() is of the small courtyard with its true depth, for reading only; every test has a folder
/// of its own beside it.
class SmallCourtyardSet : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new TemporaryFolder;
    MakeSmallCourtyard(*shared_ / "courtyard");
    ImportSmallCourtyard(*shared_ / "courtyard", Set());
  }
  static void TearDownTestSuite() {
    delete shared_;
    shared_ = nullptr;
  }
  static std::string Set() { return (*shared_ / "good.dtr").string(); }
  std::string In(const std::string& name) const { return (folder_ / name).string(); }

  TemporaryFolder folder_;

 private:
  inline static TemporaryFolder* shared_ = nullptr;
};

}  // namespace dtr::testing
