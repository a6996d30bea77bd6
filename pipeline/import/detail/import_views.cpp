#include "pipeline/import/detail/import_views.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/size_text.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "dtr/render/geometry.h"
#include "pipeline/core/depth/camera_depth.h"
#include "pipeline/core/depth_settings.h"
#include "pipeline/core/reports/calibration_json.h"
#include "pipeline/core/run/finishing.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

bool HasDepth(const io::NamedCamera& named, const ImportOptions& options) {
  return !options.depth_dir.empty() && !options.held_out.contains(named.name);
}

// What is worth a line about one view.
struct ViewNote {
  bool as_stored = false, turned = false;  // of photos with an EXIF orientation
  std::string resampled;                   // what was done to its depth map
  io::AlphaCounts alpha;
  bool alpha_masks = false;
};

io::ImageAndMask ReadCameraImage(const io::NamedCamera& named, const fs::path& file,
                                 const ImportOptions& options, ViewNote& note) {
  const io::ImageHeader header = io::ReadImageHeader(file, options.memory_gb);
  const PinholeCamera& camera = named.camera;
  const StoredSize stored{header.width_px, header.height_px, header.exif_orientation};
  const auto grid = GridOfSize(camera.width_px(), camera.height_px(), stored, options.photo_grid);
  if (!grid) {
    throw Error(file.string() + ": expected " + SizeText(camera.width_px(), camera.height_px()) +
                " pixels as the camera says, found " + SizeText(header.width_px, header.height_px) +
                "; give the images the cameras were made for");
  }
  const bool upright = *grid == PhotoGrid::kUpright;
  note.as_stored = header.exif_orientation != 1 && !upright;
  note.turned = header.exif_orientation != 1 && upright;
  return io::ReadImageAndMask(file,
                              {.apply_exif_orientation = upright, .memory_gb = options.memory_gb});
}

// Others of a few megapixels are read, to name their size.
std::uint64_t LimitOf(const PinholeCamera& camera) {
  constexpr std::uint64_t kAlways = 4 << 20;
  return std::max(kAlways, static_cast<std::uint64_t>(camera.width_px()) *
                               static_cast<std::uint64_t>(camera.height_px()));
}

Mask ReadCameraMask(const io::NamedCamera& named, const ImportOptions& options) {
  const fs::path file = MaskFolder(options) / named.mask_file;
  const Mask mask = io::ReadMask(file, LimitOf(named.camera), options.memory_gb);
  if (mask.width() != named.camera.width_px() || mask.height() != named.camera.height_px()) {
    throw Error(file.string() + ": expected a mask of " +
                SizeText(named.camera.width_px(), named.camera.height_px()) + " pixels, found " +
                SizeText(mask.width(), mask.height()));
  }
  if (std::none_of(mask.data().begin(), mask.data().end(), [](auto value) { return value != 0; })) {
    throw Error(
        file.string() +
        ": expected a mask that leaves something of its photo, found it dark throughout; what "
        "is to be used is 255, not 1");
  }
  return mask;
}

bool LeavesNothing(const Mask& mask) {
  return std::none_of(mask.data().begin(), mask.data().end(),
                      [](auto value) { return value != 0; });
}

// What the alpha of the image (empty: all of it) and the camera's mask file both allow.
Mask UsablePart(const io::NamedCamera& named, const ImportOptions& options, Mask alpha) {
  const std::string file = (options.images_dir / named.name).string();
  if (!alpha.empty() && LeavesNothing(alpha)) {
    throw Error(file +
                ": no pixel has an alpha of at least one half; remove the alpha channel if it "
                "means nothing");
  }
  if (named.mask_file.empty()) return alpha;
  Mask mask = ReadCameraMask(named, options);
  for (size_t i = 0; i < alpha.data().size(); ++i) mask.data()[i] &= alpha.data()[i];
  if (LeavesNothing(mask)) {
    throw Error(file +
                ": its alpha channel and its mask have no usable pixel in common; remove one "
                "of them");
  }
  return mask;
}

// What may not be used has no depth: with alpha the depth there is as arbitrary as the colour.
void RemoveMaskedDepth(View& view) {
  if (view.mask.empty()) return;
  for (int y = 0; y < view.depth.height(); ++y) {
    for (int x = 0; x < view.depth.width(); ++x) {
      bool usable = false;
      for (int j = 0; j < view.depth_scale && !usable; ++j) {
        const std::uint8_t* row = &view.mask(view.depth_scale * x, view.depth_scale * y + j);
        usable = std::any_of(row, row + view.depth_scale, [](auto value) { return value != 0; });
      }
      if (!usable) view.depth(x, y) = 0;
    }
  }
}

