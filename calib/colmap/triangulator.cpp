#include <fmt/format.h>

#include <algorithm>

#include "calib/colmap/database.h"
#include "calib/colmap/model_io.h"
#include "calib/colmap/program.h"
#include "calib/colmap/steps.h"
#include "calib/sfm/run/known_poses.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"

namespace dtr::colmap {
namespace fs = std::filesystem;
namespace {

// COLMAP may return a pose it was told to keep with its quaternion normalised once more; more than
// this (radians; relative to the largest coordinate) means that it moved the camera.
constexpr double kPoseKept = 1e-9;

void CheckKept(const std::string& where, const calib::SfmModel& posed,
               const calib::SfmModel& model) {
  double extent = 1;
  for (const auto& image : posed.images) {
    extent = std::max(extent, image.cam_from_world.translation.cwiseAbs().maxCoeff());
  }
  for (const calib::SfmImage& image : model.images) {
    const auto given = std::find_if(posed.images.begin(), posed.images.end(),
                                    [&](const auto& other) { return other.name == image.name; });
    const Pose& a = image.cam_from_world;
    const Pose& b = given->cam_from_world;
    if (a.rotation.angularDistance(b.rotation) > kPoseKept ||
        (a.translation - b.translation).norm() > kPoseKept * extent) {
      throw Error(
          fmt::format("{}: image {}: expected the given pose back from colmap "
                      "point_triangulator, found another; this version of COLMAP refines "
                      "poses",
                      where, image.name));
    }
  }
}

// The posed model under the names and numbers of the database, which extractor threads hand out as
// they go.
calib::SfmModel NumberedAsInDatabase(const sfm::Workspace& workspace,
                                     const calib::SfmModel& posed) {
  const auto ids = ReadDatabaseIds(DatabaseOf(workspace));
  calib::SfmModel model;
  for (size_t i = 0; i < posed.images.size(); ++i) {
    const auto in_database = ids.find(workspace.AliasOf(i));
    if (in_database == ids.end()) {
      throw Error(
          fmt::format("{}: expected every photo in the database, found that COLMAP left out "
                      "{}; it may not be able to read the file",
                      DatabaseOf(workspace).string(), posed.images[i].name));
    }
    calib::SfmImage& image = model.images.emplace_back(posed.images[i]);
    image.id = in_database->second.image_id;
    image.name = workspace.AliasOf(i);
    image.camera_id = in_database->second.camera_id;
    model.cameras[image.camera_id] = posed.cameras.at(posed.images[i].camera_id);
  }
  return model;
}

}  // namespace

calib::SfmModel Steps::Triangulate(sfm::Workspace& workspace, const calib::SfmModel& posed,
                                   const sfm::SfmOptions& options) const {
  const fs::path input = workspace.folder() / "posed", output = workspace.folder() / "triangulated";
  for (const fs::path& folder : {input, output}) RemoveTree(folder);
  sfm::MakeFolder(output);
  colmap::WriteModel(input, NumberedAsInDatabase(workspace, posed), Format::kBinary);
  Arguments arguments("point_triangulator");
  arguments.AddIfKnown({"random_seed", "default_random_seed"}, fmt::format("{}", options.seed))
      .Add({"database_path"}, DatabaseOf(workspace).string())
      .Add({"image_path"}, workspace.images_folder().string())
      .Add({"input_path"}, input.string())
      .Add({"output_path"}, output.string())
      .Add({"Mapper.num_threads"}, std::to_string(ThreadLimit::Current()))
      .Add({"Mapper.ba_refine_focal_length"}, "0")
      .Add({"Mapper.ba_refine_principal_point"}, "0")
      .Add({"Mapper.ba_refine_extra_params"}, "0")
      .AddIfKnown({"refine_intrinsics"}, "0")
      // Known poses vouch for a point that only two photos show; with two photos there is no other.
      .Add({"Mapper.tri_ignore_two_view_tracks"}, "0");
  workspace.progress().Stage("triangulation", static_cast<int>(workspace.images().size()));
  int done = 0;
  try {
    RunStep(workspace, arguments, [&](const std::string& line) {
      if (line.find("Triangulating image #") != std::string::npos) {
        workspace.progress().Update(++done);
      }
    });
  } catch (const Interrupted&) {
    throw;
  } catch (const Error&) {
    // It fails, too, where there is nothing to triangulate.
    sfm::RequireMatches(Matched(workspace).pairs.size(), posed.images.size());
    throw;
  }
  calib::SfmModel found = ReadModelHere(workspace, output);
  CheckKept(output.string(), posed, found);
  return found;
}

}  // namespace dtr::colmap
