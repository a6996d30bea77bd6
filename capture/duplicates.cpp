#include "capture/duplicates.h"

#include <algorithm>
#include <map>
#include <set>

#include "dtr/base/hash.h"

namespace dtr::capture {
namespace {

// Photos that screening says another one may repeat, and those others.
std::set<std::string> Suspects(const Capture& capture) {
  std::set<std::string> names;
  for (const Photo& photo : capture.photos) {
    if (!photo.screening || photo.screening->duplicate_of.empty()) continue;
    names.insert({photo.name, photo.screening->duplicate_of});
  }
  return names;
}

// Equal for photos that give equal views wherever they stand.
std::string ImageHash(const Photo& photo) {
  const PhotoPixels read = ReadPhotoAndMask(photo);
  const ImageRgb8& pixels = read.image;
  return std::to_string(pixels.width()) + "x" + std::to_string(pixels.height()) + " " +
         Sha256(std::as_bytes(std::span(pixels.data()))) + " " +
         Sha256(std::as_bytes(std::span(read.mask.data())));
}

}  // namespace

std::vector<LeftOut> DropSameImages(Capture& capture,
                                    const std::function<bool(const std::string&)>& preferred) {
  const std::set<std::string> suspects = Suspects(capture);
  std::map<std::string, std::vector<std::string>> names_of;  // by image
  for (const Photo& photo : capture.photos) {
    if (suspects.contains(photo.name)) names_of[ImageHash(photo)].push_back(photo.name);
  }
  std::map<std::string, std::string> same_as;
  for (const auto& [picture, names] : names_of) {
    const auto first = std::find_if(names.begin(), names.end(), preferred);
    const std::string& kept = first == names.end() ? names.front() : *first;
    for (const std::string& name : names) {
      if (name != kept && !preferred(name)) same_as[name] = kept;
    }
  }
  std::vector<LeftOut> left_out;
  for (const auto& [name, kept] : same_as) {
    left_out.push_back({name, kept});
    capture.skipped.push_back({name, "has the same pixels as " + kept});
  }
  std::erase_if(capture.photos, [&](const Photo& photo) { return same_as.contains(photo.name); });
  std::sort(capture.skipped.begin(), capture.skipped.end(),
            [](const Skipped& a, const Skipped& b) { return a.name < b.name; });
  return left_out;
}

}  // namespace dtr::capture