void RequireHeldOutNames(const io::CameraList& list, const ImportOptions& options) {
  for (const std::string& name : options.held_out) {
    const bool known =
        std::any_of(list.cameras.begin(), list.cameras.end(),
                    [&](const io::NamedCamera& named) { return named.name == name; });
    if (!known) throw UsageError("held-out photo \"" + name + "\": no camera of the list has it");
  }
}

// Before any file is hashed: the list says all sizes.
void RequireMemoryForViews(const io::CameraList& list, double memory_gb) {
  for (const io::NamedCamera& named : list.cameras) {
    const double pixels = static_cast<double>(named.camera.width_px()) * named.camera.height_px();
    RequireMemory(kBytesPerPhotoPixel * pixels, memory_gb,
                  named.name + ": a view of " +
                      SizeText(named.camera.width_px(), named.camera.height_px()) + " pixels",
                  "give more, or shrink the photos and their cameras");
  }
}

std::vector<std::string> IdsOf(const io::CameraList& list) {
  std::vector<std::string> names;
  for (const io::NamedCamera& named : list.cameras) names.push_back(named.name);
  return io::MakeViewIds(names);
}

// What FinishGeometry looks at, without the pixels: the samples it takes of the depth (SPEC 0.2),
// with the camera of that coarse grid.
View CoarseCopy(const View& view) {
  constexpr int kSamplesPerAxis = 64;
  View coarse;
  coarse.id = view.id;
  coarse.name = view.name;
  coarse.role = view.role;
  coarse.cam_from_world = view.cam_from_world;
  if (view.depth.empty()) return coarse;
  const int step_x = (view.depth.width() + kSamplesPerAxis - 1) / kSamplesPerAxis;
  const int step_y = (view.depth.height() + kSamplesPerAxis - 1) / kSamplesPerAxis;
  const int first_x = step_x / 2, first_y = step_y / 2;
  const int width = (view.depth.width() - first_x + step_x - 1) / step_x;
  const int height = (view.depth.height() - first_y + step_y - 1) / step_y;
  // Sample (i, j) is pixel (step i + first, step j + first): its centre maps to (i + .5, j + .5).
  const PinholeCamera camera = view.DepthCamera();
  coarse.camera = PinholeCamera(width, height, camera.fx_px() / step_x, camera.fy_px() / step_y,
                                (camera.cx_px() - first_x - 0.5) / step_x + 0.5,
                                (camera.cy_px() - first_y - 0.5) / step_y + 0.5);
  coarse.depth = DepthImage(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      coarse.depth(x, y) = view.depth(step_x * x + first_x, step_y * y + first_y);
    }
  }
  return coarse;
}

// Everything that decides the result; also the provenance of the set.
nlohmann::json Inputs(const io::CameraList& list, const ImportOptions& options,
                      Progress& progress) {
  const int count = static_cast<int>(list.cameras.size());
  std::vector<nlohmann::json> photos(list.cameras.size());
  progress.Stage("hash", count);
  std::atomic<int> done{0};
  ParallelFor(0, count, [&](int i) {
    progress.ThrowIfInterrupted();
    const io::NamedCamera& named = list.cameras[static_cast<size_t>(i)];
    nlohmann::json& photo = photos[static_cast<size_t>(i)];
    photo["name"] = named.name;
    photo["width_px"] = named.camera.width_px();
    photo["height_px"] = named.camera.height_px();
    photo["sha256"] = Sha256OfFile(options.images_dir / named.name);
    if (!named.mask_file.empty()) {
      photo["mask_sha256"] = Sha256OfFile(MaskFolder(options) / named.mask_file);
    }
    if (HasDepth(named, options)) {
      photo["depth_sha256"] = Sha256OfFile(DepthFileOf(named, options));
      const DepthKind kind = options.depth_kind.value_or(named.depth_kind);
      photo["depth_kind"] = kind == DepthKind::kPlaneZ ? "z" : "ray";
    }
    progress.Update(++done);
  });
  nlohmann::json inputs;
  inputs["made_by"] = "import";
  inputs["photos"] = photos;
  inputs["depth_unit"] = options.depth_unit.value_or(1.0);
  const CalibrationReport& calibration = options.calibration;
  if (calibration.given_cameras || calibration.bundle_adjustment) {
    inputs["calibration"] = JsonOf(calibration);
  }
  return inputs;
}

std::string HashOf(const SparseScene& scene) {
  std::vector<double> numbers;
  for (const SparsePoint& point : scene.points) {
    numbers.insert(numbers.end(), point.p_in_world.data(), point.p_in_world.data() + 3);
  }
  for (const SparseObservation& seen : scene.observations) {
    numbers.insert(numbers.end(), {double(seen.view), double(seen.point)});
    numbers.insert(numbers.end(), seen.pixel.data(), seen.pixel.data() + 2);
  }
  return Sha256(std::as_bytes(std::span<const double>(numbers)));
}

