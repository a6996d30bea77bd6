// tests/support/truncation.h -- what a file cut short must do to its reader.
#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::testing {

/// Cuts `file` after 0, step, 2 step, ... bytes and one byte before its end; `read` must throw
/// dtr::Error, and nothing else, every time. The whole file is put back at the end.
template <typename Read>
void ExpectEveryPrefixIsAnError(const std::filesystem::path& file, size_t step, const Read& read) {
  const std::string whole = ReadFile(file, 1 << 24);
  const auto write = [&](size_t bytes) {
    std::ofstream(file, std::ios::binary | std::ios::trunc)
        .write(whole.data(), static_cast<std::streamsize>(bytes));
  };
  const auto expect_error = [&](size_t bytes) {
    write(bytes);
    EXPECT_THROW(read(), Error) << file << " cut after " << bytes << " of " << whole.size();
  };
  for (size_t bytes = 0; bytes < whole.size(); bytes += step) expect_error(bytes);
  expect_error(whole.size() - 1);
  write(whole.size());
  EXPECT_NO_THROW(read());
}

}  // namespace dtr::testing
