#include "datasets/make.h"

#include <cmath>
#include <cstdio>
#include <utility>

#include "datasets/layout.h"
#include "datasets/make_dynamic.h"
#include "datasets/render_truth.h"
#include "datasets/scene.h"
#include "datasets/write_truth.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/random.h"
#include "dtr/base/work_folder.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/image_io.h"
#include "dtr/io/panorama_xmp.h"
#include "dtr/types/panorama.h"

namespace dtr::datasets {
namespace {

RadialLens LensOf(const DatasetSpec& spec) { return {spec.k1, spec.k2, spec.fisheye}; }

namespace fs = std::filesystem;

constexpr int kMaxViews = 10000;  // names have four digits
constexpr int kMinSidePx = 16, kMaxSidePx = 16384;
// float32 depth keeps its relative precision far beyond; poses in double need lengths that differ
// less than this.
constexpr double kMaxScale = 1e6;
constexpr double kMaxOffset = 1e9;
constexpr double kMaxSeconds = 1000, kMaxRollS = 1;  // then the ball of `sphere` leaves the images
constexpr int kMaxSteps = 10000, kMaxStepsPerSecond = 1000;
constexpr double kMaxDriftStops = 10;
constexpr int kMinVisibleOthers = 2;  // as docs/ACCURACY.md counts pixels with true depth

void CheckRange(const char* field, double value, double low, double high) {
  if (value >= low && value <= high) return;
  char text[160];
  std::snprintf(text, sizeof text, "%s: expected %g to %g, found %g", field, low, high, value);
  throw UsageError(text);
}

std::string NumberName(int i) {
  char name[32];
  std::snprintf(name, sizeof name, "%04d", i);
  return name;
}

std::string SourceText(const DatasetSpec& spec) {
  if (spec.panoramas) {
    return "# " + spec.scene + ", " + std::to_string(spec.views) +
           " panoramas, synthetic\n"
           "Made by `dtr dataset make` (ray cast, analytic surfaces, procedural texture: no "
           "downloaded asset); the recipe is dataset.json.\n"
           "- `panoramas/`: equirectangular, rays of longitude and latitude.\n"
           "- `images/`, `depth/`, `cameras.json`: the views of a cube around each panorama, "
           "rendered as pinhole cameras, exact.\n";
  }
  return "# " + spec.scene + ", " + std::to_string(spec.views) +
         " views, synthetic\n"
         "Made by `dtr dataset make` (ray cast, analytic surfaces, procedural texture: no "
         "downloaded asset); the recipe is dataset.json.\n"
         "- `images/`: photos" +
         (!LensOf(spec).IsIdeal() ? ", with the lens distortion of dataset.json" : "") +
         ". `cameras.json`: ideal pinhole cameras, exact.\n"
         "- `depth/`: plane z at pixel centres of the pinhole grid, float32, 0 = nothing hit.\n"
         "- `masks/`: `_visible` seen by at least 2 other views (exact), `_texture` standard "
         "deviation of at least 4 levels in 9x9.\n";
}

/// One view's files. Everything is computed in the scene's own frame.
void WriteView(const DatasetSpec& spec, const Scene& scene, const std::vector<Pose>& poses, int i,
               const fs::path& folder) {
  const Pose& pose = poses[static_cast<size_t>(i)];
  const PinholeCamera camera = MakeCamera(spec.width_px, spec.height_px, spec.focal_35mm);
  const std::string name = NumberName(i);

  const PhotoOptions options =
      PhotoOptionsOf(spec, i, HashOf(spec.seed, static_cast<std::uint64_t>(i)));
  const Grid<float> light = RenderLight(scene, camera, pose, options);
  io::ExifFocal exif;
  exif.focal_mm = spec.focal_35mm;
  exif.focal_35mm = spec.focal_35mm;
  exif.make = "dtr";
  exif.model = "ray caster";
  io::WriteJpegWithExif(folder / "images" / (name + ".jpg"), Develop(light, options),
                        spec.jpeg_quality, exif);

  WriteViewTruth(spec, scene, poses, i, light, options, folder, name);
}

/// One panorama's files: itself, and the views of a cube around it, exact.
void WritePanorama(const DatasetSpec& spec, const Scene& scene, const Pose& pose, int i,
                   const fs::path& folder, io::CameraList& list) {
  const std::string name = NumberName(i);
  PhotoOptions options;
  options.supersampling = spec.supersampling;
  options.noise_sigma = spec.noise;
  options.gain = ExposureGain(spec.exposure_drift, i, spec.views);
  options.seed = HashOf(spec.seed, static_cast<std::uint64_t>(i));
  io::WritePanoramaJpeg(folder / "panoramas" / (name + ".jpg"),
                        Develop(RenderPanoramaLight(scene, spec.width_px, pose, options), options),
                        spec.jpeg_quality);
  const PinholeCamera camera = FaceCamera(FaceSizePx(spec.width_px));
  const auto faces = PanoramaFaces();
  for (size_t f = 0; f < faces.size(); ++f) {
    const Pose face_pose =
        Pose{Eigen::Quaterniond(faces[f].cam_from_panorama).normalized(), {0, 0, 0}} * pose;
    options.seed = HashOf(spec.seed, static_cast<std::uint64_t>(i), f);
    for (const char* part : {"images", "depth"}) {
      fs::create_directories(folder / part / faces[f].name);
    }
    io::WriteImage(folder / "images" / faces[f].name / (name + ".jpg"),
                   RenderPhoto(scene, camera, face_pose, options), spec.jpeg_quality);
    io::WriteExr(folder / "depth" / faces[f].name / (name + ".exr"),
                 RenderDepth(scene, camera, face_pose, spec.scale).grid());
    io::NamedCamera named;
    named.name = faces[f].name + "/" + name + ".jpg";
    named.depth_file = faces[f].name + "/" + name + ".exr";
    named.camera = camera;
    named.cam_from_world = WrittenPose(face_pose, spec.scale, spec.world_offset);
    list.cameras.push_back(std::move(named));
  }
}

}  // namespace

void CheckSpec(const DatasetSpec& spec) {
  CheckRange("views", spec.views, 2, kMaxViews);
  CheckRange("width", spec.width_px, kMinSidePx, kMaxSidePx);
  CheckRange("height", spec.height_px, kMinSidePx, kMaxSidePx);
  CheckRange("focal length (35 mm)", spec.focal_35mm, 8, 400);
  CheckRange("supersampling", spec.supersampling, 1, 16);
  CheckRange("noise", spec.noise, 0, 255);
  CheckRange("exposure drift", spec.exposure_drift, -kMaxDriftStops, kMaxDriftStops);
  CheckRange("scale", spec.scale, 1 / kMaxScale, kMaxScale);
  for (int k = 0; k < 3; ++k) {
    CheckRange("world offset", spec.world_offset[k], -kMaxOffset, kMaxOffset);
  }
  CheckRange("steps", spec.steps, 1, kMaxSteps);
  CheckRange("steps per second", spec.steps_per_second, 1, kMaxStepsPerSecond);
  const double limit_s = spec.scene == "sphere" ? kMaxRollS : kMaxSeconds;
  const double length_s = static_cast<double>(spec.steps - 1) / spec.steps_per_second;
  CheckRange("time", spec.time_s, -limit_s, limit_s);
  CheckRange("time of the last step", spec.time_s + length_s, -limit_s, limit_s);
  if (spec.panoramas && (spec.width_px % 2 != 0 || !LensOf(spec).IsIdeal())) {
    throw UsageError(
        "panoramas: expected an even width and no lens distortion; the views have none");
  }
  CheckRange("JPEG quality", spec.jpeg_quality, 1, 100);
  if (spec.steps == 1) return;
  if (spec.panoramas || !LensOf(spec).IsIdeal() || spec.exposure_drift != 0) {
    throw UsageError(
        "steps: expected pinhole cameras of one exposure for several time steps; leave out "
        "`panoramas`, `k1`, `k2`, `fisheye` and `exposure_drift`");
  }
}

PhotoOptions PhotoOptionsOf(const DatasetSpec& spec, int i, std::uint64_t noise_seed) {
  PhotoOptions options;
  options.supersampling = spec.supersampling;
  options.noise_sigma = spec.noise;
  options.gain = ExposureGain(spec.exposure_drift, i, spec.views);
  options.lens = LensOf(spec);
  options.seed = noise_seed;
  return options;
}

void WriteViewTruth(const DatasetSpec& spec, const Scene& scene, const std::vector<Pose>& poses,
                    int i, const Grid<float>& light, const PhotoOptions& options,
                    const fs::path& folder, const std::string& stem) {
  const Pose& pose = poses[static_cast<size_t>(i)];
  const PinholeCamera camera = MakeCamera(spec.width_px, spec.height_px, spec.focal_35mm);
  io::WriteExr(folder / "depth" / (stem + ".exr"),
               RenderDepth(scene, camera, pose, spec.scale).grid());

  std::vector<Pose> others = poses;
  others.erase(others.begin() + i);
  io::WriteMask(folder / "masks" / (stem + "_visible.png"),
                VisibilityMask(scene, camera, pose, others, kMinVisibleOthers));
  // Noise is no texture, and truth lies on the ideal grid: the mask is made without either.
  PhotoOptions ideal = options;
  ideal.noise_sigma = 0;
  ideal.lens = {};
  const ImageRgb8 clean =
      options.lens.IsIdeal() ? Develop(light, ideal) : RenderPhoto(scene, camera, pose, ideal);
  io::WriteMask(folder / "masks" / (stem + "_texture.png"), TextureMask(clean));
}

DatasetSpec DefaultSpecOf(const std::string& scene) {
  DatasetSpec spec;
  spec.scene = scene;
  if (scene != "toys") return spec;
  spec.views = 8;
  spec.width_px = 320;
  spec.height_px = 216;
  spec.steps = 30;
  return spec;
}

double ExposureGain(double drift_stops, int i, int views) {
  return std::exp2(drift_stops * (static_cast<double>(i) / (views - 1) - 0.5));
}

Pose WrittenPose(const Pose& cam_from_scene, double scale, const Eigen::Vector3d& world_offset) {
  // scale * (R p + t) = R (scale p + offset) + (scale t - R offset).
  return {cam_from_scene.rotation,
          scale * cam_from_scene.translation - cam_from_scene.rotation * world_offset};
}

void MakeDataset(const DatasetSpec& given, const fs::path& given_folder, Progress& progress) {
  const fs::path out_folder = WithoutTrailingSlash(given_folder);
  DatasetSpec spec = given;
  CheckSpec(spec);
  if (WorkFolder::IsTaken(out_folder, "dataset")) {
    throw UsageError(out_folder.string() +
                     ": expected a folder that does not exist yet; remove "
                     "it or choose another name");
  }
  if (spec.steps > 1) {
    MakeDynamicDataset(spec, out_folder, progress);
    return;
  }
  const Scene scene = MakeScene(spec.scene, spec.seed, spec.time_s);
  if (spec.layout.empty()) spec.layout = scene.framing().layouts.front();
  const std::vector<Pose> poses = MakeLayout(scene, spec.layout, spec.views);

  // A lens that folds over is rejected here, before any file is written.
  PhotoOptions probe;
  probe.lens = LensOf(spec);
  CheckPhotoOptions(MakeCamera(spec.width_px, spec.height_px, spec.focal_35mm), probe);

  WorkFolder work(WorkFolder::Of(out_folder), "dataset");
  const fs::path& partial = work.path();
  for (const char* part : {"images", "depth", spec.panoramas ? "panoramas" : "masks"}) {
    fs::create_directory(partial / part);
  }

  progress.Stage("rendering photos and truth", spec.views);
  io::CameraList list;
  list.unit = spec.scale == 1 ? LengthUnit::kMetre : LengthUnit::kArbitrary;
  for (int i = 0; i < spec.views; ++i) {
    progress.ThrowIfInterrupted();
    if (spec.panoramas) {
      WritePanorama(spec, scene, poses[static_cast<size_t>(i)], i, partial, list);
      progress.Update(i + 1);
      continue;
    }
    WriteView(spec, scene, poses, i, partial);
    io::NamedCamera camera;
    camera.name = NumberName(i) + ".jpg";
    camera.depth_file = NumberName(i) + ".exr";
    camera.camera = MakeCamera(spec.width_px, spec.height_px, spec.focal_35mm);
    camera.cam_from_world =
        WrittenPose(poses[static_cast<size_t>(i)], spec.scale, spec.world_offset);
    list.cameras.push_back(std::move(camera));
    progress.Update(i + 1);
  }
  io::WriteCamerasJson(partial / "cameras.json", list);
  WriteFileAtomically(partial / "dataset.json", FormatSpecJson(spec));
  WriteFileAtomically(partial / "SOURCE.md", SourceText(spec));
  work.Become(out_folder);
}

}  // namespace dtr::datasets