// The scene in a world whose origin lies `move` further on.
SparseScene Shifted(SparseScene scene, const Eigen::Vector3d& move) {
  for (SparsePoint& point : scene.points) point.p_in_world -= move;
  return scene;
}

// Points that source views alone would know: held-out photos must not move the scene's centre.
std::vector<SparsePoint> PointsOfSources(const SparseScene& scene, const std::vector<View>& views) {
  std::vector<bool> is_source;
  for (const View& view : views) is_source.push_back(view.role == ViewRole::kSource);
  return RestrictToViews(scene, is_source).points;
}

std::string Fingerprint(const nlohmann::json& inputs, const io::CameraList& list,
                        const ImportOptions& options, const SparseScene* points) {
  nlohmann::json fingerprint = inputs;
  io::CameraList pinholes = list;
  for (io::NamedCamera& named : pinholes.cameras) {
    if (named.distortion) {
      fingerprint["distortion"][named.name] = {named.distortion->model, named.distortion->params};
    }
    named.distortion.reset();
  }
  fingerprint["cameras"] = io::FormatCamerasJson(pinholes);
  fingerprint["depth_coding"] = io::NameOf(options.depth_coding);
  fingerprint["completion"] = options.completion;
  fingerprint["held_out"] = options.held_out;
  if (points != nullptr) fingerprint["points_sha256"] = HashOf(*points);
  return fingerprint.dump();
}

// What fills the place of hidden colours was never seen. Not before undistortion, whose filter
// would draw it over the border.
void BlackenMasked(View& view) {
  for (size_t i = 0; i < view.mask.data().size(); ++i) {
    if (view.mask.data()[i] == 0) std::fill_n(&view.image.data()[3 * i], 3, std::uint8_t{0});
  }
}

View ViewOf(const io::NamedCamera& named, const std::string& id, const ImportOptions& options,
            ViewNote& note) {
  View view;
  view.id = id;
  view.name = named.name;
  view.role = options.held_out.contains(named.name) ? ViewRole::kHeldOut : ViewRole::kSource;
  view.camera = named.camera;
  view.cam_from_world = named.cam_from_world;
  view.depth_coding = options.depth_coding;
  io::ImageAndMask read = ReadCameraImage(named, options.images_dir / named.name, options, note);
  view.image = std::move(read.image);
  view.mask = UsablePart(named, options, std::move(read.mask));
  note.alpha = read.alpha;
  note.alpha_masks = read.alpha.any() && !view.mask.empty();
  std::unique_ptr<CameraDistortion> distortion;
  if (named.distortion) {
    if (!options.distortion_of) {
      throw std::invalid_argument("import: a camera with distortion, and nothing that knows it");
    }
    distortion = options.distortion_of(named);
    distortion->Undistort(view.image, view.mask);
  }
  if (note.alpha_masks) BlackenMasked(view);
  if (HasDepth(named, options)) {
    view.depth = ReadCameraDepth(named, options, distortion.get(), note.resampled);
    view.depth_scale = view.camera.width_px() / view.depth.width();
    RemoveMaskedDepth(view);
  }
  return view;
}

// One line for each thing that was done to some of the views.
void TellOf(const io::CameraList& list, const std::vector<ViewNote>& notes, Progress& progress) {
  std::set<std::string> resampled;
  size_t as_stored = 0, turned = 0, distorted = 0;
  std::string first;
  for (size_t i = 0; i < notes.size(); ++i) {
    if (!notes[i].resampled.empty()) resampled.insert(notes[i].resampled);
    as_stored += notes[i].as_stored;
    turned += notes[i].turned;
    distorted += list.cameras[i].distortion.has_value();
    if (first.empty() && (notes[i].as_stored || notes[i].turned)) first = list.cameras[i].name;
  }
  if (as_stored > 0) {
    progress.Note(std::to_string(as_stored) + " photos with an EXIF orientation, first " + first +
                  ": taken as they are stored, as their cameras describe them");
  }
  if (turned > 0) {
    progress.Note(std::to_string(turned) + " photos, first " + first +
                  ": rotated by their EXIF orientation, as their cameras describe them");
  }
  if (distorted > 0) {
    progress.Note(std::to_string(distorted) +
                  " photos undistorted; depth maps that come with them are taken to have the "
                  "photo's distortion");
  }
  for (const std::string& line : resampled) progress.Note(line);
}

