#include "capture/ingest.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <system_error>

#include "capture/folder_walk.h"
#include "capture/layout.h"
#include "capture/names.h"
#include "capture/screening.h"
#include "capture/store.h"
#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "dtr/base/lower_case.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/work_folder.h"

namespace dtr::capture {
namespace fs = std::filesystem;
namespace {

const double kFilmDiagonalMm = std::hypot(36.0, 24.0);
constexpr double kShortestFocal = 0.1, kLongestFocal = 100;  // of the long side

std::string CameraGroup(const Photo& photo, const io::ImageHeader& header) {
  const auto known = [](const std::string& text) { return text.empty() ? "unknown" : text; };
  char focal[48] = "unknown";
  if (header.focal_mm) {
    std::snprintf(focal, sizeof focal, "%.2fmm", *header.focal_mm);
  } else if (header.focal_35mm) {
    std::snprintf(focal, sizeof focal, "%.2fmm35", *header.focal_35mm);
  }
  std::string group = known(photo.make) + "|" + known(photo.model) + "|" +
                      std::to_string(photo.width_px) + "x" + std::to_string(photo.height_px) + "|" +
                      focal;
  // A turned camera has its principal point elsewhere on the upright image.
  if (photo.exif_orientation != 1) group += kTurnedGroup + std::to_string(photo.exif_orientation);
  return group;
}

io::ImageHeader ReadHeader(const fs::path& file, MemoryBudget& memory) {
  const auto share = memory.Take(io::BytesToReadHeader(file));
  return io::ReadImageHeader(file, memory.gb());
}

Photo InspectPhoto(const fs::path& file, const std::string& name, const fs::path& mask, bool screen,
                   MemoryBudget& memory, std::vector<std::string>& remarks) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) throw Error("is no regular file");
  const io::ImageHeader header = ReadHeader(file, memory);
  remarks = header.remarks;
  Photo photo;
  photo.name = name;
  photo.file = file;
  photo.exif_orientation = header.exif_orientation;
  const bool sideways = header.exif_orientation >= 5;
  photo.width_px = sideways ? header.height_px : header.width_px;
  photo.height_px = sideways ? header.width_px : header.height_px;
  const FocalPrior focal = FocalFromExif(header);
  photo.focal_prior_px = focal.focal_px;
  photo.focal_source = focal.source;
  photo.make = Printable(header.make);
  photo.model = Printable(header.model);
  photo.lens_model = Printable(header.lens_model);
  photo.date_time = Printable(header.date_time);
  photo.gps = header.gps;
  photo.raw_balance = header.raw_balance;
  photo.panorama = header.panorama;
  photo.camera_group = CameraGroup(photo, header);
  photo.read_bytes = header.read_bytes;
  RequireMemoryFor(photo, memory.gb());
  photo.source_sha256 = Sha256OfFile(file);
  if (mask.empty() && !screen && !header.has_alpha) return photo;
  const auto share = memory.Take(MemoryOf(photo));
  if (!mask.empty()) {
    photo.mask_file = mask;
    photo.mask_sha256 = Sha256OfFile(mask);
  }
  const PhotoPixels pixels = ReadPhotoAndMask(photo);  // what cannot be used is known now
  photo.alpha = pixels.alpha;
  if (screen) photo.screening = MeasurePhoto(pixels.image, pixels.mask);
  return photo;
}

// The message with the photo's name for its path: whose folder it was is nobody's business later.
std::string ReasonFrom(std::string message, const fs::path& file, const std::string& name) {
  const std::string path = file.string();
  if (message.rfind(path + ": ", 0) == 0) message.erase(0, path.size() + 2);
  for (size_t at = 0; (at = message.find(path, at)) != std::string::npos; at += name.size()) {
    message.replace(at, path.size(), name);
  }
  return Printable(message);
}

// "left/IMG 1.jpg" -> "left_IMG_1"; equal ones are numbered in the order of the names.
void AssignIds(std::vector<Photo>& photos) {
  constexpr size_t kLongestId = 100;
  std::set<std::string> taken;  // in lower case
  const auto take = [&](const std::string& id) { return taken.insert(LowerCase(id)).second; };
  for (Photo& photo : photos) {
    std::string stem = fs::path(photo.name).replace_extension().string();
    for (char& c : stem) {
      const bool safe = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                        (c >= '0' && c <= '9') || c == '_' || c == '-';
      if (!safe) c = '_';
    }
    stem.resize(std::min(stem.size(), kLongestId));
    if (stem.empty() || stem.front() == '-') stem.insert(0, "_");
    photo.id = stem;
    for (int n = 2; !take(photo.id); ++n) photo.id = stem + "-" + std::to_string(n);
  }
}

