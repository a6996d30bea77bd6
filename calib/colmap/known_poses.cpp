#include "calib/colmap/known_poses.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/colmap/database.h"
#include "calib/colmap/graph_database.h"
#include "calib/colmap/model_io.h"
#include "calib/colmap/point_colours.h"
#include "calib/colmap/sfm_steps.h"
#include "calib/colmap/view_pyramids.h"
#include "calib/sfm/mapping/triangulate.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"

namespace dtr::colmap {
namespace fs = std::filesystem;
namespace {

// Cameras by their values, numbered in the order of first use, and the images in order of names.
struct KnownCameras {
  std::vector<PosedImage> images;
  std::vector<CameraGroup> groups;  // group g has camera id g + 1
  calib::SfmModel model;            // no features, no points
};

bool SameCamera(const calib::LensCamera& a, const calib::LensCamera& b) {
  return a.model == b.model && a.width_px == b.width_px && a.height_px == b.height_px &&
         a.params == b.params;
}

KnownCameras Arranged(std::span<const PosedImage> images) {
  KnownCameras known;
  known.images.assign(images.begin(), images.end());
  std::sort(known.images.begin(), known.images.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  for (size_t i = 0; i < known.images.size(); ++i) {
    const PosedImage& image = known.images[i];
    auto camera = std::find_if(known.model.cameras.begin(), known.model.cameras.end(),
                               [&](const auto& c) { return SameCamera(c.second, image.camera); });
    if (camera == known.model.cameras.end()) {
      const auto id = static_cast<std::uint32_t>(known.model.cameras.size() + 1);
      camera = known.model.cameras.emplace(id, image.camera).first;
      CameraGroup& group = known.groups.emplace_back();
      group.model = image.camera.model;
      group.params = image.camera.params;
    }
    known.groups[camera->first - 1].images.push_back(i);
    calib::SfmImage& posed = known.model.images.emplace_back();
    posed.id = static_cast<std::uint32_t>(i + 1);
    posed.name = image.name;
    posed.camera_id = camera->first;
    posed.cam_from_world = image.cam_from_world;
  }
  return known;
}

std::vector<SfmImageInput> InputsOf(std::span<const PosedImage> images) {
  std::vector<SfmImageInput> inputs;
  for (const PosedImage& image : images) {
    SfmImageInput& input = inputs.emplace_back();
    input.name = image.name;
    input.width_px = image.camera.width_px;
    input.height_px = image.camera.height_px;
    input.mask_file = image.mask_file;
  }
  return inputs;
}

// The poses and cameras as text, exact, for the fingerprint.
std::string TextOf(const KnownCameras& known) {
  std::string text;
  for (const PosedImage& image : known.images) {
    const auto& q = image.cam_from_world.rotation;
    const auto& t = image.cam_from_world.translation;
    text += fmt::format("{} {} {} {} {} {} {}\n", q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z());
  }
  return text;
}

void CheckKept(const std::string& where, const KnownCameras& known, const calib::SfmModel& model) {
  double extent = 1;
  for (const auto& image : known.images) {
    extent = std::max(extent, image.cam_from_world.translation.cwiseAbs().maxCoeff());
  }
  for (const calib::SfmImage& image : model.images) {
    const auto given = std::find_if(known.images.begin(), known.images.end(),
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

// Puts the given cameras and poses, bit for bit, around the features and points COLMAP found.
calib::SfmModel WithGivenCameras(const KnownCameras& known, calib::SfmModel found) {
  calib::SfmModel model = known.model;
  model.points = std::move(found.points);
  for (calib::SfmImage& image : model.images) {
    const auto same = std::find_if(found.images.begin(), found.images.end(),
                                   [&](const auto& other) { return other.name == image.name; });
    if (same != found.images.end()) image.features = std::move(same->features);
  }
  return model;
}

// The posed model under the numbers of the database, which extractor threads hand out as they go.
calib::SfmModel NumberedAsInDatabase(const Workspace& workspace, const KnownCameras& known) {
  const auto ids = ReadDatabaseIds(workspace.database());
  calib::SfmModel model;
  for (size_t i = 0; i < known.images.size(); ++i) {
    const auto in_database = ids.find(workspace.AliasOf(i));
    if (in_database == ids.end()) {
      throw Error(
          fmt::format("{}: expected every photo in the database, found that COLMAP left out "
                      "{}; it may not be able to read the file",
                      workspace.database().string(), known.images[i].name));
    }
    calib::SfmImage& image = model.images.emplace_back(known.model.images[i]);
    image.id = in_database->second.image_id;
    image.camera_id = in_database->second.camera_id;
    model.cameras[image.camera_id] = known.images[i].camera;
  }
  return model;
}

// What to say where COLMAP's triangulator fails, as it does where there is nothing to triangulate.
void RequireMatches(const Workspace& workspace, const KnownCameras& known) {
  if (!ReadDatabaseMatches(workspace.database()).pairs.empty()) return;
  throw Error(fmt::format(
      "expected photos that show the same points to triangulate, found that no two of the {} have "
      "any in common; photos must overlap and show texture",
      known.images.size()));
}

void Triangulate(Workspace& workspace, const KnownCameras& known, const SfmOptions& options) {
  const fs::path input = workspace.folder() / "posed", output = workspace.folder() / "triangulated";
  for (const fs::path& folder : {input, output, workspace.folder() / "model"}) RemoveTree(folder);
  MakeFolder(output);
  workspace.WriteModelHere(input, NumberedAsInDatabase(workspace, known));
  Arguments arguments(workspace.program(), "point_triangulator");
  arguments.AddIfKnown({"random_seed", "default_random_seed"}, fmt::format("{}", options.seed))
      .Add({"database_path"}, workspace.database().string())
      .Add({"image_path"}, workspace.images_folder().string())
      .Add({"input_path"}, input.string())
      .Add({"output_path"}, output.string())
      .Add({"Mapper.num_threads"}, std::to_string(workspace.threads()))
      .Add({"Mapper.ba_refine_focal_length"}, "0")
      .Add({"Mapper.ba_refine_principal_point"}, "0")
      .Add({"Mapper.ba_refine_extra_params"}, "0")
      .AddIfKnown({"refine_intrinsics"}, "0")
      // Known poses vouch for a point that only two photos show; with two photos there is no other.
      .Add({"Mapper.tri_ignore_two_view_tracks"}, "0");
  workspace.progress().Stage("triangulation", static_cast<int>(workspace.images().size()));
  int done = 0;
  try {
    workspace.Run(arguments, [&](const std::string& line) {
      if (line.find("Triangulating image #") != std::string::npos) {
        workspace.progress().Update(++done);
      }
    });
  } catch (const Interrupted&) {
    throw;
  } catch (const Error&) {
    RequireMatches(workspace, known);
    throw;
  }
  calib::SfmModel found = workspace.ReadModelHere(output);
  CheckKept(output.string(), known, found);
  WriteModel(workspace.folder() / "model", WithGivenCameras(known, std::move(found)),
             Format::kBinary);
}

// As Triangulate, by calib/sfm.
void TriangulateHere(Workspace& workspace, const KnownCameras& known) {
  RemoveTree(workspace.folder() / "model");
  RequireMatches(workspace, known);
  workspace.progress().Stage("triangulation", 0);
  workspace.RunHere([&] {
    sfm::ViewGraph graph = ReadViewGraph(workspace.database());
    std::vector<Pose> poses;
    for (size_t i = 0; i < graph.images.size(); ++i) {
      graph.images[i].name = known.images[i].name;
      poses.push_back(known.images[i].cam_from_world);
    }
    for (size_t c = 0; c < graph.cameras.size(); ++c) {
      graph.cameras[c] = known.model.cameras.at(static_cast<std::uint32_t>(c + 1));
    }
    calib::SfmModel found = sfm::TriangulateMatches(graph, poses, workspace.threads());
    ColourPoints(workspace, found);
    WriteModel(workspace.folder() / "model", WithGivenCameras(known, std::move(found)),
               Format::kBinary);
  });
}

// COLMAP 3 ends without a word at a camera model that it does not know.
void RequireColmapsModels(std::span<const PosedImage> images) {
  for (const PosedImage& image : images) {
    if (static_cast<int>(image.camera.model) <=
        static_cast<int>(calib::CameraModel::kThinPrismFisheye)) {
      continue;
    }
    throw Error(fmt::format(
        "{}: its camera model {} is not known to COLMAP 3; let the points be triangulated without "
        "COLMAP (`sfm` auto or global)",
        image.name, calib::NameOf(image.camera.model)));
  }
}

// All matches that agree with a geometry of their pair.
std::vector<calib::MatchedPair> MatchesIn(const Workspace& workspace) {
  const sfm::ViewGraph graph = ReadViewGraph(workspace.database());
  std::vector<calib::MatchedPair> pairs;
  for (const sfm::PairGeometry& pair : graph.pairs) {
    calib::MatchedPair& out = pairs.emplace_back();
    out.a = pair.image_a;
    out.b = pair.image_b;
    const auto &in_a = graph.images[static_cast<size_t>(pair.image_a)].pixels,
               &in_b = graph.images[static_cast<size_t>(pair.image_b)].pixels;
    for (const auto& [a, b] : pair.matches) out.pixels.emplace_back(in_a[a], in_b[b]);
  }
  return pairs;
}

std::vector<std::string> ImagesWithoutPoints(const calib::SfmModel& model) {
  std::vector<std::string> names;
  for (const calib::SfmImage& image : model.images) {
    const bool any = std::any_of(image.features.begin(), image.features.end(), [](const auto& f) {
      return f.point_id != calib::SfmFeature::kNoPoint;
    });
    if (!any) names.push_back(image.name);
  }
  return names;
}

}  // namespace

std::vector<calib::MatchedPair> MatchWithoutCameras(const fs::path& images_dir,
                                                    std::span<const PosedImage> images,
                                                    const fs::path& workspace_folder,
                                                    const SfmOptions& given, Progress& progress) {
  SfmOptions options = given;
  options.engine = SfmEngine::kGlobal;
  const std::vector<SfmImageInput> inputs = InputsOf(images);
  Workspace workspace(workspace_folder, images_dir, inputs, "", ResolveThreads(options.threads),
                      progress, options.engine, options.folder_is_shared);
  SfmReport report;
  FeaturesAndMatches(workspace, {GroupCameras(workspace.images(), CameraModelOf(options), true)},
                     options, report);
  return MatchesIn(workspace);
}

SfmResult TriangulateWithPoses(const fs::path& images_dir, std::span<const PosedImage> images,
                               const fs::path& workspace_folder, const SfmOptions& options,
                               Progress& progress, const std::optional<SfmPart>& part) {
  if (images.size() < 2) {
    throw UsageError(fmt::format("{}: expected at least two photos with poses, found {}",
                                 images_dir.string(), images.size()));
  }
  if (options.engine == SfmEngine::kColmap) RequireColmapsModels(images);
  const KnownCameras known = Arranged(images);
  Workspace workspace(workspace_folder, images_dir, InputsOf(known.images), "",
                      ResolveThreads(options.threads), progress, options.engine,
                      options.folder_is_shared);
  SfmResult result;
  // Where no pair could overlap the cameras are doubtful: the photos themselves are asked then.
  const ImagePairs pairs = PairsThatMayOverlap(known.images);
  FeaturesAndMatches(workspace,
                     {known.groups, pairs.empty() ? std::nullopt : std::optional(pairs), true},
                     options, result.report, part);
  if (part) return result;
  std::string inputs = TextOf(known) + fmt::format("seed {}", options.seed);
  const bool by_colmap = options.engine == SfmEngine::kColmap;
  workspace.Step("triangulation", inputs, [&] {
    by_colmap ? Triangulate(workspace, known, options) : TriangulateHere(workspace, known);
  });
  result.model = ReadModel(workspace.folder() / "model");
  if (!by_colmap) result.matches = MatchesIn(workspace);
  CompleteReport(workspace, result.model, result.report);
  result.report.not_registered = ImagesWithoutPoints(result.model);
  WriteReport(workspace.folder(), result.report);
  return result;
}

}  // namespace dtr::colmap