// Writes all views, each in turn without its pixels into `set` and coarsely into `coarse`.
void WriteViews(const io::CameraList& list, const ImportOptions& options, io::SetWriter& writer,
                DtrSet& set, DtrSet& coarse, io::AlphaTotals& alpha, Progress& progress) {
  const std::vector<std::string> ids = IdsOf(list);
  const int count = static_cast<int>(list.cameras.size());
  set.frames.resize(1);
  set.frames[0].views.resize(list.cameras.size());
  coarse.frames = set.frames;
  progress.Stage("import", count);
  MemoryBudget memory(options.memory_gb);
  std::atomic<int> done{0};
  std::vector<ViewNote> notes(list.cameras.size());
  ParallelFor(0, count, [&](int i) {
    progress.ThrowIfInterrupted();
    const auto at = static_cast<size_t>(i);
    const PinholeCamera& camera = list.cameras[at].camera;
    const auto share = memory.TakeForPhoto(camera.width_px(), camera.height_px());
    View view = ViewOf(list.cameras[at], ids[at], options, notes[at]);
    writer.WriteView(view, list.unit);
    coarse.frames[0].views[at] = CoarseCopy(view);
    view.image = {};
    view.mask = {};
    view.depth = {};
    set.frames[0].views[at] = std::move(view);
    progress.Update(++done);
  });
  TellOf(list, notes, progress);
  for (const ViewNote& note : notes) alpha.Add(note.alpha, note.alpha_masks);
  if (!alpha.Line().empty()) progress.Note(alpha.Line());
}

io::AlphaTotals WriteSet(const io::CameraList& list, const ImportOptions& options,
                         const std::string& provenance, const SparseScene* points,
                         io::SetWriter& writer, Progress& progress) {
  const io::CameraList near = io::RecentreWorld(list);
  DtrSet set, coarse;
  set.unit = near.unit;
  set.world_origin = near.world_origin;
  set.provenance_json = provenance;
  io::AlphaTotals alpha;
  WriteViews(near, options, writer, set, coarse, alpha, progress);
  std::vector<View>& views = set.frames[0].views;
  std::vector<SparsePoint> source_points;
  SparseScene scene;
  if (points != nullptr) {
    scene = Shifted(*points, near.world_origin - list.world_origin);
    source_points = PointsOfSources(scene, views);
    writer.WriteSparse(set, scene);
  }
  FinishGeometry(coarse, source_points);
  set.scene_center = coarse.scene_center;
  set.bounds = coarse.bounds;
  for (size_t i = 0; i < views.size(); ++i) {
    views[i].reference_baseline = coarse.frames[0].views[i].reference_baseline;
  }
  if (options.completion && !options.depth_dir.empty()) {
    const double memory_gb = options.memory_gb > 0 ? options.memory_gb : kDefaultMemoryGb;
    CompleteDepth(set, scene, writer, memory_gb, progress);
  }
  writer.Finish(set);
  return alpha;
}

}  // namespace

fs::path MaskFolder(const ImportOptions& options) {
  if (!options.mask_dir.empty()) return options.mask_dir;
  const fs::path images = fs::absolute(options.images_dir).lexically_normal();
  // "photos/" has an empty file name; its parent is "photos".
  return (images.has_filename() ? images.parent_path() : images.parent_path().parent_path()) /
         "masks";
}

View ImportView(const io::NamedCamera& named, const std::string& id, const ImportOptions& options) {
  ViewNote note;
  return ViewOf(named, id, options, note);
}

std::vector<View> ImportViews(const io::CameraList& list, const ImportOptions& options) {
  RequireHeldOutNames(list, options);
  const std::vector<std::string> ids = IdsOf(list);
  std::vector<View> views(list.cameras.size());
  ParallelFor(0, static_cast<int>(views.size()), [&](int i) {
    const auto at = static_cast<size_t>(i);
    views[at] = ImportView(list.cameras[at], ids[at], options);
  });
  return views;
}

io::AlphaTotals ImportSet(const io::CameraList& list, const ImportOptions& options,
                          const fs::path& target, bool force, const SparseScene* points,
                          Progress& progress) {
  RequireHeldOutNames(list, options);
  RequireMemoryForViews(list, options.memory_gb);
  if (options.depth_dir.empty() && (points == nullptr || points->points.empty())) {
    throw UsageError(
        "import: expected depth maps (`depth`) or a model with points, found neither; without them "
        "the position of the scene is unknown");
  }
  io::SetWriter::RequireTarget(target, force);  // before any file is hashed
  const nlohmann::json inputs = Inputs(list, options, progress);
  const std::string fingerprint = Fingerprint(inputs, list, options, points);
  io::SetWriter writer(target, fingerprint, force);
  try {
    return WriteSet(list, options, inputs.dump(), points, writer, progress);
  } catch (const Error&) {
    // An import starts again anyway, and what it left would stand in the way of mended inputs.
    writer.Discard();
    throw;
  }
}

}  // namespace dtr::pipeline
