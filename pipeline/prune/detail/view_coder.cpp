#include "pipeline/prune/detail/view_coder.h"

#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/depth_io.h"
#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/scene.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

// docs/FORMAT.md, section 7: 120 bytes, 2 a root square of 16x16 samples and 2 a rectangle.
std::uint64_t BytesOf(const StoredMesh& mesh) {
  const auto roots = [](int samples) { return static_cast<std::uint64_t>((samples + 15) / 16); };
  return 120 +
         2 * (roots(mesh.cover.columns) * roots(mesh.cover.rows) + mesh.cover.rectangles.size());
}

std::uint64_t BytesOf(const std::optional<StoredFile>& file) { return file ? file->bytes : 0; }

bool IsCoarser(const View& view, double error) {
  const io::DepthFormat format = io::FormatOf(view, LengthUnit::kUnknown);
  return format.coding == DepthCoding::kZstdInverseDepth &&
         InverseDepthCode(view.near_z, view.far_z, format.steps).step() >= error;
}

void KeepMeasured(View& view) {
  view.depth = MeasuredDepth(view);
  view.depth_state = {};
}

/// True where image, mask and depth are as they were before they are coded.
bool KeepsPixels(const View& view, const prune::Coding& coding) {
  return coding.shrink == 1 && coding.TilesOf(view) == nullptr;
}

}  // namespace

ViewCoder::ViewCoder(const DtrSet& original, fs::path folder, fs::path trial_folder,
                     RenderOptions render)
    : original_(original),
      folder_(std::move(folder)),
      trial_folder_(std::move(trial_folder)),
      render_(render) {
  fs::create_directories(trial_folder_);
}

View ViewCoder::Recoded(const View& view, const prune::Coding& coding) const {
  const auto* tiles = coding.TilesOf(view);
  View recoded = tiles != nullptr ? prune::WithoutTiles(view, *tiles) : view;
  if (coding.shrink > 1) recoded = prune::ShrunkView(recoded, coding.shrink);
  if (!coding.sigma || !KeepsPixels(view, coding)) recoded.sigma_file.reset();
  recoded.inverse_depth_sigma.reset();
  if (coding.depth_error_px > 0) {
    const double error = coding.depth_error_px * ThresholdsOf(view, {}).pixel;
    // A view of too wide a range for that bound keeps its coding.
    if (!IsCoarser(view, error)) {
      const DepthImage completed = CompletedDepth(recoded);
      KeepMeasured(recoded);
      (void)io::TrySetDepthError(recoded, error);
      AddCompletedDepth(completed, recoded);
    }
  }
  return recoded;
}

StoredMesh ViewCoder::MeshOf(const View& stored, const prune::Coding& coding) const {
  View plain = stored;
  plain.mesh.reset();
  RenderOptions options = render_;
  options.mesh_tolerance_px = coding.mesh_tolerance_px;
  options.resolution = coding.mesh_resolution;
  return MakeStoredMesh(plain, options);
}

