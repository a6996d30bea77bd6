#include "pipeline/build/detail/part_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calib/colmap/model_io.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "pipeline/core/photos/input_hash.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr char kFolder[] = "parts", kFrozen[] = "frozen_cameras", kModel[] = "model",
               kRecord[] = "record.json";
constexpr std::uintmax_t kLargestRecordBytes = 64u << 20;

fs::path FileOf(const fs::path& work, const BuildPart& part, const char* ending) {
  return work / kFolder /
         fmt::format("{}_{}_of_{}{}", part.stage, part.part.index + 1, part.part.count, ending);
}

void MakeFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error(folder.string() + ": cannot be made: " + error.message());
}

// The stage of a file "STAGE_K_of_N.done.json"; empty for other files.
std::string StageOfRecord(const std::string& name) {
  constexpr std::string_view kEnding = ".done.json";
  if (!name.ends_with(kEnding)) return "";
  const size_t of = name.rfind("_of_");
  const size_t end = of == std::string::npos || of == 0 ? of : name.rfind('_', of - 1);
  return end == std::string::npos ? "" : name.substr(0, end);
}

std::optional<DonePart> DoneIn(const fs::path& file) {
  if (!fs::exists(file)) return std::nullopt;
  const Json json = Json::parse(ReadFile(file, kLargestRecordBytes), nullptr, false);
  if (!json.is_object() || !json.contains("wall_s") || !json.contains("cpu_s") ||
      !json["wall_s"].is_number() || !json["cpu_s"].is_number()) {
    throw Error(file.string() +
                ": expected what a finished part took, found something else; delete the file to "
                "have the part looked at again");
  }
  return DonePart{json["wall_s"].get<double>(), json["cpu_s"].get<double>()};
}

}  // namespace

void RequirePart(const BuildPart& part, const std::vector<BuildStage>& stages) {
  const auto stage = std::find_if(stages.begin(), stages.end(),
                                  [&](const BuildStage& s) { return s.name == part.stage; });
  if (stage == stages.end()) {
    std::vector<std::string> names;
    for (const BuildStage& s : stages) names.push_back(s.name);
    throw UsageError(
        fmt::format("`stage` {}: expected one of {}", part.stage, fmt::join(names, ", ")));
  }
  const auto& [index, count] = part.part;
  if (count < 1 || index < 0 || index >= count) {
    throw UsageError(
        fmt::format("`part` {}/{}: expected K/N with K from 1 to N", index + 1, count));
  }
  if (!stage->has_parts && count > 1) {
    throw UsageError(fmt::format("`part` {}/{}: the stage {} is for one process; leave out `part`",
                                 index + 1, count, part.stage));
  }
}

FileLock LockPart(const fs::path& work, const BuildPart& part) {
  MakeFolder(work / kFolder);
  auto lock = FileLock::Try(FileOf(work, part, ".lock"));
  if (lock) return std::move(*lock);
  throw UsageError(fmt::format("{}: another process works on {}; wait for it",
                               work.parent_path().string(), NameOf(part)));
}

void MarkBegun(const fs::path& work) {
  MakeFolder(work / kFolder);
  WriteFileAtomically(work / kFolder / "begun", "");
}

void WriteDonePart(const fs::path& work, const BuildPart& part, const DonePart& done) {
  MakeFolder(work / kFolder);
  const Json json = {{"wall_s", done.wall_s}, {"cpu_s", done.cpu_s}};
  WriteFileAtomically(FileOf(work, part, ".done.json"), json.dump() + "\n");
}

std::string NameOf(const BuildPart& part) {
  if (part.part.count == 1) return part.stage;
  return fmt::format("{}, part {} of {}", part.stage, part.part.index + 1, part.part.count);
}

std::optional<DonePart> FindDonePart(const fs::path& output, const BuildPart& part) {
  return DoneIn(FileOf(io::SetWriter::WorkFolderOf(output), part, ".done.json"));
}

bool HasParts(const fs::path& work) { return fs::is_directory(work / kFolder); }

DonePart TotalOf(const fs::path& work, const std::string& stage) {
  DonePart total;
  if (!HasParts(work)) return total;
  for (const auto& entry : fs::directory_iterator(work / kFolder)) {
    if (StageOfRecord(entry.path().filename().string()) != stage) continue;
    const DonePart part = DoneIn(entry.path()).value_or(DonePart{});
    total.wall_s += part.wall_s;
    total.cpu_s += part.cpu_s;
  }
  return total;
}

void FreezeCalibration(const CalibratedPhotos& calibrated, const fs::path& work) {
  const fs::path folder = work / kFrozen;
  RemoveTree(folder);
  MakeFolder(folder);
  colmap::WriteModel(folder / kModel, calibrated.model, colmap::Format::kBinary);
  const Eigen::Vector3d& origin = calibrated.world_origin;
  const Json record = {{"model_sha256", InputHash(folder / kModel)},
                       {"unit", NameOf(calibrated.unit)},
                       {"world_origin", {origin.x(), origin.y(), origin.z()}},
                       {"not_registered", calibrated.not_registered}};
  WriteFileAtomically(folder / kRecord,
                      record.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

CalibratedPhotos FrozenCalibration(const fs::path& work) {
  const fs::path folder = work / kFrozen;
  const auto reject = [&](const char* found) {
    throw Error(
        fmt::format("{}: expected the cameras that the stage calibration freezes, found "
                    "{}; run that stage first",
                    folder.string(), found));
  };
  if (!fs::exists(folder / kRecord)) reject("none");
  const Json record = Json::parse(ReadFile(folder / kRecord, kLargestRecordBytes), nullptr, false);
  CalibratedPhotos calibrated;
  try {
    if (record.at("model_sha256") != InputHash(folder / kModel)) reject("others");
    calibrated.model = colmap::ReadModel(folder / kModel);
    for (const auto unit : {LengthUnit::kUnknown, LengthUnit::kArbitrary, LengthUnit::kMetre}) {
      if (record.at("unit") == NameOf(unit)) calibrated.unit = unit;
    }
    for (int i = 0; i < 3; ++i) {
      calibrated.world_origin[i] = record.at("world_origin").at(static_cast<size_t>(i));
    }
    calibrated.not_registered = record.at("not_registered").get<std::vector<std::string>>();
  } catch (const Json::exception&) {
    reject("a damaged record");
  }
  return calibrated;
}

}  // namespace dtr::pipeline
