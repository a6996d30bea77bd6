#include "pipeline/prune/detail/prune_journal.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/regular_file.h"

namespace dtr::pipeline {
namespace {
using Json = nlohmann::ordered_json;
}  // namespace

PruneJournal::PruneJournal(const std::filesystem::path& file) : file_(file) {
  std::uintmax_t whole = 0;
  if (std::filesystem::exists(file)) {
    std::ifstream in = StreamOf(file);
    constexpr std::uintmax_t kMaxBytes = 256 << 20;  // of a day's measurements thousands
    if (std::filesystem::file_size(file) > kMaxBytes) {
      throw Error(
          fmt::format("{}: expected at most {} MiB of measurements, found {} MiB; delete the "
                      "folder to start over",
                      file.string(), kMaxBytes >> 20, std::filesystem::file_size(file) >> 20));
    }
    std::string line;
    while (std::getline(in, line) && !in.eof()) {  // at its end: the line has none
      try {
        const Json entry = Json::parse(line);
        known_[entry.at("name")] = entry.at("numbers").get<std::vector<double>>();
      } catch (const Json::exception& error) {
        throw Error(file.string() + ": expected measurements of dtr prune, found " + error.what() +
                    "; delete the folder to start over");
      }
      whole += line.size() + 1;
    }
    in.close();
    std::filesystem::resize_file(file, whole);
  }
  AppendDurably(file, "");  // what cannot be written is said before any work
}

std::optional<std::vector<double>> PruneJournal::Find(const std::string& name, size_t least) const {
  const auto found = known_.find(name);
  if (found == known_.end()) return std::nullopt;
  if (found->second.size() < least) {
    throw Error(
        fmt::format("{}: {}: expected {} numbers, found {}; delete the folder to start over",
                    file_.string(), name, least, found->second.size()));
  }
  return found->second;
}

void PruneJournal::Add(const std::string& name, const std::vector<double>& numbers) {
  known_[name] = numbers;
  AppendDurably(file_, Json{{"name", name}, {"numbers", numbers}}.dump() + "\n");
}

}  // namespace dtr::pipeline
