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

// `same_as`: the photos that go, and those that stay for them.
std::vector<LeftOut> LeaveOut(const std::map<std::string, std::string>& same_as,
                              const std::string& reason, Capture& capture) {
  std::vector<LeftOut> left_out;
  for (const auto& [name, kept] : same_as) {
    left_out.push_back({name, kept});
    capture.skipped.push_back({name, reason + kept});
  }
  std::erase_if(capture.photos, [&](const Photo& photo) { return same_as.contains(photo.name); });
  std::sort(capture.skipped.begin(), capture.skipped.end(),
            [](const Skipped& a, const Skipped& b) { return a.name < b.name; });
  return left_out;
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
  return LeaveOut(same_as, "has the same pixels as ", capture);
}

std::vector<LeftOut> DropCopiesOf(std::vector<bool>& held_out, Capture& capture) {
  const auto image_of = [](const Photo& photo) {
    const bool is_copy = photo.screening && !photo.screening->duplicate_of.empty();
    return is_copy ? photo.screening->duplicate_of : photo.name;
  };
  std::map<std::string, std::string> held_out_of;  // by image
  for (size_t i = 0; i < capture.photos.size(); ++i) {
    if (held_out[i]) held_out_of.emplace(image_of(capture.photos[i]), capture.photos[i].name);
  }
  std::map<std::string, std::string> same_as;
  std::vector<bool> left;
  for (size_t i = 0; i < capture.photos.size(); ++i) {
    const Photo& photo = capture.photos[i];
    const auto found = held_out_of.find(image_of(photo));
    const bool goes = !held_out[i] && found != held_out_of.end();
    if (goes) same_as[photo.name] = found->second;
    if (!goes) left.push_back(held_out[i]);
  }
  held_out = std::move(left);
  return LeaveOut(same_as, "shows the same image as a held-out photo, ", capture);
}

}  // namespace dtr::capture