// One white balance for all raw photos of a camera: that of each would colour a surface by what
// else is in the photo. The median of what the camera chose, per channel.
void BalanceRawPhotos(std::vector<Photo>& photos, Progress& progress) {
  std::map<std::string, std::vector<Photo*>> of_camera;
  for (Photo& photo : photos) {
    if (photo.raw_balance) of_camera[photo.make + " " + photo.model].push_back(&photo);
  }
  for (const auto& [camera, group] : of_camera) {
    io::RawBalance chosen{};
    double spread = 1;
    for (size_t c = 0; c < chosen.size(); ++c) {
      std::vector<double> factors;
      for (const Photo* photo : group) factors.push_back((*photo->raw_balance)[c]);
      const auto [low, high] = std::minmax_element(factors.begin(), factors.end());
      spread = std::max(spread, *high / *low);
      chosen[c] = UpperMedian(factors);
    }
    for (Photo* photo : group) photo->raw_balance = chosen;
    progress.Note(fmt::format(
        "{} raw photos of {}: developed without automatic brightness, with one white balance (red "
        "{:.3g}, blue {:.3g} of green; the camera's differ by {:.0f} %)",
        group.size(), camera, chosen[0], chosen[2], 100 * (spread - 1)));
  }
}

// A capture that was made with more memory, or whose list says what it likes.
void SkipTooLarge(Capture& capture, double memory_gb) {
  std::erase_if(capture.photos, [&](const Photo& photo) {
    try {
      RequireMemoryFor(photo, memory_gb);
      return false;
    } catch (const Error& e) {
      capture.skipped.push_back({photo.name, ReasonFrom(e.what(), photo.file, photo.name)});
      return true;
    }
  });
}

// The first thing that a command says of a folder.
void Announce(Capture& capture, Progress& progress) {
  std::set<std::string> groups, masks;
  for (const Photo& photo : capture.photos) {
    groups.insert(photo.camera_group);
    if (!photo.mask_file.empty()) masks.insert(photo.mask_file.string());
  }
  capture.contents.photos = static_cast<int>(capture.photos.size());
  capture.contents.cameras = static_cast<int>(groups.size());
  capture.contents.masks = static_cast<int>(masks.size());
  progress.Note(LineOf(capture.contents) +
                (capture.skipped.empty()
                     ? ""
                     : "; skipped: " + std::to_string(capture.skipped.size()) + ", named below"));
  const std::string alpha = AlphaLine(capture.photos);
  if (!alpha.empty()) progress.Note(alpha);
}

[[noreturn]] void ThrowNoPhotos(const fs::path& folder, const Capture& capture) {
  std::string message = folder.string() + ": expected photos, found none";
  if (!capture.skipped.empty()) {
    message += "; " + std::to_string(capture.skipped.size()) + " skipped (" +
               capture.skipped.front().name + ": " + capture.skipped.front().reason + ")";
  }
  if (!capture.contents.ignored.empty()) message += "; " + LineOf(capture.contents);
  throw Error(message + "; give the folder that holds the photos");
}

}  // namespace

bool IsOwnFolder(const fs::path& folder) {
  std::error_code ignored;
  const std::string name = folder.filename().string();
  if (name.ends_with(".dtr") || name.ends_with(".partial") || name.ends_with(".partial.work")) {
    return true;
  }
  for (const std::string& mark : {std::string("set.json"), std::string(kCaptureFile),
                                  std::string(kExportFile), WorkFolder::MarkOf(kCalibrationKind)}) {
    if (fs::exists(folder / mark, ignored)) return true;
  }
  return false;
}

FolderContents ContentsOf(const fs::path& folder, bool recurse) {
  FolderWalk walk = WalkFolder(folder, recurse);
  return SortImages(folder, walk.images, std::move(walk.contents)).contents;
}

