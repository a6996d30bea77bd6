// The reading half of set_io.h.
#include <algorithm>
#include <set>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/hash.h"
#include "dtr/base/lower_case.h"
#include "dtr/base/machine.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/size_text.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/held_out_files.h"
#include "dtr/io/mesh_io.h"
#include "dtr/io/set_io.h"
#include "dtr/io/set_json.h"
#include "dtr/io/sparse_io.h"
#include "dtr/io/video_frames.h"
#include "dtr/types/distinct_views.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kSetFileLimitBytes = std::uintmax_t{256} << 20;  // 100,000 views

DtrSet ReadSetFile(const fs::path& set_folder) {
  const fs::path file = set_folder / kSetFile;
  std::error_code error;
  if (!fs::is_directory(set_folder, error)) {
    throw Error(set_folder.string() + ": expected the folder of a D+TR set, found " +
                (fs::exists(set_folder, error) ? "a file" : "nothing"));
  }
  if (!fs::is_regular_file(file, error)) {
    throw Error(file.string() +
                ": expected the file that makes a folder a D+TR set, found nothing; " +
                "an unfinished set is resumed by the command that began it");
  }
  DtrSet set = SetFromJson(ReadFile(file, kSetFileLimitBytes), file.string());
  if (LacksHeldOutHashes(set)) {
    const fs::path list = set_folder / kHeldOutFiles;
    MergeHeldOutFiles(ReadFile(list, kSetFileLimitBytes), list.string(), set);
  }
  return set;
}

struct ViewPixels {
  double image = 0, depth = 0;
};

ViewPixels PixelsOf(const View& view, const LoadOptions& options) {
  const double pixels = static_cast<double>(view.camera.width_px()) * view.camera.height_px();
  ViewPixels found;
  if (options.images && view.image_file) found.image = pixels;
  if (options.depth && view.depth_file) found.depth = pixels / view.depth_scale / view.depth_scale;
  return found;
}

/// While it is read: 8-bit colours, their decoder's, and the mask, or the frames that a frame of a
/// video refers to; depth as codes, as floats, and the completed ones.
double PeakBytesOf(const View& view, const LoadOptions& options) {
  const ViewPixels pixels = PixelsOf(view, options);
  constexpr double kImage = 8, kFrame = 40, kDepth = 16;
  return (view.image_frame ? kFrame : kImage) * pixels.image + kDepth * pixels.depth;
}

/// Once it is read.
double HeldBytesOf(const View& view, const LoadOptions& options) {
  const ViewPixels pixels = PixelsOf(view, options);
  const double image = view.mask_file ? 4 : 3;
  const double depth = options.sigma && view.sigma_file ? 2 * sizeof(float) : sizeof(float);
  return image * pixels.image + depth * pixels.depth;
}

void RequireMemoryForAll(const fs::path& set_folder, const std::vector<View*>& views,
                         const LoadOptions& options) {
  double bytes = 0;
  for (const View* view : views) bytes += HeldBytesOf(*view, options);
  const double most = MachineMemoryBytes();
  if (bytes <= std::max(most, kAlwaysAllowedBytes)) return;
  throw Error(set_folder.string() + ": its " + std::to_string(views.size()) + " views take " +
              GigabytesText(bytes) + " GB of memory, more than the " + GigabytesText(most) +
              " GB that there are; use a machine with more, or a set of fewer or smaller views");
}

void ExpectViewSize(const fs::path& file, const View& view, int width_px, int height_px) {
  if (width_px == view.camera.width_px() && height_px == view.camera.height_px()) return;
  throw Error(file.string() + ": expected the view's " + std::to_string(view.camera.width_px()) +
              "x" + std::to_string(view.camera.height_px()) + " pixels, found " +
              std::to_string(width_px) + "x" + std::to_string(height_px));
}

/// The view's reduced mesh; none, and a warning, where it cannot be used.
std::optional<StoredMesh> UsableMesh(const fs::path& set_folder, const View& view,
                                     const LoadOptions& options) {
  const fs::path file = set_folder / view.mesh_file->path;
  std::string problem;
  try {
    if (Sha256OfFile(file) != view.mesh_file->sha256) {
      throw Error(file.string() + ": expected the content that set.json records, found another");
    }
    StoredMesh mesh = ReadMesh(file);
    const std::string mask = view.mask_file ? view.mask_file->sha256 : "";
    if (mesh.depth_sha256 == DepthHashOf(view) && mesh.mask_sha256 == mask) return mesh;
    problem = file.string() +
              ": expected a reduced mesh of this depth map and mask, found one of "
              "others";
  } catch (const Error& error) {
    problem = error.what();
  }
  options.warn("WARNING: " + view.name +
               ": its reduced mesh is left out and made again: " + problem);
  return std::nullopt;
}

