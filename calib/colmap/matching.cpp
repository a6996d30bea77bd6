#include "calib/colmap/matching.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "calib/sfm/run/pairs.h"
#include "dtr/base/parallel_for.h"

namespace dtr::colmap {
namespace {

// Photos per block of exhaustive matching: small, because progress and the answer to Ctrl-C come
// block by block, yet large enough that COLMAP's feature cache serves most pairs.
constexpr int kBlockPhotos = 10;
// Neighbours before and after in a video; quadratic overlap adds 1, 2, 4, ... beyond.
constexpr int kSequentialOverlap = 10;
constexpr double kMatcherGib = 0.5;

Arguments MatcherArguments(const char* command, const std::filesystem::path& database, int threads,
                           std::uint64_t seed) {
  Arguments arguments(command);
  arguments.AddIfKnown({"random_seed", "default_random_seed"}, fmt::format("{}", seed))
      .Add({"database_path"}, database.string())
      .Add({"SiftMatching.use_gpu", "FeatureMatching.use_gpu"}, "0")
      .Add({"SiftMatching.num_threads", "FeatureMatching.num_threads"}, std::to_string(threads));
  return arguments;
}

void RunMatcher(sfm::Workspace& workspace, const Arguments& arguments) {
  constexpr int kPercent = 100;
  workspace.progress().Stage("matching", kPercent);
  RunStep(workspace, arguments, [&](const std::string& line) {
    if (const int percent = MatchingPercent(line); percent >= 0) {
      workspace.progress().Update(percent);
    }
  });
}

// The pairs to name to COLMAP; empty where it takes all that its matcher finds by itself.
std::optional<sfm::ImagePairs> PairsToMatch(sfm::Workspace& workspace, sfm::Matching matching,
                                            double memory_gb,
                                            const std::optional<sfm::ImagePairs>& allowed) {
  const size_t count = workspace.images().size(), all = count * (count - 1) / 2;
  if (allowed && allowed->size() < all) {
    workspace.progress().Note(fmt::format(
        "{} of {} pairs of photos left out of matching: their cameras cannot see the same thing",
        all - allowed->size(), all));
  }
  if (matching == sfm::Matching::kExhaustive && allowed && allowed->size() < all) return allowed;
  if (matching != sfm::Matching::kPreselected) return {};
  std::vector<std::filesystem::path> files;
  for (size_t i = 0; i < count; ++i) files.push_back(workspace.FileOf(i));
  sfm::ImagePairs pairs = sfm::PreselectPairs(files, allowed, memory_gb, workspace.progress());
  const size_t left_out = std::min(all, allowed ? allowed->size() : all) - pairs.size();
  if (left_out > 0) {
    workspace.progress().Note(fmt::format(
        "{} of {} pairs of photos left out of matching: other photos resemble them more", left_out,
        all));
  }
  return pairs;
}

}  // namespace

int MatchingThreads(double memory_gb) {
  return std::clamp(static_cast<int>(sfm::kFill * memory_gb / kMatcherGib), 1,
                    ThreadLimit::Current());
}

int MatchingPercent(const std::string& line) {
  const size_t bracket = line.find('[');
  if (bracket == std::string::npos || (line.find("Matching") == std::string::npos &&
                                       line.find("Processing") == std::string::npos)) {
    return -1;
  }
  int row = 0, rows = 0, column = 0, columns = 0;
  const int found =
      std::sscanf(line.c_str() + bracket, "[%d/%d, %d/%d]", &row, &rows, &column, &columns);
  if (found < 2 || row < 1 || rows < row) return -1;
  if (found < 4) return static_cast<int>(100.0 * row / rows);
  if (column < 1 || columns < column) return -1;
  return static_cast<int>(100.0 * (static_cast<double>(row - 1) * columns + column) /
                          (static_cast<double>(rows) * columns));
}

void MatchPairs(sfm::Workspace& workspace, const std::filesystem::path& database,
                const std::vector<std::pair<std::string, std::string>>& pairs, int threads,
                std::uint64_t seed) {
  std::vector<std::string> lines;
  for (const auto& [a, b] : pairs) lines.push_back(a + " " + b);
  Arguments arguments = MatcherArguments("matches_importer", database, threads, seed);
  arguments.Add({"match_list_path"}, workspace.WriteList("pairs.txt", lines).string())
      .Add({"match_type"}, "pairs");
  RunMatcher(workspace, arguments);
}

void MatchPhotos(sfm::Workspace& workspace, const std::filesystem::path& database,
                 sfm::Matching matching, double memory_gb, std::uint64_t seed,
                 const std::optional<sfm::ImagePairs>& allowed) {
  const int threads = MatchingThreads(memory_gb);
  if (const auto pairs = PairsToMatch(workspace, matching, memory_gb, allowed)) {
    std::vector<std::pair<std::string, std::string>> names;
    for (const auto& [a, b] : *pairs)
      names.emplace_back(workspace.AliasOf(a), workspace.AliasOf(b));
    MatchPairs(workspace, database, names, threads, seed);
    return;
  }
  const bool sequential = matching == sfm::Matching::kSequential;
  Arguments arguments = MatcherArguments(sequential ? "sequential_matcher" : "exhaustive_matcher",
                                         database, threads, seed);
  if (sequential) {
    arguments.Add({"SequentialMatching.overlap"}, std::to_string(kSequentialOverlap))
        .Add({"SequentialMatching.quadratic_overlap"}, "1");
  } else {
    arguments.Add({"ExhaustiveMatching.block_size"}, std::to_string(kBlockPhotos));
  }
  RunMatcher(workspace, arguments);
}

}  // namespace dtr::colmap
