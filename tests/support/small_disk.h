// tests/support/small_disk.h -- a disk that is full whenever a test wants it to be.
#pragma once
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/statvfs.h>

#include <filesystem>
#include <string>

namespace dtr::testing {

/// A file system of some bytes in memory, seen by this process and its children only.
class SmallDisk {
 public:
  explicit SmallDisk(const std::filesystem::path& folder) : folder_(folder) {
    std::filesystem::create_directories(folder);
    mounted_ = unshare(CLONE_NEWNS) == 0 &&
               mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
               mount("tmpfs", folder.c_str(), "tmpfs", 0, "size=64k") == 0;
  }
  ~SmallDisk() {
    if (mounted_) umount(folder_.c_str());
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  bool mounted() const { return mounted_; }
  void Grow(long kib) const {
    const std::string size = "size=" + std::to_string(kib) + "k";
    ASSERT_EQ(mount("tmpfs", folder_.c_str(), "tmpfs", MS_REMOUNT, size.c_str()), 0);
  }

  /// Leaves less than a page or two, whatever is written meanwhile.
  void Fill() const {
    for (int tries = 0; tries < 100; ++tries) {
      struct statvfs about;
      ASSERT_EQ(statvfs(folder_.c_str(), &about), 0);
      const auto used = (about.f_blocks - about.f_bfree) * about.f_frsize;
      const std::string size = "size=" + std::to_string(used + about.f_frsize);
      if (mount("tmpfs", folder_.c_str(), "tmpfs", MS_REMOUNT, size.c_str()) == 0) return;
    }
    FAIL() << "the disk cannot be filled";
  }

 private:
  std::filesystem::path folder_;
  bool mounted_ = false;
};

}  // namespace dtr::testing
