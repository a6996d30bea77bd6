#include "pipeline/bench/detail/set_quality.h"

#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/eval/render_sweep.h"
#include "dtr/io/set_io.h"

namespace dtr::pipeline {

namespace {

const std::filesystem::path& Made(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace

ScratchFolder::ScratchFolder(const std::filesystem::path& folder)
    : TemporaryFolder(Made(folder), ".measured-") {}

DtrSet LoadToEvaluate(const std::filesystem::path& folder, bool sigma, Progress& progress) {
  io::LoadOptions load;
  load.held_out = load.completed = true;
  load.sigma = sigma;
  load.warn = [&progress](const std::string& line) { progress.Note(line); };
  return io::LoadSet(folder, load);
}

void EvaluateImages(const DtrSet& set, const RenderOptions& render,
                    const eval::RenderFunction& renderer, eval::SweepMeasurement& measured) {
  const std::vector<View>& views = set.frames.front().views;
  eval::EvaluateOptions evaluate;
  evaluate.render = render;
  evaluate.leave_one_out = std::none_of(
      views.begin(), views.end(), [](const View& view) { return view.role == ViewRole::kHeldOut; });
  SilentProgress silent;  // the sweep counts points, not images
  const eval::ViewScore mean = eval::EvaluateHeldOut(set, evaluate, renderer, silent).mean;
  if (!mean.psnr_db) throw Error("bench: no photo has a pixel to compare with");
  measured.psnr_db = mean.psnr_db;
  measured.error = eval::RmsLevels(*mean.psnr_db);
  measured.figures["coverage"] = mean.coverage;
  if (mean.psnr_covered_db) measured.figures["psnr_covered_db"] = *mean.psnr_covered_db;
  if (mean.ssim) measured.figures["ssim"] = *mean.ssim;
}

}  // namespace dtr::pipeline
