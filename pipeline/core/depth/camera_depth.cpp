#include "pipeline/core/depth/camera_depth.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/size_text.h"
#include "dtr/io/formats/depth_grid.h"
#include "dtr/io/formats/foreign_confidence.h"
#include "dtr/io/formats/foreign_depth.h"
#include "dtr/types/computable.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

// Ray distances of pixels that a lens displaced: each has the ray of its own place.
DepthImage ToPlaneZOfDistorted(DepthImage depth, const io::NamedCamera& named,
                               const CameraDistortion& distortion) {
  if (depth.kind() == DepthKind::kPlaneZ) return depth;
  const double per_x = static_cast<double>(named.camera.width_px()) / depth.width();
  const double per_y = static_cast<double>(named.camera.height_px()) / depth.height();
  DepthImage z(depth.width(), depth.height());
  for (int y = 0; y < z.height(); ++y) {
    for (int x = 0; x < z.width(); ++x) {
      const auto ray = distortion.RayFromDistorted({per_x * (x + 0.5), per_y * (y + 0.5)});
      if (!ray || DepthImage::IsHole(depth(x, y))) continue;
      z(x, y) = static_cast<float>(depth(x, y) * (ray->z() / ray->norm()));
    }
  }
  return z;
}

// Sky that a program wrote as the largest number it knows, or a wrong unit.
void RequireComputable(const fs::path& file, const DepthImage& depth) {
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      const double z = depth(x, y);
      if (DepthImage::IsHole(depth(x, y)) || (z >= kMinLength && z <= kMaxLength)) continue;
      throw Error(fmt::format(
          "{}: its depth of {:.3g} units at pixel ({}, {}) cannot be computed with; give depths "
          "from {:g} to {:g} units, and 0 where there is none",
          file.string(), z, x, y, kMinLength, kMaxLength));
    }
  }
}

// What the numbers of a depth map take at their peak: as they come, as floats, and as plane z.
constexpr double kBytesPerDepthPixel = 24;

std::uint64_t LimitOf(const CameraDepthOptions& options) {
  constexpr double kAlways = 4 << 20;
  if (options.memory_gb <= 0) return io::kImageLimitPx;
  const double most = options.memory_gb * kBytesPerGigabyte / kBytesPerDepthPixel;
  return static_cast<std::uint64_t>(
      std::clamp(most, kAlways, static_cast<double>(io::kImageLimitPx)));
}

}  // namespace

std::vector<fs::path> DepthFilesOf(const io::NamedCamera& named,
                                   const CameraDepthOptions& options) {
  std::vector<fs::path> found;
  if (!named.depth_file.empty()) {
    if (const fs::path file = options.depth_dir / named.depth_file; fs::exists(file)) {
      found.push_back(file);
    }
    return found;
  }
  for (const char* extension : {".exr", ".pfm", ".png", ".tif", ".tiff", ".npy", ".EXR", ".PFM",
                                ".PNG", ".TIF", ".TIFF", ".NPY"}) {
    const fs::path file = options.depth_dir / fs::path(named.name).replace_extension(extension);
    // Where the disk does not tell a from A, both are one file.
    const bool known = std::any_of(found.begin(), found.end(), [&](const fs::path& other) {
      std::error_code ignored;
      return fs::equivalent(other, file, ignored);
    });
    if (fs::exists(file) && !known) found.push_back(file);
  }
  return found;
}

fs::path DepthFileOf(const io::NamedCamera& named, const CameraDepthOptions& options) {
  if (!named.depth_file.empty()) return options.depth_dir / named.depth_file;
  const std::vector<fs::path> found = DepthFilesOf(named, options);
  if (found.size() != 1) {
    throw Error(options.depth_dir.string() +
                ": expected one depth map (.exr, .pfm, .png, .tif, .npy) " +
                "named like the photo " + named.name + ", found " + std::to_string(found.size()) +
                "; give the folder whose maps are named like the photos");
  }
  return found.front();
}

DepthImage ReadCameraDepth(const io::NamedCamera& named, const CameraDepthOptions& options,
                           const CameraDistortion* distortion, std::string& resampled) {
  const fs::path file = DepthFileOf(named, options);
  if (!options.depth_unit && io::HoldsWholeNumbers(file)) {
    throw UsageError(file.string() +
                     ": expected `depth_unit` for a depth map of whole numbers, found none; "
                     "give it, as 0.001 for millimetres in a set in metres");
  }
  const PinholeCamera& camera = named.camera;
  const int width_px = camera.width_px(), height_px = camera.height_px();
  const DepthKind kind = options.depth_kind.value_or(named.depth_kind);
  DepthImage depth = io::ReadDepthOfAnySize(file, kind, options.depth_unit.value_or(1.0), width_px,
                                            height_px, LimitOf(options));
  RequireComputable(file, depth);
  if (const fs::path confidence = options.confidence.FileOf(file); !confidence.empty()) {
    io::LeaveOutLowConfidence(confidence, depth);
  }
  const auto scale = io::DepthScaleFor(depth.width(), depth.height(), width_px, height_px);
  if (!scale) {
    throw Error(file.string() + ": a depth map of " + SizeText(depth.width(), depth.height()) +
                " pixels has another shape than its photo of " + SizeText(width_px, height_px) +
                ": both must show the same; give maps that are neither cropped nor rotated");
  }
  const int width = width_px / *scale, height = height_px / *scale;
  const Eigen::Array2d map_per_photo(static_cast<double>(depth.width()) / width_px,
                                     static_cast<double>(depth.height()) / height_px);
  if (distortion != nullptr) {
    depth = ToPlaneZOfDistorted(std::move(depth), named, *distortion);
  } else {
    depth = ToPlaneZ(depth, camera.Resized(depth.width(), depth.height()));
    if (depth.width() == width && depth.height() == height) return depth;
  }
  if (depth.width() != width || depth.height() != height) {
    resampled = "depth maps of " + SizeText(depth.width(), depth.height()) + " for photos of " +
                SizeText(width_px, height_px) + ": resampled to " + SizeText(width, height) +
                (*scale == 1 ? "" : " (1/" + std::to_string(*scale) + " of the photo)") +
                ", never across depth edges";
  }
  return io::Resampled(depth, width, height,
                       [&](const Eigen::Vector2d& pixel) -> std::optional<Eigen::Vector2d> {
                         Eigen::Vector2d in_photo = *scale * pixel;
                         if (distortion != nullptr) {
                           const auto distorted = distortion->DistortedPixel(in_photo);
                           if (!distorted || !camera.Contains(*distorted)) return std::nullopt;
                           in_photo = *distorted;
                         }
                         return Eigen::Vector2d(in_photo.array() * map_per_photo);
                       });
}

}  // namespace dtr::pipeline