std::uint64_t ViewCoder::TryView(View& view, const View& before,
                                 const prune::Coding& coding) const {
  view = Recoded(before, coding);
  const bool same_pixels = KeepsPixels(before, coding);
  const auto stored_as = [&](const std::string& name, const auto& write, const auto& read) {
    const fs::path file = trial_folder_ / (view.id + name);
    write(file);
    read(file);
    const std::uint64_t bytes = fs::file_size(file);
    RemoveFile(file);
    return bytes;
  };
  std::uint64_t bytes = BytesOf(view.sigma_file);
  if (coding.jpeg_quality > 0 || !same_pixels) {
    bytes += stored_as(
        coding.jpeg_quality > 0 ? ".jpg" : ".png",
        [&](const fs::path& file) {
          io::WriteImage(file, view.image, std::max(1, coding.jpeg_quality));
        },
        [&](const fs::path& file) { view.image = io::ReadImage(file); });
  } else {
    bytes += BytesOf(before.image_file);
  }
  if (!same_pixels && !view.mask.empty()) {
    bytes += stored_as(
        "-mask.png", [&](const fs::path& file) { io::WriteMask(file, view.mask); },
        [](const fs::path&) {});
  } else {
    bytes += BytesOf(before.mask_file);
  }
  const bool same_depth = view.depth_coding == before.depth_coding &&
                          view.depth_steps == before.depth_steps && same_pixels;
  if (!same_depth) {
    const io::DepthFormat format = io::FormatOf(view, original_.unit);
    const auto recoded_as = [&](const std::string& name, const io::DepthFormat& coded,
                                DepthImage& depth) {
      bytes += stored_as(
          name + std::string(io::ExtensionOf(coded.coding)),
          [&](const fs::path& file) { io::WriteDepth(file, depth, coded); },
          [&](const fs::path& file) {
            depth = io::ReadDepth(file, coded, depth.width(), depth.height());
          });
    };
    DepthImage completed = CompletedDepth(view);
    KeepMeasured(view);
    recoded_as("-depth", format, view.depth);
    if (!completed.empty()) {
      recoded_as("-completed", io::CompletedFormatOf(view), completed);
      AddCompletedDepth(completed, view);
    }
  } else {
    bytes += BytesOf(before.depth_file) + BytesOf(before.completed_file);
  }
  const bool same_mesh = same_depth && before.mesh &&
                         coding.mesh_tolerance_px == render_.mesh_tolerance_px &&
                         coding.mesh_resolution == render_.resolution;
  if (!same_mesh) view.mesh = MeshOf(view, coding);
  return bytes + (same_mesh ? BytesOf(before.mesh_file) : BytesOf(*view.mesh));
}

prune::CodedSet ViewCoder::Try(const prune::Coding& coding) const {
  prune::CodedSet coded{original_, {}};
  std::vector<View>& views = coded.set.frames.front().views;
  coded.bytes.assign(views.size(), 0);
  ParallelFor(0, static_cast<int>(views.size()), [&](int i) {
    const auto k = static_cast<size_t>(i);
    if (views[k].role != ViewRole::kSource) return;
    coded.bytes[k] = TryView(views[k], original_.frames.front().views[k], coding);
  });
  return coded;
}

View ViewCoder::Write(const View& view, const prune::Coding& coding, io::SetWriter& writer) const {
  View recoded = Recoded(view, coding);
  View copied = view;  // entries of the files that stay as they are
  copied.mesh_file.reset();
  copied.sigma_file = recoded.sigma_file;
  const bool same_pixels = KeepsPixels(view, coding);
  const bool same_depth = recoded.depth_coding == view.depth_coding &&
                          recoded.depth_steps == view.depth_steps && same_pixels;
  if (coding.jpeg_quality > 0 || !same_pixels) copied.image_file.reset();
  if (!same_pixels) copied.mask_file.reset();
  if (!same_depth) copied.depth_file.reset(), copied.completed_file.reset();
  writer.CopyFiles(folder_, copied);
  if (!same_pixels) {
    View pixels = recoded;
    if (coding.jpeg_quality > 0) pixels.image = {};
    writer.WriteView(pixels, original_.unit);
    recoded.image_file = pixels.image_file;
    recoded.mask_file = pixels.mask_file;
    recoded.depth_file = pixels.depth_file;
    recoded.completed_file = pixels.completed_file;
  } else if (!same_depth) {
    writer.RecodeDepth(recoded, original_.unit);
  }
  if (coding.jpeg_quality > 0) writer.WriteJpeg(recoded, coding.jpeg_quality);
  const DepthImage completed = CompletedDepth(recoded);
  KeepMeasured(recoded);
  recoded.depth = io::RoundToCoding(recoded.depth, io::FormatOf(recoded, original_.unit));
  if (!completed.empty()) {
    AddCompletedDepth(io::RoundToCoding(completed, io::CompletedFormatOf(recoded)), recoded);
  }
  writer.WriteMesh(recoded, MeshOf(recoded, coding));
  recoded.image = {};
  recoded.mask = {};
  recoded.depth = {};
  recoded.depth_state = {};
  recoded.mesh.reset();
  return recoded;
}

}  // namespace dtr::pipeline
