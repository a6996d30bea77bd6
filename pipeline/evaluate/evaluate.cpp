#include "pipeline/evaluate/evaluate.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"
#include "dtr/io/set_io.h"
#include "dtr/render/time_steps.h"
#include "pipeline/evaluate/detail/comparison_images.h"
#include "pipeline/evaluate/detail/evaluate_steps.h"
#include "pipeline/evaluate/evaluate_depth.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

// Held-out photos that found no camera when the set was built.
std::vector<std::string> NotRegistered(const DtrSet& set) {
  const auto provenance = nlohmann::json::parse(set.provenance_json);
  std::vector<std::string> names;
  // Provenance is free text to a reader of sets: what has another form tells nothing here.
  const auto listed = provenance.find("held_out_not_registered");
  if (listed == provenance.end() || !listed->is_array()) return names;
  for (const auto& name : *listed) {
    if (name.is_string()) names.push_back(name.get<std::string>());
  }
  return names;
}

DtrSet Load(const EvaluateRequest& request, Progress& progress) {
  io::LoadOptions load;
  load.held_out = true;
  load.completed = !request.measured_only;
  load.sigma = !request.truth.empty();
  load.warn = [&progress](const std::string& line) { progress.Note(line); };
  DtrSet set = io::LoadSet(request.set, load);
  RequireOneFrame(set);
  return set;
}

}  // namespace

EvaluateResult Evaluate(const EvaluateRequest& request,
                        const std::function<eval::RenderFunction()>& make_renderer,
                        Progress& progress) {
  if (fs::exists(request.images) && !fs::is_directory(request.images)) {
    throw UsageError(
        fmt::format("`images` {}: expected a folder, found a file", request.images.string()));
  }
  if (!request.leave_one_out) {
    const DtrSet described = io::ReadSet(request.set);
    if (described.frames.size() > 1) {
      return EvaluateSteps(request, described, make_renderer, progress);
    }
  }
  const DtrSet set = Load(request, progress);
  EvaluateResult result;
  if (!request.truth.empty()) {
    result.depth = EvaluateDepth(set, request.truth, progress);
  }
  eval::EvaluateOptions evaluate;
  evaluate.leave_one_out = request.leave_one_out;
  evaluate.render = request.render;
  evaluate.not_registered = NotRegistered(set);
  ComparisonImages images(request, set);
  evaluate.on_rendered = images.Writer();
  const bool has_held_out =
      std::any_of(set.frames.front().views.begin(), set.frames.front().views.end(),
                  [](const View& view) { return view.role == ViewRole::kHeldOut; });
  // With truth alone there is still something to measure.
  if (!request.leave_one_out && !has_held_out && !evaluate.not_registered.empty()) {
    result.views.not_registered = evaluate.not_registered;  // every held-out photo is lost: counted
  } else if (request.leave_one_out || has_held_out || !result.depth) {
    result.views = eval::EvaluateHeldOut(set, evaluate, make_renderer(), progress);
  }
  images.Finish();
  return result;
}

}  // namespace dtr::pipeline
