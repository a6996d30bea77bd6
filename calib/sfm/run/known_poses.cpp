#include "calib/sfm/run/known_poses.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/sfm/mapping/triangulate.h"
#include "calib/sfm/run/colmap_steps.h"
#include "calib/sfm/run/own_steps.h"
#include "calib/sfm/run/point_colours.h"
#include "calib/sfm/run/sfm_steps.h"
#include "calib/sfm/run/view_pyramids.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"

namespace dtr::sfm {
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

calib::SfmModel TriangulateHere(Workspace& workspace, const KnownCameras& known) {
  RequireMatches(SummaryOf(workspace).pairs.size(), known.images.size());
  workspace.progress().Stage("triangulation", 0);
  calib::SfmModel found;
  workspace.RunHere([&] {
    ViewGraph graph = ReadGraph(workspace);
    std::vector<Pose> poses;
    for (const PosedImage& image : known.images) poses.push_back(image.cam_from_world);
    for (size_t c = 0; c < graph.cameras.size(); ++c) {
      graph.cameras[c] = known.model.cameras.at(static_cast<std::uint32_t>(c + 1));
    }
    found = TriangulateMatches(graph, poses);
    ColourPoints(workspace, found);
  });
  return found;
}

void TriangulationStep(Workspace& workspace, const KnownCameras& known, const SfmOptions& options) {
  const fs::path folder = workspace.folder() / "model";
  RemoveTree(folder);
  calib::SfmModel found = options.engine == SfmEngine::kColmap
                              ? options.colmap->Triangulate(workspace, known.model, options)
                              : TriangulateHere(workspace, known);
  options.colmap->WriteModel(folder, WithGivenCameras(known, std::move(found)));
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
  const ViewGraph graph = ReadGraph(workspace);
  std::vector<calib::MatchedPair> pairs;
  for (const PairGeometry& pair : graph.pairs) {
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

void RequireMatches(size_t pairs, size_t photos) {
  if (pairs > 0) return;
  throw NotDecidable(fmt::format(
      "expected photos that show the same points to triangulate, found that no two of the {} have "
      "any in common; photos must overlap and show texture",
      photos));
}

std::vector<calib::MatchedPair> MatchWithoutCameras(const fs::path& images_dir,
                                                    std::span<const PosedImage> images,
                                                    const fs::path& workspace_folder,
                                                    const SfmOptions& given, Progress& progress) {
  SfmOptions options = given;
  options.engine = SfmEngine::kGlobal;
  const std::vector<SfmImageInput> inputs = InputsOf(images);
  Workspace workspace(workspace_folder, images_dir, inputs, "", progress, VersionOf(options),
                      options.folder_is_shared);
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
  Workspace workspace(workspace_folder, images_dir, InputsOf(known.images), "", progress,
                      VersionOf(options), options.folder_is_shared);
  SfmResult result;
  // Where no pair could overlap the cameras are doubtful: the photos themselves are asked then.
  const ImagePairs pairs = PairsThatMayOverlap(known.images);
  FeaturesAndMatches(workspace,
                     {known.groups, pairs.empty() ? std::nullopt : std::optional(pairs), true},
                     options, result.report, part);
  if (part) return result;
  std::string inputs = TextOf(known) + fmt::format("seed {}", options.seed);
  workspace.Step("triangulation", inputs, [&] { TriangulationStep(workspace, known, options); });
  result.model = options.colmap->ReadModel(workspace.folder() / "model");
  if (options.engine != SfmEngine::kColmap) result.matches = MatchesIn(workspace);
  CompleteReport(workspace, result.model, result.report);
  result.report.not_registered = ImagesWithoutPoints(result.model);
  WriteReport(workspace.folder(), result.report);
  return result;
}

}  // namespace dtr::sfm
