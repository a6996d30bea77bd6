#include "pipeline/batch/detail/batch_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/regular_file.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::uintmax_t kLargestFileBytes = 64u << 20;

Json ToJson(const Batch& batch) {
  Json stages = Json::array(), jobs = Json::array();
  for (const BatchStage& stage : batch.stages) {
    stages.push_back({{"stage", stage.name}, {"parts", stage.parts}});
  }
  for (const BatchJobs& array : batch.jobs) {
    jobs.push_back({{"id", array.id},
                    {"stage", array.stage},
                    {"offset", array.offset},
                    {"parts", array.parts}});
  }
  const SlurmOptions& slurm = batch.slurm;
  return {{"tool_version", DTR_VERSION},
          {"set", batch.set.string()},
          {"program", batch.program.string()},
          {"directory", batch.directory.string()},
          {"words", batch.words},
          {"stages", stages},
          {"local", batch.local},
          {"threads", batch.threads},
          {"memory_gb", batch.memory_gb},
          {"replaced", batch.replaced},
          {"slurm",
           {{"partition", slurm.partition},
            {"account", slurm.account},
            {"time", slurm.time},
            {"cpus_per_task", slurm.cpus_per_task}}},
          {"jobs", jobs}};
}

void Require(bool holds, const char* found) {
  if (!holds) throw std::out_of_range(found);
}

Batch FromJson(const Json& json) {
  constexpr int kMaxParts = 1 << 20, kMaxProcesses = 1024;
  Batch batch;
  batch.set = json.at("set").get<std::string>();
  batch.program = json.at("program").get<std::string>();
  batch.directory = json.at("directory").get<std::string>();
  batch.words = json.at("words").get<std::vector<std::string>>();
  for (const Json& stage : json.at("stages")) {
    BatchStage& read = batch.stages.emplace_back();
    read.name = stage.at("stage").get<std::string>();
    read.parts = stage.at("parts").get<int>();
    read.is_last = read.name == kLastStage;
    Require(read.parts >= 1 && read.parts <= kMaxParts, "a number of parts that cannot be");
    Require(!read.name.empty() && read.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz"
                                                              "0123456789-") == std::string::npos,
            "a stage that is none");
  }
  Require(!batch.stages.empty() && batch.stages.back().is_last, "no last stage");
  batch.local = json.at("local").get<int>();
  Require(batch.local >= 0 && batch.local <= kMaxProcesses, "a number of processes that cannot be");
  batch.threads = json.at("threads").get<int>();
  batch.memory_gb = json.at("memory_gb").get<double>();
  batch.replaced = json.at("replaced").get<std::int64_t>();
  const Json& slurm = json.at("slurm");
  batch.slurm = {slurm.at("partition").get<std::string>(), slurm.at("account").get<std::string>(),
                 slurm.at("time").get<std::string>(), slurm.at("cpus_per_task").get<int>()};
  const auto fits = [](int number) { return number >= 0 && number < kMaxParts; };
  for (const Json& jobs : json.at("jobs")) {
    BatchJobs& read = batch.jobs.emplace_back();
    read.id = jobs.at("id").get<std::string>();
    read.stage = jobs.at("stage").get<std::string>();
    read.offset = jobs.at("offset").get<int>();
    read.parts = jobs.at("parts").get<std::vector<int>>();
    Require(fits(read.offset) && std::all_of(read.parts.begin(), read.parts.end(), fits),
            "jobs that cannot be");
  }
  return batch;
}

}  // namespace

fs::path BatchFolder(const fs::path& set) {
  return WithoutTrailingSlash(fs::absolute(set).lexically_normal()).string() + ".batch";
}

fs::path LogOf(const Batch& batch, const BatchStage& stage, int part) {
  return BatchFolder(batch.set) / "logs" / fmt::format("{}_{}.log", stage.name, part + 1);
}

bool HasBatch(const fs::path& set) { return fs::exists(BatchFolder(set) / kBatchFile); }

void WriteBatch(const Batch& batch) {
  WriteFileAtomically(BatchFolder(batch.set) / kBatchFile,
                      ToJson(batch).dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

Batch LoadBatch(const fs::path& set) {
  const fs::path file = BatchFolder(set) / kBatchFile;
  if (!HasBatch(set)) {
    throw Error(file.string() + ": expected a batch of that set, found none; dtr batch begins one");
  }
  const std::string text = ReadFile(file, kLargestFileBytes);
  Batch batch;
  try {
    batch = FromJson(Json::parse(text));
  } catch (const std::exception& error) {
    throw Error(
        fmt::format("{}: expected what dtr batch writes, found something else ({}); move "
                    "the folder away and begin the batch again, what was built stays",
                    file.string(), error.what()));
  }
  // The same folder may have several names on the machines of a cluster.
  std::error_code none;
  if (!fs::equivalent(BatchFolder(batch.set), BatchFolder(set), none)) {
    throw Error(fmt::format(
        "{}: expected the batch of that set, found that of {}; if the folder was moved, delete it "
        "and begin the batch again, what was built stays",
        file.string(), batch.set.string()));
  }
  return batch;
}

std::int64_t WhenWritten(const fs::path& set) {
  std::error_code none;
  const auto time = fs::last_write_time(set / "set.json", none);
  return none ? 0 : static_cast<std::int64_t>(time.time_since_epoch().count());
}

std::vector<int> MissingParts(const Batch& batch, const BatchStage& stage) {
  if (stage.is_last) {
    const std::int64_t written = WhenWritten(batch.set);
    return written != 0 && written != batch.replaced ? std::vector<int>() : std::vector<int>{0};
  }
  std::vector<int> missing;
  for (int part = 0; part < stage.parts; ++part) {
    if (!FindDonePart(batch.set, {stage.name, {part, stage.parts}})) missing.push_back(part);
  }
  return missing;
}

std::vector<std::string> CommandOf(const Batch& batch, const BatchStage& stage, int part) {
  std::vector<std::string> words = {batch.program.string(), "build"};
  words.insert(words.end(), batch.words.begin(), batch.words.end());
  if (stage.is_last) return words;
  words.insert(words.end(), {"--stage", stage.name});
  if (stage.parts > 1) {
    words.insert(words.end(), {"--part", fmt::format("{}/{}", part + 1, stage.parts)});
  }
  return words;
}

std::string LastWords(const fs::path& log) {
  std::string line, last;
  if (fs::exists(log)) {
    std::ifstream in = StreamOf(log);
    while (std::getline(in, line)) {
      if (line.find_first_not_of(" \t\r") != std::string::npos) last = line;
    }
  }
  if (last.empty()) return fmt::format("it said nothing; see {}", log.string());
  return fmt::format("it said: {}; see {}", last, log.string());
}

}  // namespace dtr::pipeline
