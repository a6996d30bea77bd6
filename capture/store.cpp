#include "capture/store.h"

#include <algorithm>
#include <atomic>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "capture/capture_json.h"
#include "dtr/base/delete.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/lower_case.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/work_folder.h"

namespace dtr::capture {
namespace fs = std::filesystem;
namespace {

constexpr char kKind[] = "capture";
constexpr std::uintmax_t kLargestListBytes = 256u << 20;  // a thousand bytes a photo

void Require(const std::error_code& error, const fs::path& file) {
  if (error) throw Error(file.string() + ": cannot be written: " + error.message());
}

void RejectOccupied(const fs::path& folder, bool replace) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(folder, error))) return;
  const bool is_folder = fs::is_directory(folder, error);
  if (is_folder && fs::is_empty(folder, error) && !error) return;
  if (is_folder && replace && fs::exists(folder / kCaptureFile, error)) {
    return RejectForeign(folder, [](const std::string& name) {
      static const std::set<std::string> kOurs{
          "images", "masks", kCaptureFile, kContactSheetFile, kPageFile, WorkFolder::MarkOf(kKind)};
      return kOurs.contains(name);
    });
  }
  throw UsageError(folder.string() + ": expected a new folder, found " +
                   (!is_folder ? "a file"
                    : replace  ? "a folder that is no capture"
                               : "something in it already") +
                   "; choose another name" + (replace ? "" : " or give `force`"));
}

// The file system's own errors, as ours: they name the file already.
void AsError(const std::function<void()>& function) {
  try {
    function();
  } catch (const fs::filesystem_error& error) {
    throw Error(std::string("capture cannot be written: ") + error.what());
  }
}

// Returns the photo as it lies in the capture, `file` relative to its folder.
Photo StorePhoto(const Photo& photo, const fs::path& folder) {
  Photo stored = photo;
  if (photo.exif_orientation == 1 && !photo.raw_balance) {
    stored.file = fs::path("images") / (photo.id + LowerExtension(photo.file));
    CopyFileAtomically(photo.file, folder / stored.file);
  } else {
    stored.file = fs::path("images") / (photo.id + ".png");
    stored.exif_orientation = 1;
    stored.raw_balance.reset();
    io::WriteImage(folder / stored.file, ReadPhoto(photo));
  }
  if (photo.HasMask()) {
    stored.mask_file = fs::path("masks") / (photo.id + ".png");
    io::WriteMask(folder / stored.mask_file, ReadPhotoMask(photo));
  }
  return stored;
}

}  // namespace

struct CaptureWriter::State {
  fs::path folder, partial, aside;
  StoreOptions options;
  std::optional<WorkFolder> work;

  void Recover() const;
  void RejectForeign() const;
  void MoveIntoPlace();
};

// A capture that was cut off on its way into place: the old one goes back, or what is left over of
// both goes.
void CaptureWriter::State::Recover() const {
  const std::string mark = WorkFolder::MarkOf(kKind);
  if (fs::exists(aside / mark)) {
    const FileLock nobody_at_work = WorkFolder::Lock(aside, kKind);
    if (fs::exists(folder / kCaptureFile)) {
      RemoveFolder(aside, mark);
    } else if (!fs::exists(folder) || IsEmptyFolder(folder)) {
      Rename(aside, folder);
    }  // what is no capture took its place: both stay
  }
  if (!fs::exists(folder / mark) || !fs::exists(folder / kCaptureFile)) return;
  const FileLock nobody_at_work = WorkFolder::Lock(folder, kKind);
  RemoveFile(folder / mark);
}

// Before any work: at its end the old capture would find no room.
void CaptureWriter::State::RejectForeign() const {
  WorkFolder::RejectForeign(partial, kKind);
  if (options.replace) WorkFolder::RejectForeign(aside, kKind);
}

// What was there goes only once the new capture is there.
void CaptureWriter::State::MoveIntoPlace() {
  SyncTree(partial);
  const std::string mark = WorkFolder::MarkOf(kKind);
  const bool replaces = fs::exists(folder) && !fs::is_empty(folder);
  std::optional<FileLock> old;
  if (replaces) old = WorkFolder::Lock(folder, kKind);  // Recover() knows it by its mark
  try {
    if (replaces) Rename(folder, aside);
    work->MoveTo(folder);
  } catch (const Error&) {
    if (replaces && !fs::exists(folder)) Rename(aside, folder);
    if (replaces) RemoveFile(folder / mark);
    throw;
  }
  if (replaces) RemoveFolder(aside, mark);
  work->Unmark();
}

CaptureWriter::CaptureWriter(const fs::path& folder, const StoreOptions& options)
    : state_(std::make_unique<State>()) {
  state_->folder = ResolveLinks(WithoutTrailingSlash(folder));
  state_->partial = WorkFolder::Of(state_->folder);
  state_->aside = state_->folder.string() + ".replaced";
  state_->options = options;
  AsError([&] {
    state_->Recover();
    state_->RejectForeign();
  });
  RejectOccupied(state_->folder, options.replace);
}

CaptureWriter::~CaptureWriter() = default;

fs::path CaptureWriter::Open() {
  if (!state_->work) state_->work.emplace(state_->partial, kKind);
  return state_->partial;
}

void CaptureWriter::Write(const Capture& capture, Progress& progress) {
  const fs::path partial = Open();
  RejectOccupied(state_->folder, state_->options.replace);
  const bool masked = std::any_of(capture.photos.begin(), capture.photos.end(),
                                  [](const Photo& photo) { return photo.HasMask(); });
  std::error_code error;
  fs::create_directory(partial / "images", error);
  if (!error && masked) fs::create_directory(partial / "masks", error);
  Require(error, partial);

  const int count = static_cast<int>(capture.photos.size());
  progress.Stage("writing photos", count);
  Capture stored;
  stored.skipped = capture.skipped;
  stored.remarks = capture.remarks;
  stored.photos.resize(capture.photos.size());
  std::atomic<int> done{0};
  MemoryBudget memory(state_->options.memory_gb);
  ParallelFor(0, count, [&](int i) {
    progress.ThrowIfInterrupted();
    const auto index = static_cast<size_t>(i);
    const auto share = memory.Take(MemoryOf(capture.photos[index]));
    stored.photos[index] = StorePhoto(capture.photos[index], partial);
    progress.Update(++done);
  });
  AsError([&] { RemoveTree(partial / kFramesFolder); });
  WriteFileAtomically(partial / kCaptureFile, CaptureToJson(stored));
  AsError([&] { state_->MoveIntoPlace(); });
}

void WriteCapture(const Capture& capture, const fs::path& folder, const StoreOptions& options,
                  Progress& progress) {
  CaptureWriter(folder, options).Write(capture, progress);
}

void WriteCapture(const Capture& capture, const fs::path& folder) {
  SilentProgress silent;
  WriteCapture(capture, folder, {}, silent);
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
