// fuzz_readers [--reader NAME]... [--inputs N] [--seed S] [--file INPUT] [--seeds-to DIR] [--list]
// Gives readers good files, every beginning of them, and N changed ones each; exit 1 where one
// breaks a rule of outcome.h. `--file INPUT` reads one input again. An input that crashes stays in
// the folder that is named.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>

#include "dtr/base/files.h"
#include "tests/fuzz/mutate.h"
#include "tests/fuzz/outcome.h"

namespace dtr::fuzz {
namespace {

namespace fs = std::filesystem;
constexpr size_t kLongestInput = 1 << 16;
constexpr size_t kLargestCorpus = 64;
constexpr int kKeepOneIn = 16;        // of the inputs that were taken for good files
constexpr size_t kMaxPrefixes = 400;  // of long files, some

struct Options {
  std::vector<std::string> readers;
  long inputs = 1000;
  std::uint64_t seed = 1;
  std::optional<fs::path> file, seeds_to;
  bool list = false;
};

Options ParseOptions(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&]() -> std::string {
      if (++i < argc) return argv[i];
      fmt::print(stderr, "fuzz_readers: {} needs a value\n", word);
      std::exit(2);
    };
    if (word == "--reader") {
      options.readers.push_back(value());
    } else if (word == "--inputs") {
      options.inputs = std::stol(value());
    } else if (word == "--seed") {
      options.seed = std::stoull(value());
    } else if (word == "--file") {
      options.file = value();
    } else if (word == "--seeds-to") {
      options.seeds_to = value();
    } else if (word == "--list") {
      options.list = true;
    } else {
      fmt::print(stderr, "fuzz_readers: unknown option {}\n", word);
      std::exit(2);
    }
  }
  return options;
}

/// One reader's inputs and what came of them.
class Session {
 public:
  Session(const ReaderKind& kind, const fs::path& folder)
      : name_(kind.name), reader_(kind.open(folder)), corpus_(reader_.seeds) {}

  void Run(long inputs, std::uint64_t seed) {
    for (const std::string& good : reader_.seeds) {
      if (!Try(good)) Complain("a good file is rejected", good);
    }
    for (const std::string& good : reader_.seeds) TryPrefixes(good);
    Random random(seed);
    for (long i = 0; i < inputs; ++i) {
      const std::string input = Mutated(corpus_, random, kLongestInput);
      if (!Try(input) || random.Index(kKeepOneIn) != 0) continue;
      if (corpus_.size() < kLargestCorpus) {
        corpus_.push_back(input);
      } else {  // the seeds stay
        const auto spare = static_cast<int>(kLargestCorpus - reader_.seeds.size());
        corpus_[reader_.seeds.size() + static_cast<size_t>(random.Index(spare))] = input;
      }
    }
    fmt::print("{:<20} {:>9} inputs, {:>8} of them good files, {} failures\n", name_, tried_,
               accepted_, failures_);
    std::fflush(stdout);
  }

  bool Try(const std::string& input) {
    const Outcome outcome = TryInput(reader_, input);
    ++tried_;
    if (outcome.accepted) ++accepted_;
    if (!outcome.error_text.empty()) Complain(outcome.error_text, input);
    return outcome.accepted;
  }

  void WriteSeeds(const fs::path& folder) const {
    fs::create_directories(folder / name_);
    for (size_t i = 0; i < reader_.seeds.size(); ++i) {
      WriteFileAtomically(folder / name_ / std::to_string(i), reader_.seeds[i]);
    }
  }
  int failures() const { return failures_; }

 private:
  void TryPrefixes(const std::string& good) {
    const size_t step = good.size() / kMaxPrefixes + 1;
    for (size_t bytes = 0; bytes < good.size(); bytes += step) Try(good.substr(0, bytes));
  }
  void Complain(const std::string& error_text, const std::string& input) {
    constexpr int kShown = 5;
    if (++failures_ > kShown) return;
    const fs::path kept = fs::current_path() / fmt::format("fuzz-{}-{}", name_, failures_);
    WriteFileAtomically(kept, input);
    fmt::print(stderr, "{}: {}; input in {}\n", name_, error_text, kept.string());
  }

  std::string name_;
  Reader reader_;
  std::vector<std::string> corpus_;
  long tried_ = 0, accepted_ = 0;
  int failures_ = 0;
};

int Main(const Options& options) {
  const fs::path folder = MakeFolder();
  fmt::print("inputs lie in {} while they are read\n", folder.string());
  std::fflush(stdout);
  int failures = 0;
  size_t used = 0;
  for (const ReaderKind& kind : AllReaders()) {
    if (options.list) fmt::print("{}\n", kind.name);
    const auto asked = std::find(options.readers.begin(), options.readers.end(), kind.name);
    if (options.list || (!options.readers.empty() && asked == options.readers.end())) continue;
    ++used;
    fs::create_directory(folder / kind.name);
    Session session(kind, folder / kind.name);
    if (options.seeds_to) {
      session.WriteSeeds(*options.seeds_to);
    } else if (options.file) {
      fmt::print("{}: {}\n", kind.name,
                 session.Try(ReadFile(*options.file, kLongestInput * 16)) ? "taken" : "refused");
    } else {
      session.Run(options.inputs, options.seed);
    }
    failures += session.failures();
    fs::remove_all(folder / kind.name);
  }
  fs::remove_all(folder);
  if (!options.list && used < std::max<size_t>(1, options.readers.size())) {
    fmt::print(stderr, "fuzz_readers: no such reader; see --list\n");
    return 2;
  }
  return failures == 0 ? 0 : 1;
}

}  // namespace
}  // namespace dtr::fuzz

int main(int argc, char** argv) { return dtr::fuzz::Main(dtr::fuzz::ParseOptions(argc, argv)); }
