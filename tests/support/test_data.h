// tests/support/test_data.h -- where test data lie and where tests may write.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "dtr/base/temporary_folder.h"

namespace dtr::testing {

/// Folder of the real data sets: $DTR_DATA, else ../shared/data beside the checkout.
inline std::filesystem::path DataFolder() {
  const char* given = std::getenv("DTR_DATA");
  return given != nullptr ? given : "../shared/data";
}

using dtr::TemporaryFolder;

}  // namespace dtr::testing

/// Skips the test, saying so, where a real data set is absent.
#define DTR_REQUIRE_DATA(path)                                                      \
  if (!std::filesystem::exists(path)) {                                             \
    GTEST_SKIP() << (path) << " is absent; set DTR_DATA to the folder of the sets"; \
  }                                                                                 \
  static_assert(true)
