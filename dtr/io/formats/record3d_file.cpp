#include "dtr/io/formats/record3d_file.h"

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <string>

#include "dtr/base/error.h"
#include "dtr/base/file_stream.h"

namespace dtr::io::internal {
namespace {

namespace fs = std::filesystem;

/// No photo, depth map or list of poses is larger.
constexpr zip_uint64_t kMaxEntryBytes = 64u << 20;
/// Photos and depth are compressed already: archives hardly make them smaller.
constexpr zip_uint64_t kMaxRatio = 8;

struct Closed {
  void operator()(zip_t* archive) const { zip_discard(archive); }
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};

using Archive = std::unique_ptr<zip_t, Closed>;

[[noreturn]] void Reject(const fs::path& file, const std::string& found) {
  throw Error(fmt::format(
      "{}: expected a recording of Record3D (a ZIP archive), found {}; export it again as .r3d",
      file.string(), found));
}

Archive Opened(const fs::path& file) {
  int code = 0;
  Archive archive(zip_open(file.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, &code));
  if (!archive) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    const std::string why = zip_error_strerror(&error);
    zip_error_fini(&error);
    Reject(file, why);
  }
  return archive;
}

/// metadata, rgbd/N.jpg, rgbd/N.depth or rgbd/N.conf: what is unpacked, and under no other name.
bool IsOfACapture(const std::string& name) {
  if (name == "metadata") return true;
  if (!name.starts_with("rgbd/")) return false;
  const size_t begin = 5, end = name.find('.');
  const bool numbered = end != std::string::npos && end > begin && end - begin <= 9 &&
                        std::all_of(name.begin() + begin, name.begin() + static_cast<long>(end),
                                    [](char c) { return c >= '0' && c <= '9'; });
  const std::string extension = name.substr(std::min(end, name.size()));
  return numbered && (extension == ".jpg" || extension == ".depth" || extension == ".conf");
}

/// An entry that holds more than its directory says is not written to its end.
void Extract(const fs::path& file, zip_t* archive, const zip_stat_t& stat, const fs::path& to) {
  const std::unique_ptr<zip_file_t, Closed> entry(zip_fopen_index(archive, stat.index, 0));
  if (!entry) Reject(file, zip_strerror(archive));
  FileStream out(to);
  char buffer[1 << 16];
  zip_uint64_t left = stat.size;
  for (zip_int64_t bytes; (bytes = zip_fread(entry.get(), buffer, sizeof buffer)) != 0;) {
    if (bytes < 0) Reject(file, zip_file_strerror(entry.get()));
    if (static_cast<zip_uint64_t>(bytes) > left) Reject(file, "another length of a file in it");
    left -= static_cast<zip_uint64_t>(bytes);
    out.Write({buffer, static_cast<size_t>(bytes)});
  }
  if (left > 0) Reject(file, "another length of a file in it");
  out.Flush();
}

}  // namespace

void UnpackRecord3d(const fs::path& file, const fs::path& folder) {
  const Archive archive = Opened(file);
  const zip_uint64_t max_bytes = kMaxEntryBytes + kMaxRatio * fs::file_size(file);
  fs::create_directories(folder / "rgbd");
  zip_uint64_t bytes = 0;
  bool has_metadata = false;
  const zip_int64_t entries = zip_get_num_entries(archive.get(), 0);
  for (zip_int64_t i = 0; i < entries; ++i) {
    zip_stat_t stat;
    if (zip_stat_index(archive.get(), static_cast<zip_uint64_t>(i), 0, &stat) != 0) {
      Reject(file, zip_strerror(archive.get()));
    }
    const std::string name = stat.name;
    if (!IsOfACapture(name)) continue;
    has_metadata = has_metadata || name == "metadata";
    bytes += std::min(stat.size, max_bytes);
    if (stat.size > kMaxEntryBytes || bytes > max_bytes) Reject(file, name + " of too many bytes");
    Extract(file, archive.get(), stat, folder / name);
  }
  if (!has_metadata) Reject(file, "no file called metadata in it");
}

}  // namespace dtr::io::internal
