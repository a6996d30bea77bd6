#include "capture/sfm_images.h"

#include <algorithm>
#include <atomic>
#include <system_error>
#include <utility>

#include "dtr/base/delete.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/lower_case.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/image_io.h"
#include "dtr/types/area_average.h"

namespace dtr::capture {
namespace fs = std::filesystem;
namespace {

constexpr int kJpegQuality = 98;  // features move by less than their own noise

bool EndsInJpeg(const std::string& name) {
  const std::string extension = LowerExtension(name);
  return extension == ".jpg" || extension == ".jpeg";
}

void RequireDone(const std::error_code& error, const fs::path& file) {
  if (error) throw Error(file.string() + ": cannot be written: " + error.message());
}

void LinkOrCopy(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::create_hard_link(fs::canonical(from, error), to, error);
  if (!error) return;
  CopyFileAtomically(from, to);  // another disk, one without links, or a photo of somebody else
}

void Rewrite(const Photo& photo, const io::ImageHeader& header, std::pair<int, int> size,
             const fs::path& to) {
  ImageRgb8 image = ReadPhoto(photo);
  if (size != std::pair(image.width(), image.height())) {
    image = AreaAverage(image, size.first, size.second);
  }
  if (EndsInJpeg(photo.name)) {
    io::WriteJpegWithExif(to, image, kJpegQuality,
                          {header.focal_mm, header.focal_35mm, header.make, header.model});
    return;
  }
  io::WritePng(to, image);
}

void MakeFolderOf(const fs::path& file) {
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  RequireDone(error, file.parent_path());
}

void PrepareMask(const Photo& photo, const fs::path& to, int max_size_px) {
  MakeFolderOf(to);
  Mask mask = ReadPhotoMask(photo);
  const auto [width, height] = TargetSize(photo.width_px, photo.height_px, max_size_px);
  if (width != mask.width() || height != mask.height()) mask = ShrinkMask(mask, width, height);
  io::WriteMask(to, mask);
}

void PreparePhoto(const Photo& photo, const fs::path& to, int max_size_px) {
  const io::ImageHeader header = io::ReadImageHeader(photo.file, 0);
  const auto size = TargetSize(photo.width_px, photo.height_px, max_size_px);
  const bool readable_by_colmap = (header.format == "jpeg" || header.format == "png") &&
                                  header.bits == 8 && !header.converted &&
                                  (header.channels == 1 || header.channels == 3);
  const bool unchanged = readable_by_colmap && photo.exif_orientation == 1 &&
                         size == std::pair(photo.width_px, photo.height_px);
  MakeFolderOf(to);
  RemoveFile(to);
  if (unchanged) {
    LinkOrCopy(photo.file, to);
  } else {
    Rewrite(photo, header, size, to);
  }
}

}  // namespace

void PrepareSfmImages(const Capture& capture, const fs::path& folder, int max_size_px,
                      double memory_gb, Progress& progress) {
  const int count = static_cast<int>(capture.photos.size());
  progress.Stage("photos for calibration", count);
  std::atomic<int> done{0};
  MemoryBudget memory(memory_gb);
  ParallelFor(0, count, [&](int i) {
    progress.ThrowIfInterrupted();
    const Photo& photo = capture.photos[static_cast<size_t>(i)];
    const auto share = memory.Take(MemoryOf(photo));
    PreparePhoto(photo, folder / photo.name, max_size_px);
    if (photo.HasMask()) PrepareMask(photo, SfmMaskFile(folder, photo), max_size_px);
    progress.Update(++done);
  });
}

fs::path SfmMaskFile(const fs::path& folder, const Photo& photo) {
  if (!photo.HasMask()) return {};
  return fs::path(folder.string() + ".masks") / (photo.name + ".png");
}

void PrepareSfmImages(const Capture& capture, const fs::path& folder, int max_size_px) {
  SilentProgress silent;
  PrepareSfmImages(capture, folder, max_size_px, 0, silent);
}

}  // namespace dtr::capture
