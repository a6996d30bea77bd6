#include "cli/sweep_facts.h"

#include <fmt/format.h>

#include <set>

#include "dtr/io/json_fields.h"

namespace dtr::cli {
namespace {

using io::JsonObject;

constexpr size_t kMaxGroups = 8;  // that a plot tells apart

/// An index into a list of `count`, which stands under `key`; empty where it is null.
std::optional<size_t> IndexAt(const JsonObject& json, const std::string& key, size_t count) {
  if (!json.Has(key)) return std::nullopt;
  const io::Json& value = json.Value(key);
  if (!value.is_number_unsigned() || value.get<size_t>() >= count) {
    json.Fail(key, fmt::format("a point's index, 0 to {}", count - 1));
  }
  return value.get<size_t>();
}

bool TruthAt(const JsonObject& json, const std::string& key) {
  if (!json.Has(key) || !json.Value(key).is_boolean()) json.Fail(key, "true or false");
  return json.Value(key).get<bool>();
}

std::optional<double> NumberAt(const JsonObject& json, const std::string& key) {
  return json.Has(key) ? std::optional(json.Number(key)) : std::nullopt;
}

PointFacts PointOf(const JsonObject& json) {
  PointFacts point;
  point.setting = json.String("setting");
  point.command = json.String("command");
  point.cost = json.Positive("cost");
  point.cost_least = json.Positive("cost_least");
  point.cost_most = json.Positive("cost_most");
  point.error = json.Positive("error");
  point.psnr_db = NumberAt(json, "psnr_db");
  point.on_front = TruthAt(json, "on_front");
  point.build_cpu_s = NumberAt(json.Object("figures"), "build_cpu_s");
  point.not_registered = NumberAt(json.Object("figures"), "not_registered").value_or(0);
  const JsonObject options = json.Object("options");
  const io::Json& values = json.Value("options");
  if (values.empty()) json.Fail("options", "the value of every axis");
  point.group = options.String(values.begin().key());
  return point;
}

std::optional<eval::DefaultAssessment> UsualOf(const JsonObject& stage, size_t count) {
  if (!stage.Has("default")) return std::nullopt;
  const JsonObject json = stage.Object("default");
  eval::DefaultAssessment usual;
  const auto at = IndexAt(json, "at", count);
  if (!at) json.Fail("at", "a point's index");
  usual.at = *at;
  usual.on_front = TruthAt(json, "on_front");
  usual.beaten_by = IndexAt(json, "beaten_by", count);
  if (!usual.on_front && !usual.beaten_by) json.Fail("beaten_by", "a point's index");
  usual.within_spread = TruthAt(json, "within_spread");
  return usual;
}

std::optional<eval::Times> MachineTimes(const JsonObject& stage) {
  if (!stage.Has("machine_ms")) return std::nullopt;
  const JsonObject json = stage.Object("machine_ms");
  eval::Times times;
  times.min_ms = json.Number("least");
  times.median_ms = json.Number("median");
  times.max_ms = json.Number("most");
  return times;
}

void RequireFewGroups(const JsonObject& json, const std::vector<PointFacts>& points) {
  std::set<std::string> groups;
  for (const PointFacts& point : points) groups.insert(point.group);
  if (groups.size() > kMaxGroups) {
    json.Fail("points", fmt::format("at most {} values of the first option", kMaxGroups),
              std::to_string(groups.size()));
  }
}

StageFacts StageOf(const JsonObject& json) {
  StageFacts stage;
  stage.name = json.String("stage");
  stage.cost_name = json.String("cost");
  stage.error_name = json.String("error");
  stage.conditions = json.String("conditions");
  const size_t count = json.Array("points").size();
  if (count == 0) json.Fail("points", "at least one");
  for (size_t i = 0; i < count; ++i) stage.points.push_back(PointOf(json.Item("points", i)));
  RequireFewGroups(json, stage.points);
  for (const io::Json& at : json.Array("front")) {
    if (!at.is_number_unsigned() || at.get<size_t>() >= count)
      json.Fail("front", "indices of points");
    stage.front.push_back(at.get<size_t>());
  }
  stage.knee = IndexAt(json, "knee", count);
  stage.cheapest = IndexAt(json, "cheapest_within_loss", count);
  stage.within_budget = IndexAt(json, "best_within_budget", count);
  stage.max_loss_db = json.Number("max_loss_db");
  stage.budget = NumberAt(json, "budget");
  stage.usual = UsualOf(json, count);
  stage.machine = MachineTimes(json);
  return stage;
}

}  // namespace

SweepFacts ReadSweep(const std::string& text, const std::string& file) {
  return FactsOf(io::ParseJson(text, file), file);
}

SweepFacts FactsOf(const io::Json& json, const std::string& file) {
  const JsonObject top(json, file, "");
  SweepFacts facts;
  facts.set = top.String("set");
  const JsonObject machine = top.Object("machine");
  facts.machine = {machine.String("cpu"), machine.PositiveInt("cores"), machine.String("renderer"),
                   machine.String("version"), machine.String("clock")};
  for (size_t i = 0; i < top.Array("stages").size(); ++i) {
    facts.stages.push_back(StageOf(top.Item("stages", i)));
  }
  return facts;
}

std::string WithoutCamera(const PointFacts& point) {
  if (point.not_registered == 0) return "";
  return fmt::format("{:g} photo{} without a camera", point.not_registered,
                     point.not_registered == 1 ? "" : "s");
}

std::string DefaultSentence(const StageFacts& stage) {
  if (!stage.usual) return "the default was not measured";
  if (stage.usual->on_front) return "the default is on the Pareto front";
  const PointFacts& usual = stage.points[stage.usual->at];
  const PointFacts& better = stage.points[*stage.usual->beaten_by];
  const std::string gain = usual.psnr_db && better.psnr_db
                               ? fmt::format(", {:+.3f} dB", *better.psnr_db - *usual.psnr_db)
                               : fmt::format(", {:.2f} of its error", better.error / usual.error);
  return fmt::format("the default is not on the Pareto front: {} takes {:.2f} of its cost{}{}",
                     better.setting, better.cost / usual.cost, gain,
                     stage.usual->within_spread ? " (the ranges of the two costs overlap)" : "");
}

}  // namespace dtr::cli
