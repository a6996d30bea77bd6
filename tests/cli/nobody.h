// tests/cli/nobody.h -- the rights of a user who owns nothing, for what root may do anyway.
#pragma once
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

namespace dtr::testing {

/// For its life time this process, and what it starts, is the user nobody.
class AsNobody {
 public:
  AsNobody() {
    taken_ = geteuid() == 0 && setresgid(kNobody, kNobody, 0) == 0 &&
             setresuid(kNobody, kNobody, 0) == 0;
  }
  ~AsNobody() {
    if (setresuid(0, 0, 0) == 0) (void)!setresgid(0, 0, 0);
  }
  AsNobody(const AsNobody&) = delete;
  AsNobody& operator=(const AsNobody&) = delete;
  /// False where this process is not root's: the rights are as they were.
  bool taken() const { return taken_; }

  /// Makes a folder that nobody may write in.
  static void MakeFolder(const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    (void)!chown(folder.c_str(), kNobody, kNobody);
  }

 private:
  static constexpr uid_t kNobody = 65534;
  bool taken_ = false;
};

}  // namespace dtr::testing

/// Skips the test, saying so, where it cannot be shown what other users may do.
#define DTR_REQUIRE_NOBODY(nobody)                                                         \
  if (!(nobody).taken() || faccessat(AT_FDCWD, DTR_PROGRAM, X_OK, AT_EACCESS) != 0) {      \
    GTEST_SKIP() << "SKIPPED: not root, or the program may not be started by other users"; \
  }                                                                                        \
  static_assert(true)
