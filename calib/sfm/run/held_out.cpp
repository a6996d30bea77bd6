#include "calib/sfm/run/held_out.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>

#include "calib/lens_groups.h"
#include "calib/sfm/registration/register_view.h"
#include "calib/sfm/run/colmap_steps.h"
#include "calib/sfm/run/own_steps.h"
#include "calib/sfm/run/pairs.h"
#include "calib/sfm/run/sfm_steps.h"
#include "calib/sfm/run/store.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/quiet_progress.h"

namespace dtr::sfm {
namespace fs = std::filesystem;
namespace {

constexpr char kAliasPrefix[] = "held_";  // sources have none: names never meet

// What every held-out photo is registered against.
struct Frozen {
  const calib::SfmModel& model;        // with the sources' own names
  std::vector<SfmImageInput> sources;  // sorted by name, as their workspace has them
  std::vector<std::string> aliases;    // of `sources`, in their database
  std::vector<fs::path> files;         // of `sources`
  fs::path workspace;
  std::string fingerprint;      // of the model
  bool forward_motion = false;  // its mapper needed other thresholds
};

// The sources on small images, looked at once, by the first photo that needs them; one photo's
// pixels at a time, in the place of the features that this photo has by then.
class SmallSources {
 public:
  explicit SmallSources(const Frozen& frozen) : files_(frozen.files) {}
  std::span<const Features> Of(Progress& progress) {
    std::call_once(once_, [&] {
      const ThreadLimit one(1);
      features_ = SmallFeaturesOf(files_, 0, progress);
    });
    return features_;
  }

