// One reader (DTR_FUZZ_READER) for libFuzzer, which looks for inputs that reach new code; preset
// `fuzz`.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "tests/fuzz/outcome.h"

namespace {

std::filesystem::path folder;
std::optional<dtr::fuzz::Reader> reader;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  folder = dtr::fuzz::MakeFolder();
  std::atexit([] { std::filesystem::remove_all(folder); });
  for (const dtr::fuzz::ReaderKind& kind : dtr::fuzz::AllReaders()) {
    if (std::string(kind.name) == DTR_FUZZ_READER) reader = kind.open(folder);
  }
  if (!reader) std::abort();
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto outcome = dtr::fuzz::TryInput(*reader, {reinterpret_cast<const char*>(data), size});
  if (outcome.error_text.empty()) return 0;
  std::fprintf(stderr, "%s: %s\n", DTR_FUZZ_READER, outcome.error_text.c_str());
  std::abort();
}