FolderContents ContentsOfFiles(const fs::path& folder, bool recurse) {
  FolderWalk walk = WalkFolder(folder, recurse);
  walk.contents.photos = static_cast<int>(walk.images.size());
  return walk.contents;
}

FocalPrior FocalFromExif(const io::ImageHeader& header) {
  const double longest = std::max(header.width_px, header.height_px);
  const auto plausible = [&](double focal_px) {
    return focal_px >= kShortestFocal * longest && focal_px <= kLongestFocal * longest;
  };
  if (header.focal_35mm) {
    const double diagonal_px = std::hypot(header.width_px, header.height_px);
    const double focal_px = *header.focal_35mm * diagonal_px / kFilmDiagonalMm;
    if (plausible(focal_px)) return {focal_px, "exif-35mm"};
  }
  if (header.focal_mm && header.focal_plane_px_per_mm) {
    const double focal_px = *header.focal_mm * *header.focal_plane_px_per_mm;
    if (plausible(focal_px)) return {focal_px, "exif-focal-plane"};
  }
  return {};
}

Capture IngestPhotos(const fs::path& folder, const IngestOptions& options, Progress& progress) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    if (folder.extension() == ".r3d" && fs::exists(folder, error)) {
      const std::string file = folder.string(), stem = folder.stem().string();
      throw UsageError(fmt::format(
          "{}: expected a folder of photos, found a recording of Record3D; unpack it (unzip {} -d "
          "{}), give {}/rgbd, and the recording as `poses` and as `depth_prior`",
          file, file, stem, stem));
    }
    throw UsageError(folder.string() + ": expected a folder of photos, found " +
                     (fs::exists(folder, error) ? "something else" : "nothing"));
  }
  if (fs::exists(folder / kCaptureFile, error)) {
    Capture stored = ReadCapture(folder);
    SkipTooLarge(stored, options.memory_gb);
    Announce(stored, progress);
    return stored;
  }
  if (fs::exists(folder / "set.json", error)) {
    throw UsageError(folder.string() +
                     ": expected a folder of photos, found a D+TR set; give the photos it was made "
                     "of");
  }
  FolderWalk walk = WalkFolder(folder, options.recurse);
  Layout listing;
  if (options.sort) {
    listing = SortImages(folder, walk.images, std::move(walk.contents), options.memory_gb);
  } else {
    listing.photos = walk.images;
    listing.contents = std::move(walk.contents);
  }
  walk.skipped.insert(walk.skipped.end(), listing.skipped.begin(), listing.skipped.end());

  const int count = static_cast<int>(listing.photos.size());
  progress.Stage("photos", count);
  std::vector<std::optional<Photo>> photos(listing.photos.size());
  std::vector<std::string> reasons(listing.photos.size());
  std::vector<std::vector<std::string>> remarks(listing.photos.size());
  std::atomic<int> done{0};
  MemoryBudget memory(options.memory_gb);
  ParallelFor(0, count, [&](int i) {
    progress.ThrowIfInterrupted();
    const auto index = static_cast<size_t>(i);
    const std::string& name = listing.photos[index];
    try {
      const auto mask = listing.masks.find(name);
      photos[index] = InspectPhoto(folder / name, name,
                                   mask == listing.masks.end() ? fs::path() : folder / mask->second,
                                   options.screen, memory, remarks[index]);
    } catch (const Error& e) {
      reasons[index] = ReasonFrom(e.what(), folder / name, name);
    }
    progress.Update(++done);
  });

  Capture capture;
  capture.skipped = std::move(walk.skipped);
  capture.contents = std::move(listing.contents);
  for (size_t i = 0; i < photos.size(); ++i) {
    if (photos[i]) {
      for (const std::string& text : remarks[i]) capture.remarks.push_back({photos[i]->name, text});
      capture.photos.push_back(std::move(*photos[i]));
    } else {
      capture.skipped.push_back({listing.photos[i], reasons[i]});
    }
  }
  std::sort(capture.skipped.begin(), capture.skipped.end(),
            [](const Skipped& a, const Skipped& b) { return a.name < b.name; });
  if (capture.photos.empty()) ThrowNoPhotos(folder, capture);
  BalanceRawPhotos(capture.photos, progress);
  AssignIds(capture.photos);
  ScreenPhotos(capture.photos);
  Announce(capture, progress);
  return capture;
}

}  // namespace dtr::capture