// What equal stored pixels and cameras have in common.
bool AreDuplicates(const View& a, const View& b) {
  const auto same = [](const std::optional<StoredFile>& x, const std::optional<StoredFile>& y) {
    return x.has_value() == y.has_value() && (!x || x->sha256 == y->sha256);
  };
  const bool same_depth =
      same(a.depth_file, b.depth_file) &&
      (!a.depth_file ||
       (a.depth_coding == b.depth_coding && a.depth_steps == b.depth_steps &&
        a.depth_scale == b.depth_scale && a.near_z == b.near_z && a.far_z == b.far_z));
  const bool same_completed =
      same(a.completed_file, b.completed_file) && a.completed_steps == b.completed_steps &&
      a.completed_near_z == b.completed_near_z && a.completed_far_z == b.completed_far_z;
  return a.image_file && a.image_frame == b.image_frame && a.role == b.role &&
         a.camera == b.camera &&
         a.cam_from_world.rotation.coeffs() == b.cam_from_world.rotation.coeffs() &&
         a.cam_from_world.translation == b.cam_from_world.translation &&
         same(a.image_file, b.image_file) && same(a.mask_file, b.mask_file) && same_depth &&
         same(a.sigma_file, b.sigma_file) && same_completed;
}

std::optional<BaseFile> BaseIn(const fs::path& set_folder, const std::optional<StoredFile>& base) {
  if (!base) return {};
  return BaseFile{set_folder / base->path, base->sha256};
}

/// Puts the completed depths of the view into the holes of its measured ones.
void ReadCompleted(const fs::path& set_folder, View& view) {
  const fs::path file = set_folder / view.completed_file->path;
  const DepthImage completed =
      ReadDepth(file, CompletedFormatOf(view), view.depth.width(), view.depth.height(),
                BaseIn(set_folder, view.completed_base));
  for (size_t p = 0; p < completed.grid().data().size(); ++p) {
    if (DepthImage::IsHole(completed.grid().data()[p]) ||
        DepthImage::IsHole(view.depth.grid().data()[p])) {
      continue;
    }
    throw Error(file.string() + ": expected no depth where " + view.depth_file->path + " has some");
  }
  AddCompletedDepth(completed, view);
}

// "photos/IMG 1.JPG" -> "photos_IMG_1"
std::string IdFromName(const std::string& name) {
  constexpr size_t kLongestStem = 100;  // leaves room for a number and for file extensions
  const size_t slash = name.find_last_of("/\\");
  const size_t dot = name.find_last_of('.');
  const bool has_extension =
      dot != std::string::npos && dot > 0 && (slash == std::string::npos || dot > slash + 1);
  std::string id = has_extension ? name.substr(0, dot) : name;
  for (char& c : id) {
    const bool safe = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                      c == '_' || c == '-';
    if (!safe) c = '_';
  }
  if (id.size() > kLongestStem) id = id.substr(id.size() - kLongestStem);  // the end differs most
  return id.empty() ? "view" : id;
}

}  // namespace

DtrSet ReadSet(const fs::path& set_folder) {
  DtrSet set = ReadSetFile(set_folder);
  ExpectFiles(set_folder, set);
  return set;
}

void LoadPixels(const fs::path& set_folder, View& view, const LoadOptions& options) {
  RequireMemory(PeakBytesOf(view, options), options.memory_gb,
                (set_folder / kSetFile).string() + ": " + view.name + ": reading " +
                    SizeText(view.camera.width_px(), view.camera.height_px()) + " pixels",
                "give more");
  if (options.images && view.image_file) {
    const fs::path file = set_folder / view.image_file->path;
    if (view.image_frame) {
      view.image = ReadVideoFrame(file, *view.image_file, *view.image_frame, view.camera.width_px(),
                                  view.camera.height_px());
    } else {
      const ImageHeader header = ReadImageHeader(file, options.memory_gb);
      ExpectViewSize(file, view, header.width_px, header.height_px);
      view.image = ReadImage(file, {.memory_gb = options.memory_gb});
    }
  }
  if (options.images && view.mask_file) {
    const fs::path file = set_folder / view.mask_file->path;
    const ImageHeader header = ReadImageHeader(file, options.memory_gb);
    ExpectViewSize(file, view, header.width_px, header.height_px);
    view.mask = ReadMask(file, kImageLimitPx, options.memory_gb);
  }
  const int depth_width_px = view.camera.width_px() / view.depth_scale;
  const int depth_height_px = view.camera.height_px() / view.depth_scale;
  if (options.depth && view.depth_file) {
    // The unit was checked with set.json, and reading does not depend on it.
    const DepthFormat format = FormatOf(view, LengthUnit::kUnknown);
    view.depth = ReadDepth(set_folder / view.depth_file->path, format, depth_width_px,
                           depth_height_px, BaseIn(set_folder, view.depth_base));
  }
  const bool completes = options.depth && options.completed && view.completed_file;
  view.depth_state = {};
  if (completes) ReadCompleted(set_folder, view);
  view.mesh.reset();
  // A stored mesh is of all the depth that there is.
  if (options.depth && view.mesh_file && view.depth_file &&
      completes == view.completed_file.has_value()) {
    view.mesh = UsableMesh(set_folder, view, options);
  }
  if (options.sigma && view.sigma_file) {
    view.inverse_depth_sigma = ReadSigma(set_folder / view.sigma_file->path, depth_width_px,
                                         depth_height_px, BaseIn(set_folder, view.sigma_base));
  }
}

