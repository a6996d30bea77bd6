#include "pipeline/build/build_part.h"

#include <fmt/format.h>

#include "dtr/base/error.h"
#include "pipeline/build/build.h"
#include "pipeline/build/detail/build_options.h"
#include "pipeline/build/detail/part_files.h"
#include "pipeline/core/calibrate.h"
#include "stereo/engine.h"

namespace dtr::pipeline {
namespace {

void Reject(bool given, const char* what) {
  if (given) throw UsageError(std::string("a build in parts: ") + what);
}

void RequireShareable(const BuildOptions& options) {
  Reject(options.depth.time_budget_s.has_value(),
         "`time_budget` measures how much one machine does; give `preset`");
  Reject(options.depth.engine == "colmap" || options.depth.engine == "prior",
         "expected `engine` patchmatch, sgbm or none");
  Reject(options.depth.prior.given(), "depth priors do not go with it; leave out `depth_prior`");
  Reject(!options.force_stage.empty(),
         "`force_stage` does not go with it; delete the partial set to begin again");
}

// Passes of the engine in which views take account of each other.
int PassesOf(const BuildOptions& options) {
  return stereo::MakeEngine(options.depth.engine, QualityOf(options.depth))->Rounds();
}

}  // namespace

std::vector<BuildStage> BuildStages(const BuildOptions& asked) {
  const BuildOptions options = ByPreset(asked);
  RequireShareable(options);
  std::vector<BuildStage> stages = {{"capture", false}};
  // COLMAP looks for features and matches in a process of its own, all at once.
  if (options.sfm.engine != sfm::SfmEngine::kColmap &&
      NeedsFeatures(options.poses, options.poses_format)) {
    stages.insert(
        stages.end(),
        {{"features", true}, {"pairs", false}, {"matching", true}, {"verification", true}});
  }
  stages.insert(stages.end(), {{"calibration", false}, {"undistortion", true}});
  if (options.depth.engine == "none") return stages;
  stages.push_back({"ranges", false});
  const int passes = PassesOf(options);
  if (passes > 0) stages.push_back({"search", true});
  for (int pass = 1; pass <= passes; ++pass) stages.push_back({fmt::format("pass-{}", pass), true});
  stages.push_back({"maps", true});
  return stages;
}

std::string NameOf(const BuildPart& part) {
  if (part.part.count == 1) return part.stage;
  return fmt::format("{}, part {} of {}", part.stage, part.part.index + 1, part.part.count);
}

std::optional<DonePart> FindDonePart(const std::filesystem::path& output, const BuildPart& part) {
  return ReadDonePart(io::SetWriter::WorkFolderOf(output), part);
}

}  // namespace dtr::pipeline
