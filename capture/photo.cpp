#include "capture/photo.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>

#include "capture/screening.h"
#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"

namespace dtr::capture {
namespace {

// A mask turned as the photo's pixels are: upright masks fit upright photos.
Mask OnGridOf(const Photo& photo, Mask mask) {
  if (photo.exif_orientation == 1) return mask;
  const StoredSize stored = StoredSizeOf(photo);
  const auto given = GridOfSize(mask.width(), mask.height(), stored, PhotoGrid::kUpright);
  const PhotoGrid wanted = photo.as_stored ? PhotoGrid::kStored : PhotoGrid::kUpright;
  if (!given || *given == wanted) return mask;
  return io::ApplyExifOrientation(mask, wanted == PhotoGrid::kUpright
                                            ? photo.exif_orientation
                                            : io::InverseExifOrientation(photo.exif_orientation));
}

constexpr std::array<std::pair<Fault, const char*>, 4> kFaults{
    {{Fault::kBlurred, "blurred"},
     {Fault::kOverexposed, "overexposed"},
     {Fault::kUnderexposed, "underexposed"},
     {Fault::kDuplicate, "duplicate"}}};

}  // namespace

std::string NameOf(Fault fault) {
  return std::find_if(kFaults.begin(), kFaults.end(),
                      [&](const auto& f) { return f.first == fault; })
      ->second;
}

std::optional<Fault> FaultCalled(const std::string& name) {
  for (const auto& [fault, called] : kFaults) {
    if (name == called) return fault;
  }
  return {};
}

namespace {

// Per photo whether it is the one that stays of those that show its image: the one that the others
// are duplicates of, or, where that has one of `faults` itself, the best of the rest.
std::vector<bool> StayOfTheirImage(const std::vector<Photo>& photos,
                                   const std::vector<bool>& has_other_fault) {
  std::map<std::string, std::string> duplicate_of;
  for (const Photo& photo : photos) {
    if (photo.screening && !photo.screening->duplicate_of.empty()) {
      duplicate_of.emplace(photo.name, photo.screening->duplicate_of);
    }
  }
  std::map<std::string, std::vector<size_t>> left_of;  // by the original's name
  for (size_t i = 0; i < photos.size(); ++i) {
    if (!photos[i].screening || has_other_fault[i]) continue;
    std::string name = photos[i].name;
    for (auto at = duplicate_of.find(name); at != duplicate_of.end();
         at = duplicate_of.find(name)) {
      name = at->second;
    }
    left_of[name].push_back(i);
  }
  std::vector<bool> stay(photos.size());
  for (const auto& [original, left] : left_of) {
    const auto at = std::find_if(left.begin(), left.end(),
                                 [&](size_t i) { return photos[i].name == original; });
    stay[at != left.end() ? *at : BestCopy(photos, left)] = true;
  }
  return stay;
}

}  // namespace

void DropFaulty(Capture& capture, const std::vector<Fault>& faults) {
  const auto drops = [&](Fault fault) {
    return std::find(faults.begin(), faults.end(), fault) != faults.end();
  };
  std::vector<bool> has_other_fault;
  for (const Photo& photo : capture.photos) {
    has_other_fault.push_back(
        photo.screening &&
        std::any_of(photo.screening->faults.begin(), photo.screening->faults.end(),
                    [&](Fault fault) { return fault != Fault::kDuplicate && drops(fault); }));
  }
  const std::vector<bool> stays = StayOfTheirImage(capture.photos, has_other_fault);
  std::vector<Photo> kept;
  for (size_t p = 0; p < capture.photos.size(); ++p) {
    Photo& photo = capture.photos[p];
    std::string reason;
    for (size_t i = 0; photo.screening && i < photo.screening->faults.size(); ++i) {
      const Fault fault = photo.screening->faults[i];
      if (!drops(fault) || (fault == Fault::kDuplicate && stays[p])) continue;
      reason += (reason.empty() ? "dropped: " : "; ") + photo.screening->remarks[i];
    }
    if (reason.empty()) {
      kept.push_back(std::move(photo));
    } else {
      capture.skipped.push_back({photo.name, reason});
    }
  }
  capture.photos = std::move(kept);
  std::sort(capture.skipped.begin(), capture.skipped.end(),
            [](const Skipped& a, const Skipped& b) { return a.name < b.name; });
}

double MemoryOf(const Photo& photo) {
  return std::max(photo.read_bytes, kBytesPerPhotoPixel * photo.width_px * photo.height_px);
}

void RequireMemoryFor(const Photo& photo, double memory_gb) {
  RequireMemory(MemoryOf(photo), memory_gb,
                fmt::format("{}: reading its {}x{} pixels", photo.file.string(), photo.width_px,
                            photo.height_px),
                "give more, or shrink the photo");
}

StoredSize StoredSizeOf(const Photo& photo) {
  const bool swapped = !photo.as_stored && photo.exif_orientation >= 5;
  return {swapped ? photo.height_px : photo.width_px, swapped ? photo.width_px : photo.height_px,
          photo.exif_orientation};
}

void TakeAsStored(Photo& photo) {
  const StoredSize stored = StoredSizeOf(photo);
  photo.width_px = stored.width_px;
  photo.height_px = stored.height_px;
  photo.as_stored = true;
}

bool IsTurned(const Photo& photo) {
  if (photo.as_stored) return false;
  return photo.exif_orientation != 1 || photo.camera_group.find(kTurnedGroup) != std::string::npos;
}

void RequireEnoughPhotos(const Capture& capture, const std::filesystem::path& where) {
  if (capture.photos.size() >= 2) return;
  std::string message = where.string() + ": expected at least 2 photos, found " +
                        std::to_string(capture.photos.size());
  if (!capture.skipped.empty()) {
    message += " and " + std::to_string(capture.skipped.size()) + " skipped (" +
               capture.skipped.front().name + ": " + capture.skipped.front().reason + ")";
  }
  throw Error(message + "; a scene needs several views");
}

namespace {

// Files that took the place of what was ingested must not be much larger: whoever reads has looked
// for room by the sizes of then. Others are read, to name their size.
std::uint64_t LimitOf(const Photo& photo) {
  constexpr std::uint64_t kAlways = 4 << 20;
  return std::max(kAlways, static_cast<std::uint64_t>(photo.width_px) *
                               static_cast<std::uint64_t>(photo.height_px));
}

io::ImageAndMask ReadOnGrid(const Photo& photo) {
  io::ImageAndMask read =
      io::ReadImageAndMask(photo.file, {.apply_exif_orientation = !photo.as_stored,
                                        .raw_balance = photo.raw_balance,
                                        .limit_px = std::min(LimitOf(photo), io::kImageLimitPx),
                                        .memory_gb = 0});
  const ImageRgb8& image = read.image;
  if (image.width() != photo.width_px || image.height() != photo.height_px) {
    throw Error(photo.file.string() + ": expected a photo of " + std::to_string(photo.width_px) +
                "x" + std::to_string(photo.height_px) + " pixels as when it was ingested, found " +
                std::to_string(image.width()) + "x" + std::to_string(image.height()) +
                "; ingest the photos again");
  }
  return read;
}

bool LeavesNothing(const Mask& mask) {
  return !mask.empty() &&
         std::all_of(mask.data().begin(), mask.data().end(), [](auto value) { return value == 0; });
}

Mask ReadMaskFile(const Photo& photo) {
  Mask mask = OnGridOf(photo, io::ReadMask(photo.mask_file, LimitOf(photo)));
  if (mask.width() != photo.width_px || mask.height() != photo.height_px) {
    throw Error(
        fmt::format("{}: expected a mask of {}x{} pixels as its photo {} upright, found {}x{}",
                    photo.mask_file.string(), photo.width_px, photo.height_px, photo.name,
                    mask.width(), mask.height()));
  }
  if (LeavesNothing(mask)) {
    throw Error(
        fmt::format("{}: expected a mask that leaves something of its photo {}, found it "
                    "dark throughout; dark is not used",
                    photo.mask_file.string(), photo.name));
  }
  return mask;
}

// What the mask file and the alpha both allow.
Mask WithMaskFile(const Photo& photo, Mask alpha) {
  if (LeavesNothing(alpha)) {
    throw Error(
        fmt::format("{}: no pixel of {} has an alpha of at least one half; remove the "
                    "alpha channel if it means nothing",
                    photo.file.string(), photo.name));
  }
  if (photo.mask_file.empty()) return alpha;
  Mask mask = ReadMaskFile(photo);
  for (size_t i = 0; i < alpha.data().size(); ++i) mask.data()[i] &= alpha.data()[i];
  if (LeavesNothing(mask)) {
    throw Error(
        fmt::format("{}: the mask and the alpha channel of {} have no usable pixel in "
                    "common; remove one of them",
                    photo.mask_file.string(), photo.name));
  }
  return mask;
}

}  // namespace

ImageRgb8 ReadPhoto(const Photo& photo) { return ReadOnGrid(photo).image; }

Mask ReadPhotoMask(const Photo& photo) {
  if (!photo.HasMask()) return {};
  return WithMaskFile(photo, photo.alpha && photo.alpha->masks ? ReadOnGrid(photo).mask : Mask());
}

PhotoPixels ReadPhotoAndMask(const Photo& photo) {
  io::ImageAndMask read = ReadOnGrid(photo);
  PhotoPixels pixels;
  if (read.alpha.any()) {
    pixels.alpha = {read.alpha.transparent_px, read.alpha.partial_px, !read.mask.empty()};
  }
  pixels.image = std::move(read.image);
  pixels.mask = WithMaskFile(photo, std::move(read.mask));
  return pixels;
}

std::string AlphaLine(const std::vector<Photo>& photos) {
  io::AlphaTotals totals;
  for (const Photo& photo : photos) {
    if (photo.alpha)
      totals.Add({photo.alpha->transparent_px, photo.alpha->partial_px}, photo.alpha->masks);
  }
  return totals.Line();
}

}  // namespace dtr::capture
