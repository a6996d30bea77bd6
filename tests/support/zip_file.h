// tests/support/zip_file.h -- ZIP archives as programs write them. Needs libzip.
#pragma once
#include <gtest/gtest.h>
#include <zip.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace dtr::testing {

/// Names and bytes, in their order.
using ZipEntries = std::vector<std::pair<std::string, std::string>>;

/// Writes an archive; entries are deflated where that makes them smaller, as Record3D's are not.
inline void WriteZip(const std::filesystem::path& file, const ZipEntries& entries,
                     bool deflated = false) {
  zip_t* archive = zip_open(file.c_str(), ZIP_CREATE | ZIP_TRUNCATE, nullptr);
  ASSERT_NE(archive, nullptr) << file;
  for (const auto& [name, bytes] : entries) {
    zip_source_t* source = zip_source_buffer(archive, bytes.data(), bytes.size(), 0);
    const zip_int64_t index = zip_file_add(archive, name.c_str(), source, 0);
    ASSERT_GE(index, 0) << name;
    zip_set_file_compression(archive, static_cast<zip_uint64_t>(index),
                             deflated ? ZIP_CM_DEFLATE : ZIP_CM_STORE, 0);
  }
  ASSERT_EQ(zip_close(archive), 0) << file;
}

/// An LZFSE stream of stored bytes, as encoders write what they cannot compress.
inline std::string StoredAsLzfse(const std::string& bytes) {
  std::string stream = "bvx-";
  for (int i = 0; i < 4; ++i) stream += static_cast<char>(bytes.size() >> 8 * i & 0xff);
  return stream + bytes + "bvx$";
}

}  // namespace dtr::testing
