#include "cli/sweep_store.h"

#include <cmath>
#include <limits>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/eval/metrics.h"
#include "dtr/io/json_fields.h"

namespace dtr::cli {
namespace {

constexpr std::uintmax_t kFileLimitBytes = 64 << 20;
constexpr int kFormat = 1;

io::Json Value(const eval::SweepMeasurement& measured) {
  io::Json json{{"cost", measured.cost},
                {"cost_least", measured.cost_least},
                {"cost_most", measured.cost_most},
                {"error", measured.error},
                {"machine_ms", measured.machine_ms},
                {"figures", measured.figures}};
  // JSON has no infinity: what equals the photos is written as such.
  if (measured.psnr_db && std::isfinite(*measured.psnr_db)) json["psnr_db"] = *measured.psnr_db;
  json["identical"] = eval::IdenticalFigures({{"psnr_db", measured.psnr_db}});
  return json;
}

eval::SweepMeasurement MeasurementOf(const io::JsonObject& json) {
  eval::SweepMeasurement measured;
  measured.cost = json.Positive("cost");
  measured.cost_least = json.Positive("cost_least");
  measured.cost_most = json.Positive("cost_most");
  measured.error = json.Positive("error");
  measured.machine_ms = json.Number("machine_ms");
  if (json.Has("psnr_db")) measured.psnr_db = json.Number("psnr_db");
  if (json.Has("identical") && !json.Value("identical").empty()) {
    measured.psnr_db = std::numeric_limits<double>::infinity();
  }
  const io::JsonObject figures = json.Object("figures");
  for (const auto& [name, value] : json.Value("figures").items()) {
    measured.figures[name] = figures.Number(name);
  }
  return measured;
}

}  // namespace

class SweepFile::Part final : public eval::SweepStore {
 public:
  Part(SweepFile& file, const eval::SweepStage& stage, std::string context)
      : file_(file), stage_(stage), context_(std::move(context)) {}
  std::optional<eval::SweepMeasurement> Find(const eval::SweepSetting& setting) const override {
    const auto found = file_.measurements_.find(KeyOf(setting));
    if (found == file_.measurements_.end()) return std::nullopt;
    return found->second;
  }
  void Keep(const eval::SweepSetting& setting, const eval::SweepMeasurement& measurement) override {
    file_.measurements_[KeyOf(setting)] = measurement;
    file_.Write();
  }

 private:
  Key KeyOf(const eval::SweepSetting& setting) const {
    return {stage_.name, context_, eval::Describe(stage_, setting)};
  }

  SweepFile& file_;
  const eval::SweepStage& stage_;
  const std::string context_;
};

SweepFile::SweepFile(std::filesystem::path file) : file_(std::move(file)) {
  if (!std::filesystem::exists(file_)) return;
  const std::string name = file_.string();
  const io::Json json = io::ParseJson(ReadFile(file_, kFileLimitBytes), name);
  const io::JsonObject top(json, name, "");
  if (top.PositiveInt("format") != kFormat) top.Fail("format", std::to_string(kFormat));
  for (size_t i = 0; i < top.Array("measurements").size(); ++i) {
    const io::JsonObject one = top.Item("measurements", i);
    measurements_[{one.String("stage"), one.String("context"), one.String("setting")}] =
        MeasurementOf(one);
  }
}

std::unique_ptr<eval::SweepStore> SweepFile::Of(const eval::SweepStage& stage,
                                                const std::string& context) {
  return std::make_unique<Part>(*this, stage, context);
}

void SweepFile::Write() const {
  io::Json list = io::Json::array();
  for (const auto& [key, measured] : measurements_) {
    io::Json one{{"stage", key[0]}, {"context", key[1]}, {"setting", key[2]}};
    one.update(Value(measured));
    list.push_back(std::move(one));
  }
  WriteFileAtomically(
      file_, io::PrettyJson({{"format", kFormat}, {"measurements", list}}, file_.string()));
}

}  // namespace dtr::cli