 private:
  std::span<const fs::path> files_;
  std::once_flag once_;
  std::vector<Features> features_;
};

// The camera of an image, or, where a stabiliser made one lens a camera for every image, the lens
// they have in common: under the id that the database knows, which no image uses any more.
std::uint32_t LensOf(const calib::SfmModel& model, std::uint32_t camera_id) {
  const calib::LensCamera& camera = model.cameras.at(camera_id);
  for (const auto& [id, other] : model.cameras) {
    if (!HasImages(model, id) && calib::SameButForPrincipalPoint(camera, other)) return id;
  }
  return camera_id;
}

// The frozen camera of a source with the photo's group and size, if one is registered.
std::optional<std::uint32_t> SharedCamera(const Frozen& frozen, const SfmImageInput& photo,
                                          bool share) {
  if (!share) return std::nullopt;
  for (const calib::SfmImage& image : frozen.model.images) {
    const auto source = std::lower_bound(
        frozen.sources.begin(), frozen.sources.end(), image.name,
        [](const SfmImageInput& a, const std::string& name) { return a.name < name; });
    if (source == frozen.sources.end() || source->name != image.name) continue;
    if (source->camera_group == photo.camera_group && source->width_px == photo.width_px &&
        source->height_px == photo.height_px) {
      return LensOf(frozen.model, image.camera_id);
    }
  }
  return std::nullopt;
}

// The sources to match a photo with: all, or the most resembling.
std::vector<size_t> PartnersOf(Workspace& workspace, const Frozen& frozen, SmallSources& small) {
  std::vector<size_t> partners(frozen.sources.size());
  for (size_t i = 0; i < partners.size(); ++i) partners[i] = i;
  if (partners.size() > kExhaustiveLimit) {
    const std::vector<fs::path> file{workspace.FileOf(0)};
    const Features own = std::move(SmallFeaturesOf(file, 0, workspace.progress()).front());
    partners = MostResembling(own, small.Of(workspace.progress()));
  }
  return partners;
}

// What COLMAP needs for a photo's pose.
RegistrationInput InputFor(Workspace& workspace, const Frozen& frozen, SmallSources& small) {
  RegistrationInput input{frozen.workspace, frozen.model, {}, {}, frozen.forward_motion};
  for (const calib::SfmImage& image : frozen.model.images) {
    const auto source = std::lower_bound(
        frozen.sources.begin(), frozen.sources.end(), image.name,
        [](const SfmImageInput& a, const std::string& name) { return a.name < name; });
    if (source == frozen.sources.end() || source->name != image.name) {
      throw UsageError(image.name + ": expected every image of the model among the sources");
    }
    input.aliases.push_back(frozen.aliases[static_cast<size_t>(source - frozen.sources.begin())]);
  }
  for (const size_t i : PartnersOf(workspace, frozen, small)) {
    input.partners.push_back(frozen.aliases[i]);
  }
  return input;
}

// The photo's pose by calib/sfm, as a model of it alone in registered/; none there: it has no pose.
void RegisterHere(Workspace& workspace, const Frozen& frozen, SmallSources& small,
                  const CameraGroup& group, const ExtractionPlan& plan, const SfmOptions& options,
                  const fs::path& output) {
  std::map<std::string, const calib::SfmImage*> image_called;
  for (const calib::SfmImage& image : frozen.model.images) image_called[image.name] = &image;
  const FeatureFile features(frozen.workspace / kFeatureFile);
  std::vector<SourceView> sources;
  for (const size_t i : PartnersOf(workspace, frozen, small)) {
    const auto found = image_called.find(frozen.sources[i].name);
    if (found == image_called.end()) continue;
    sources.push_back(
        {found->second, &frozen.model.cameras.at(found->second->camera_id), features.Of(i)});
  }
  const GroupLenses start = LensesOf(workspace, {group});
  const UnregisteredView view{
      FeaturesOf(workspace.FileOf(0), workspace.images()[0].mask_file, plan.max_image_size_px,
                 plan.max_features),
      group.camera_id ? frozen.model.cameras.at(*group.camera_id) : start.lenses.front(),
      group.camera_id.has_value(), start.focal_is_known.front()};
  const int min_inliers = frozen.forward_motion ? kMinInliersForward : kMinInliers;
  auto registered =
      RegisterView(view, sources, frozen.model, min_inliers, options.seed, workspace.progress());
  if (!registered) return;
  calib::SfmModel model;
  registered->image.id = registered->image.camera_id = group.camera_id.value_or(1);
  registered->image.name = workspace.AliasOf(0);
  model.cameras[registered->image.camera_id] = registered->camera;
  for (const calib::SfmFeature& feature : registered->image.features) {
    if (feature.point_id == calib::SfmFeature::kNoPoint) continue;
    model.points.emplace(feature.point_id, frozen.model.points.at(feature.point_id));
  }
  model.images.push_back(std::move(registered->image));
  options.colmap->WriteModel(output, model);
}

struct Placed {
  std::optional<calib::SfmImage> image;
  calib::LensCamera camera;
  std::vector<StepRecord> runs;
  std::string version;
};

// Features of the result that were matched with points the frozen model has; others (COLMAP made
// none here) would point to nowhere.
void KeepFrozenPoints(const calib::SfmModel& model, calib::SfmImage& image) {
  for (calib::SfmFeature& feature : image.features) {
    if (!model.points.contains(feature.point_id)) feature.point_id = calib::SfmFeature::kNoPoint;
  }
}

Placed Place(const fs::path& images_dir, const SfmImageInput& photo, const Frozen& frozen,
             SmallSources& small, const fs::path& folder, const SfmOptions& options,
             Progress& progress) {
  Workspace workspace(folder, images_dir, std::span(&photo, 1), kAliasPrefix, progress,
                      VersionOf(options));
  auto groups = GroupCameras(workspace.images(), CameraModelOf(options), true);
  groups.front().camera_id = SharedCamera(frozen, photo, options.share_intrinsics_within_group);
  ExtractionPlan plan =
      PlanExtraction(workspace.images(), options.memory_gb, options.max_image_size_px);
  plan.max_features = options.max_features;  // as the sources', which `frozen` vouches for
  const auto inputs =
      fmt::format("model {} size {} seed {} {} [{}]{}", frozen.fingerprint, plan.max_image_size_px,
                  options.seed, options.lens_model, ParamsText(groups.front().params),
                  frozen.forward_motion ? " forward" : "");
  const fs::path registered = workspace.folder() / "registered";
  workspace.Step("registration", inputs, [&] {
    RemoveTree(registered);
    if (options.engine == SfmEngine::kColmap) {
      options.colmap->Register(workspace, InputFor(workspace, frozen, small), groups, plan, options,
                               registered);
      return;
    }
    workspace.RunHere(
        [&] { RegisterHere(workspace, frozen, small, groups.front(), plan, options, registered); });
  });
  Placed placed;
  placed.runs = workspace.Report().steps;
  placed.version = workspace.version();
  const calib::SfmModel model =
      fs::exists(registered) ? options.colmap->ReadModel(registered) : calib::SfmModel{};
  for (const calib::SfmImage& image : model.images) {
    if (image.name != workspace.AliasOf(0)) continue;
    placed.camera = groups.front().camera_id ? frozen.model.cameras.at(*groups.front().camera_id)
                                             : model.cameras.at(image.camera_id);
    placed.image = image;
    placed.image->name = photo.name;
    KeepFrozenPoints(frozen.model, *placed.image);
  }
  WriteReport(workspace.folder(), workspace.Report());
  return placed;
}

std::string FingerprintOf(const calib::SfmModel& model, const fs::path& folder,
                          const ColmapSteps& colmap) {
  const fs::path copy = folder / "frozen";
  RemoveTree(copy);
  colmap.WriteModel(copy, model);
  std::string text;
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"}) {
    text += Sha256OfFile(copy / name);
  }
  RemoveTree(copy);
  return text;
}

Frozen FrozenFrom(const calib::SfmModel& model, std::span<const SfmImageInput> sources,
                  const fs::path& images_dir, const fs::path& source_workspace,
                  const fs::path& workspace, const ColmapSteps& colmap) {
  Frozen frozen{model, {sources.begin(), sources.end()}, {}, {}, {}, {}};
  frozen.forward_motion = fs::exists(source_workspace / kForwardMotionNote);
  std::sort(frozen.sources.begin(), frozen.sources.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  for (size_t i = 0; i < frozen.sources.size(); ++i) {
    frozen.aliases.push_back(Workspace::AliasFor("", i, frozen.sources[i].name));
    frozen.files.push_back(images_dir / frozen.sources[i].name);
  }
  frozen.workspace = fs::absolute(source_workspace);
  frozen.fingerprint = FingerprintOf(model, workspace, colmap);
  return frozen;
}

HeldOutResult Collected(const Frozen& frozen, const std::vector<SfmImageInput>& photos,
                        std::vector<Placed> placed, bool share) {
  // Cameras of the frozen model keep their ids; own ones are numbered above them.
  const std::uint32_t first_own =
      frozen.model.cameras.empty() ? 1 : frozen.model.cameras.rbegin()->first + 1;
  HeldOutResult result;
  for (size_t i = 0; i < placed.size(); ++i) {
    result.report.version = placed[i].version;
    for (auto& run : placed[i].runs) result.report.steps.push_back(std::move(run));
    if (!placed[i].image) {
      result.not_registered.push_back(photos[i].name);
      continue;
    }
    calib::SfmImage& image = result.images.emplace_back(std::move(*placed[i].image));
    image.id = static_cast<std::uint32_t>(i + 1);
    image.camera_id =
        SharedCamera(frozen, photos[i], share).value_or(first_own + static_cast<std::uint32_t>(i));
    result.cameras[image.camera_id] = placed[i].camera;
  }
  result.report.not_registered = result.not_registered;
  return result;
}

}  // namespace

HeldOutResult RegisterHeldOut(const fs::path& images_dir, std::span<const SfmImageInput> held_out,
                              const calib::SfmModel& source_model,
                              std::span<const SfmImageInput> sources,
                              const fs::path& source_workspace, const fs::path& workspace,
                              const SfmOptions& options, Progress& progress) {
  CameraModelOf(options);  // reject before any work
  MakeFolder(workspace);
  const Frozen frozen =
      FrozenFrom(source_model, sources, images_dir, source_workspace, workspace, *options.colmap);
  std::vector<SfmImageInput> photos(held_out.begin(), held_out.end());
  std::sort(photos.begin(), photos.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  // One photo per thread, each with one thread of its own: as many as the memory allows at once.
  const int at_once =
      photos.empty() ? 1
                     : PlanExtraction(photos, options.memory_gb, options.max_image_size_px).threads;
  SmallSources small(frozen);
  std::vector<Placed> placed(photos.size());
  progress.Stage("registering held-out photos", static_cast<int>(photos.size()));
  std::atomic<int> done = 0;
  ParallelFor(0, static_cast<int>(photos.size()), at_once, [&](int i) {
    const auto index = static_cast<size_t>(i);
    // Its own stages would tangle with those of the photos beside it.
    QuietProgress quiet(progress);
    // A name is no folder name in general; its hash is, and does not depend on the other photos.
    const auto folder = workspace / Sha256(std::as_bytes(std::span(photos[index].name)));
    placed[index] = Place(images_dir, photos[index], frozen, small, folder, options, quiet);
    progress.Update(++done);
  });

  HeldOutResult result =
      Collected(frozen, photos, std::move(placed), options.share_intrinsics_within_group);
  WriteReport(workspace, result.report);
  return result;
}

}  // namespace dtr::sfm
