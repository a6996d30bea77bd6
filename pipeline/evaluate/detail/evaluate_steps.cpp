#include "pipeline/evaluate/detail/evaluate_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/quiet_progress.h"
#include "dtr/io/set_io.h"
#include "dtr/render/time_steps.h"
#include "pipeline/core/photos/rig_names.h"
#include "pipeline/core/photos/rig_timestamps.h"
#include "pipeline/evaluate/detail/comparison_images.h"
#include "pipeline/evaluate/evaluate_depth.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

// What number each time step had in its recording, where the set's provenance has names with
// numbers; else 0, 1, 2, ...
std::vector<int> StepNumbers(const DtrSet& set) {
  std::vector<int> numbers;
  const auto provenance = nlohmann::json::parse(set.provenance_json, nullptr, false);
  if (provenance.is_object() && provenance.contains("dynamic") &&
      provenance["dynamic"].is_object() && provenance["dynamic"].contains("time_steps") &&
      provenance["dynamic"]["time_steps"].is_array()) {
    for (const auto& name : provenance["dynamic"]["time_steps"]) {
      const auto number =
          name.is_string() ? WholeNumber(DigitsAtEnd(name.get<std::string>())) : std::nullopt;
      if (number) numbers.push_back(*number);
    }
  }
  if (numbers.size() == set.frames.size()) return numbers;
  numbers.clear();
  for (size_t i = 0; i < set.frames.size(); ++i) numbers.push_back(static_cast<int>(i));
  return numbers;
}

// The folders of true depth, by the time step's number.
std::map<int, fs::path> TruthFolders(const fs::path& truth) {
  if (!fs::is_directory(truth)) {
    throw UsageError(
        fmt::format("`depth` {}: expected a folder with one folder of truth for each "
                    "time step, found {}",
                    truth.string(), fs::exists(truth) ? "a file" : "nothing"));
  }
  std::map<int, fs::path> folders;
  for (const auto& entry : fs::directory_iterator(truth)) {
    if (!entry.is_directory()) continue;
    const auto number = WholeNumber(DigitsAtEnd(entry.path().filename().string()));
    if (number) folders[*number] = entry.path();
  }
  return folders;
}

DtrSet LoadedStep(const EvaluateRequest& request, const DtrSet& described, size_t step,
                  Progress& progress) {
  io::LoadOptions load;
  load.completed = !request.measured_only;
  load.sigma = !request.truth.empty();
  load.warn = [&progress](const std::string& line) { progress.Note(line); };
  DtrSet set = AtFrame(described, step);
  for (View& view : set.frames.front().views) io::LoadPixels(request.set, view, load);
  return set;
}

// Means over time of each view's figures, and over views.
class MeansOverTime {
 public:
  void Add(const eval::EvaluationReport& report) {
    for (const eval::ViewScore& score : report.views) Add(score, sums_[score.name]);
    Add(report.mean, all_);
    ++steps_;
  }

  eval::EvaluationReport Report() const {
    eval::EvaluationReport report;
    for (const auto& [name, sum] : sums_) report.views.push_back(MeanOf(name, sum));
    report.mean = MeanOf("", all_);
    return report;
  }

 private:
  struct Sum {
    double value = 0;
    int count = 0;
    void Add(const std::optional<double>& figure) {
      if (!figure) return;
      value += *figure;
      ++count;
    }
    std::optional<double> Mean() const {
      return count > 0 ? std::optional(value / count) : std::nullopt;
    }
  };
  struct Sums {
    Sum psnr, covered, corrected, own_depth, ssim, coverage, render_ms;
    int views_used = 0;
  };

  static void Add(const eval::ViewScore& score, Sums& sums) {
    sums.psnr.Add(score.psnr_db);
    sums.covered.Add(score.psnr_covered_db);
    sums.corrected.Add(score.psnr_cc_db);
    sums.own_depth.Add(score.psnr_own_depth_db);
    sums.ssim.Add(score.ssim);
    sums.coverage.Add(score.coverage);
    sums.render_ms.Add(score.render_ms);
    sums.views_used = score.views_used;
  }

  static eval::ViewScore MeanOf(const std::string& name, const Sums& sums) {
    eval::ViewScore score;
    score.name = name;
    score.psnr_db = sums.psnr.Mean();
    score.psnr_covered_db = sums.covered.Mean();
    score.psnr_cc_db = sums.corrected.Mean();
    score.psnr_own_depth_db = sums.own_depth.Mean();
    score.ssim = sums.ssim.Mean();
    score.coverage = sums.coverage.Mean().value_or(0);
    score.views_used = sums.views_used;
    score.render_ms = sums.render_ms.Mean().value_or(0);
    return score;
  }

  std::map<std::string, Sums> sums_;
  Sums all_;
  int steps_ = 0;
};

}  // namespace

EvaluateResult EvaluateSteps(const EvaluateRequest& request, const DtrSet& described,
                             const std::function<eval::RenderFunction()>& make_renderer,
                             Progress& progress) {
  const std::vector<int> numbers = StepNumbers(described);
  std::map<int, fs::path> truths;
  if (!request.truth.empty()) {
    truths = TruthFolders(request.truth);
    for (const int number : numbers) {
      if (truths.contains(number)) continue;
      throw UsageError(fmt::format("`depth` {}: expected a folder of truth for time step {}, {:04}",
                                   request.truth.string(), number, number));
    }
  }
  const std::vector<View>& views = described.frames.front().views;
  const bool has_held_out = std::any_of(
      views.begin(), views.end(), [](const View& view) { return view.role == ViewRole::kHeldOut; });
  if (!has_held_out && truths.empty()) RequireOneFrame(described);
  ComparisonImages images(request, described);
  MeansOverTime means;
  DepthScorers scorers;
  std::map<std::string, eval::ViewFlicker> flicker;
  progress.Stage("evaluating time steps", static_cast<int>(described.frames.size()));
  QuietProgress quiet(progress);
  for (size_t step = 0; step < described.frames.size(); ++step) {
    progress.ThrowIfInterrupted();
    const DtrSet set = LoadedStep(request, described, step, progress);
    if (!truths.empty()) {
      ScoreDepth(set, truths.at(numbers[step]), quiet, &scorers,
                 [&](const View& view, const ScoredDepth& depth) {
                   flicker[view.name].Add(depth.measured, depth.truth, depth.scored);
                 });
    }
    if (has_held_out) {
      eval::EvaluateOptions evaluate;
      evaluate.render = request.render;
      evaluate.on_rendered = images.Writer();
      // Renderers know views by where they are in memory: every time step has one of its own.
      means.Add(eval::EvaluateHeldOut(set, evaluate, make_renderer(), quiet));
    }
    progress.Update(static_cast<int>(step) + 1);
  }
  images.Finish();
  EvaluateResult result;
  result.time_steps = described.frames.size();
  result.views = means.Report();
  if (!truths.empty()) {
    result.depth = ScoresOf(scorers);
    std::vector<eval::ViewFlicker> all;
    for (auto& [name, view] : flicker) all.push_back(std::move(view));
    result.flicker = eval::FlickerOf(all);
  }
  return result;
}

}  // namespace dtr::pipeline
