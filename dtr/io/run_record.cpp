#include "dtr/io/run_record.h"

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/json_fields.h"

namespace dtr::io {
namespace {

constexpr std::uintmax_t kMaxRecordBytes = 64 << 20;

double NumberOr0(const Json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_number() ? found->get<double>() : 0;
}

// A number that no machine can hold is none.
long KibOr0(const Json& object, const char* name) {
  const double kib = NumberOr0(object, name);
  return kib >= 0 && kib <= 1e15 ? static_cast<long>(kib) : 0;
}

}  // namespace

std::vector<RunStage> ReadRunStages(const std::filesystem::path& set_folder) {
  const std::filesystem::path file = set_folder / "report" / "run.json";
  std::vector<RunStage> stages;
  if (!std::filesystem::exists(file)) return stages;
  const Json record = Json::parse(ReadFile(file, kMaxRecordBytes), nullptr, false);
  if (record.is_discarded()) {
    throw Error(file.string() + ": expected JSON, found something else; remove it or build again");
  }
  if (!record.is_object() || !record.contains("stages") || !record["stages"].is_array()) {
    return stages;
  }
  for (const Json& stage : record["stages"]) {
    if (!stage.is_object()) continue;
    const auto name = stage.find("name");
    stages.push_back({name != stage.end() && name->is_string() ? name->get<std::string>() : "",
                      NumberOr0(stage, "wall_s"), NumberOr0(stage, "cpu_s"),
                      KibOr0(stage, "peak_rss_kib")});
  }
  return stages;
}

}  // namespace dtr::io
