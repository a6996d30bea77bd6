#include "capture/store.h"

#include <algorithm>
#include <atomic>
#include <system_error>

#include "capture/capture_json.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/parallel_for.h"

namespace dtr::capture {
namespace fs = std::filesystem;
namespace {

constexpr std::uintmax_t kLargestListBytes = 256u << 20;  // a thousand bytes a photo

void Require(const std::error_code& error, const fs::path& file) {
  if (error) throw Error(file.string() + ": cannot be written: " + error.message());
}

void RefuseOccupied(const fs::path& folder, bool replace) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(folder, error))) return;
  const bool is_folder = fs::is_directory(folder, error);
  if (is_folder && fs::is_empty(folder, error) && !error) return;
  if (is_folder && replace && fs::exists(folder / kCaptureFile, error)) return;
  throw UsageError(folder.string() + ": expected a new folder, found " +
                   (!is_folder ? "a file"
                    : replace  ? "a folder that is no capture"
                               : "something in it already") +
                   "; choose another name" + (replace ? "" : " or give --force"));
}

// An empty folder for the work. One that a stopped run left is ours to clear; any other is not.
void MakePartial(const fs::path& partial) {
  std::error_code error;
  if (fs::exists(fs::symlink_status(partial, error))) {
    const bool ours = fs::is_directory(partial, error) &&
                      (fs::is_empty(partial, error) || fs::is_directory(partial / "images", error));
    if (!ours) {
      throw UsageError(partial.string() + ": expected nothing or an unfinished capture, found " +
                       "something else; move it away");
    }
    fs::remove_all(partial, error);
    Require(error, partial);
  }
  fs::create_directories(partial / "images", error);
  Require(error, partial);
}

// Returns the photo as it lies in the capture, `file` relative to its folder.
Photo StorePhoto(const Photo& photo, const fs::path& folder) {
  Photo stored = photo;
  if (photo.exif_orientation == 1) {
    std::string extension = photo.file.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
    stored.file = fs::path("images") / (photo.id + extension);
    std::error_code error;
    fs::copy_file(photo.file, folder / stored.file, error);
    Require(error, folder / stored.file);
  } else {
    stored.file = fs::path("images") / (photo.id + ".png");
    stored.exif_orientation = 1;
    io::WriteImage(folder / stored.file, ReadPhoto(photo));
  }
  if (!photo.mask_file.empty()) {
    stored.mask_file = fs::path("masks") / (photo.id + ".png");
    io::WriteMask(folder / stored.mask_file, ReadPhotoMask(photo));
  }
  return stored;
}

// Puts the finished folder in its place; what was there goes only once the new one is there.
void MoveIntoPlace(const fs::path& partial, const fs::path& folder) {
  std::error_code error;
  const fs::path old = folder.string() + ".replaced";
  const bool replaces = fs::exists(folder, error);
  if (replaces) {
    fs::rename(folder, old, error);
    Require(error, old);
  }
  fs::rename(partial, folder, error);
  Require(error, folder);
  if (replaces) fs::remove_all(old, error);
  Require(error, old);
}

}  // namespace

void RequireRoom(const fs::path& folder, const StoreOptions& options) {
  RefuseOccupied(WithoutTrailingSlash(folder), options.replace);
}

void WriteCapture(const Capture& capture, const fs::path& target, const StoreOptions& options,
                  Progress& progress) {
  const fs::path folder = WithoutTrailingSlash(target);
  RefuseOccupied(folder, options.replace);
  const fs::path partial = folder.string() + ".partial";
  MakePartial(partial);
  const bool masked = std::any_of(capture.photos.begin(), capture.photos.end(),
                                  [](const Photo& photo) { return !photo.mask_file.empty(); });
  if (masked) fs::create_directory(partial / "masks");

  const int count = static_cast<int>(capture.photos.size());
  progress.Stage("writing photos", count);
  Capture stored;
  stored.skipped = capture.skipped;
  stored.photos.resize(capture.photos.size());
  std::atomic<int> done{0};
  ParallelFor(0, count, options.threads, [&](int i) {
    progress.ThrowIfInterrupted();
    const auto index = static_cast<size_t>(i);
    stored.photos[index] = StorePhoto(capture.photos[index], partial);
    progress.Update(++done);
  });
  WriteFileAtomically(partial / kCaptureFile, CaptureToJson(stored));
  MoveIntoPlace(partial, folder);
}

void WriteCapture(const Capture& capture, const fs::path& folder, int threads) {
  SilentProgress silent;
  WriteCapture(capture, folder, {.threads = threads}, silent);
}

Capture ReadCapture(const fs::path& folder) {
  const fs::path list = folder / kCaptureFile;
  Capture capture = CaptureFromJson(ReadFile(list, kLargestListBytes), list.string());
  for (Photo& photo : capture.photos) {
    photo.file = folder / photo.file;
    std::error_code error;
    if (!fs::is_regular_file(photo.file, error)) {
      throw Error(list.string() + ": photo \"" + photo.name + "\": expected the file " +
                  photo.file.string() + ", found none; ingest the photos again");
    }
    if (photo.mask_file.empty()) continue;
    photo.mask_file = folder / photo.mask_file;
    if (!fs::is_regular_file(photo.mask_file, error)) {
      throw Error(list.string() + ": photo \"" + photo.name + "\": expected the mask " +
                  photo.mask_file.string() + ", found none; ingest the photos again");
    }
  }
  return capture;
}

}  // namespace dtr::capture