DtrSet LoadSet(const fs::path& set_folder, const LoadOptions& options) {
  DtrSet set = ReadSet(set_folder);
  if (options.collapse_duplicates) CollapseDuplicates(set);
  std::vector<View*> views;
  for (Frame& frame : set.frames) {
    if (!options.held_out) {
      std::erase_if(frame.views, [](const View& v) { return v.role == ViewRole::kHeldOut; });
    }
    for (View& view : frame.views) views.push_back(&view);
  }
  RequireMemoryForAll(set_folder, views, options);
  ParallelFor(0, static_cast<int>(views.size()),
              [&](int i) { LoadPixels(set_folder, *views[static_cast<size_t>(i)], options); });
  return set;
}

SparseScene LoadSparse(const fs::path& set_folder, const DtrSet& set) {
  if (!set.sparse_file) {
    throw Error((set_folder / kSetFile).string() +
                ": sparse: expected the points behind the calibration, found nothing; build the "
                "set from its photos with dtr build");
  }
  const fs::path file = set_folder / set.sparse_file->path;
  SparseScene scene = ReadSparse(file);
  const size_t views = set.frames.empty() ? 0 : set.frames[0].views.size();
  // Observations are sorted by view, so the last one has the largest index.
  if (!scene.observations.empty() && static_cast<size_t>(scene.observations.back().view) >= views) {
    throw Error(file.string() + ": expected views below " + std::to_string(views) + ", found " +
                std::to_string(scene.observations.back().view));
  }
  return scene;
}

std::vector<std::string> CollapseDuplicates(DtrSet& set) {
  std::vector<std::string> removed;
  for (Frame& frame : set.frames) {
    std::vector<const View*> views;
    for (const View& view : frame.views) views.push_back(&view);
    const auto image_of = [](const View& v) { return v.image_file ? v.image_file->sha256 : ""; };
    const std::vector<size_t> distinct = DistinctViews(views, image_of, AreDuplicates);
    if (distinct.size() == views.size()) continue;
    std::vector<View> kept;
    for (size_t i = 0; i < frame.views.size(); ++i) {
      if (kept.size() < distinct.size() && distinct[kept.size()] == i) {
        kept.push_back(std::move(frame.views[i]));
      } else {
        removed.push_back(frame.views[i].id);
      }
    }
    frame.views = std::move(kept);
  }
  return removed;
}

std::vector<std::string> VerifySet(const fs::path& set_folder) {
  DtrSet set;
  try {
    set = ReadSetFile(set_folder);
  } catch (const Error& error) {
    return {error.what()};
  }
  const std::vector<NamedFile> files = FilesOf(set);
  std::vector<std::string> found(files.size());
  ParallelFor(0, static_cast<int>(files.size()), [&](int i) {
    const NamedFile& named = files[static_cast<size_t>(i)];
    std::string& problem = found[static_cast<size_t>(i)];
    try {
      problem = ProblemOf(set_folder, named);
      if (!problem.empty()) return;
      const std::string hash = Sha256OfFile(set_folder / named.file->path);
      if (hash != named.file->sha256) {
        problem = named.field + ".sha256: expected " + named.file->sha256 + ", found " + hash +
                  " in '" + named.file->path + "'";
      }
    } catch (const std::exception& error) {
      problem = named.field + ": " + error.what();
    }
  });
  std::erase(found, "");
  for (std::string& problem : found) problem = (set_folder / kSetFile).string() + ": " + problem;
  return found;
}

void RewriteMetadata(const fs::path& set_folder, const DtrSet& set) {
  const fs::path file = set_folder / kSetFile;
  const std::string text = JsonFromSet(set, file.string());
  ReadSetFile(set_folder);  // only a finished set is rewritten
  ExpectFiles(set_folder, set);
  WriteFileAtomically(file, text);
}

std::vector<std::string> MakeViewIds(std::span<const std::string> names) {
  std::vector<std::string> ids;
  std::set<std::string> taken;  // lower case: some file systems do not tell A from a
  for (const std::string& name : names) {
    const std::string stem = IdFromName(name);
    std::string id = stem;
    for (int n = 2; !taken.insert(LowerCase(id)).second; ++n) id = stem + "_" + std::to_string(n);
    ids.push_back(id);
  }
  return ids;
}

}  // namespace dtr::io
