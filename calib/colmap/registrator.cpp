#include <fmt/format.h>

#include "calib/colmap/database.h"
#include "calib/colmap/features.h"
#include "calib/colmap/matching.h"
#include "calib/colmap/model_io.h"
#include "calib/colmap/program.h"
#include "calib/colmap/steps.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"

namespace dtr::colmap {
namespace fs = std::filesystem;
namespace {

// The model under the names its database knows. COLMAP puts the database's parameters, from
// before refinement and perhaps of another lens model (it crashes then), in the place of a camera
// that no registered image has: where `camera_id` is such a one, an image of the copy takes it.
// Registration looks at points, not at other images' cameras.
void WriteAliased(const fs::path& folder, const sfm::RegistrationInput& input,
                  std::optional<std::uint32_t> camera_id) {
  calib::SfmModel model = input.model;
  if (camera_id && !HasImages(model, *camera_id)) model.images.front().camera_id = *camera_id;
  for (size_t i = 0; i < model.images.size(); ++i) model.images[i].name = input.aliases[i];
  colmap::WriteModel(folder, model, Format::kBinary);
}

}  // namespace

void Steps::Register(sfm::Workspace& workspace, const sfm::RegistrationInput& input,
                     const std::vector<sfm::CameraGroup>& groups, const sfm::ExtractionPlan& plan,
                     const sfm::SfmOptions& options, const fs::path& registered) const {
  const fs::path database = DatabaseOf(workspace), sources = input.workspace / database.filename(),
                 model = workspace.folder() / "source";
  if (!fs::exists(sources)) {
    throw Error(sources.string() +
                ": expected the database that made the source model, found none; run structure "
                "from motion on the sources again");
  }
  CopyDatabase(sources, database);
  ExtractFeatures(workspace, database, groups, plan, options.seed);
  std::vector<std::pair<std::string, std::string>> pairs;
  for (const std::string& partner : input.partners) {
    pairs.emplace_back(workspace.AliasOf(0), partner);
  }
  MatchPairs(workspace, database, pairs, 1, options.seed);
  RemoveTree(model);
  sfm::MakeFolder(registered);
  WriteAliased(model, input, groups.front().camera_id);
  Arguments arguments("image_registrator");
  arguments.AddIfKnown({"random_seed", "default_random_seed"}, fmt::format("{}", options.seed))
      .AddIfKnown({"Mapper.random_seed"}, fmt::format("{}", options.seed))
      .Add({"database_path"}, database.string())
      .Add({"input_path"}, model.string())
      .Add({"output_path"}, registered.string())
      .Add({"Mapper.num_threads"}, "1");
  if (input.forward_motion) AllowForwardMotion(arguments);
  RunStep(workspace, arguments, nullptr);
  RemoveTree(model);  // a copy of the model per photo would fill the disk
  RemoveDatabase(database);
}

}  // namespace dtr::colmap
