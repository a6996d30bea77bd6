// tests/support/test_data.h -- where test data lie and where tests may write.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace dtr::testing {

/// Folder of the real data sets: $DTR_DATA, else ../shared/data beside the checkout.
inline std::filesystem::path DataFolder() {
  const char* given = std::getenv("DTR_DATA");
  return given != nullptr ? given : "../shared/data";
}

/// A fresh folder, removed with everything in it at the end of the scope.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "dtr_test_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace dtr::testing

/// Skips the test, saying so, where a real data set is absent.
#define DTR_REQUIRE_DATA(path)                                                      \
  if (!std::filesystem::exists(path)) {                                             \
    GTEST_SKIP() << (path) << " is absent; set DTR_DATA to the folder of the sets"; \
  }                                                                                 \
  static_assert(true)
