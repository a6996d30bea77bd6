// tests/cli/chessboard_set.h -- tests of commands on the photos of a chessboard by two cameras.
#pragma once
#include <string>

#include "dtr/base/files.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

class ChessboardSet : public ::testing::Test {
 protected:
  static std::filesystem::path Photos() { return DataFolder() / "chessboard_stereo_640x480"; }
  std::string In(const std::string& name) const { return (folder_ / name).string(); }
  TemporaryFolder folder_;
};

}  // namespace dtr::testing
