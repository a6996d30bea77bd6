#include "capture/layout.h"

#include <algorithm>
#include <cstring>
#include <set>

#include "capture/ingest.h"
#include "capture/layout_looks.h"
#include "capture/layout_names.h"
#include "capture/names.h"
#include "dtr/base/lower_case.h"
#include "dtr/io/rendered_mark.h"

namespace dtr::capture {
namespace fs = std::filesystem;
namespace {

// Of the contrast of a thumbnail of 24x24. A copy that was shrunk by leaving pixels out differs by
// a few per cent, views of two cameras side by side by tens.
constexpr double kSameContent = 0.1;
// Undistortion moves the corners by some per cent of the width.
constexpr double kUndistortedContent = 0.5;

struct Folder {
  std::string name;
  std::map<std::string, std::string> images;  // by bare name
  bool copies = false;                        // made by a program from photos elsewhere
  bool maps = false;                          // by its pixels
};

// The first, the middle and the last one: a single image may be dark or unreadable.
std::vector<std::string> SamplesOf(const std::vector<std::string>& names) {
  std::vector<std::string> samples;
  for (const size_t i : std::set<size_t>{0, names.size() / 2, names.size() - 1}) {
    samples.push_back(names[i]);
  }
  return samples;
}

std::vector<std::string> SamplesOf(const Folder& folder, const std::vector<std::string>& common) {
  std::vector<std::string> names;
  for (const std::string& bare : SamplesOf(common)) names.push_back(folder.images.at(bare));
  return names;
}

class Sorter {
 public:
  Sorter(const fs::path& top, const std::vector<std::string>& images, FolderContents contents,
         double memory_gb)
      : top_(top), looks_(top, memory_gb), rest_(images.begin(), images.end()) {
    layout_.contents = std::move(contents);
  }

  Layout Sort() {
    TakeRendered();
    TakeMaskFiles();
    TakeRawFiles();
    TakeProgramOutput();
    TakeNamedKinds();
    TakeSiblings();
    AssignMasks();
    layout_.photos.assign(rest_.begin(), rest_.end());
    layout_.contents.photos = static_cast<int>(layout_.photos.size());
    std::set<std::string> mask_files;
    for (const auto& [photo, mask] : layout_.masks) mask_files.insert(mask);
    layout_.contents.masks = static_cast<int>(mask_files.size());
    return std::move(layout_);
  }

 private:
  void TakeRendered();
  void TakeMaskFiles();
  void TakeRawFiles();
  void TakeProgramOutput();
  void TakeNamedKinds();
  bool LooksLike(const NamedImage& named, const std::string& sample, const std::string& photo);
  bool IsPreview(const std::string& sample, const std::string& photo);
  bool AreDeep(const std::vector<std::string>& samples);
  void TakeSiblings();
  std::vector<Folder> FoldersOfRest();
  void SortFolder(const Folder& folder, const std::vector<const Folder*>& photos, bool& is_photos);
  bool IsCopy(const Folder& folder, const Folder& of, const std::vector<std::string>& common);
  void AssignMasks();
  void Take(const std::string& name, ImageKind kind);
  void Ignore(const std::string& name, const char* kind, const char* what, const char* reason);

  fs::path top_;
  Looks looks_;
  std::set<std::string> rest_;  // what may be a photo
  std::map<std::string, std::vector<std::string>> masks_by_key_;
  Layout layout_;
};

void Sorter::Ignore(const std::string& name, const char* kind, const char* what,
                    const char* reason) {
  rest_.erase(name);
  const std::string folder = FolderOf(name);
  layout_.contents.Ignore(kind, what, reason, folder.empty() ? "" : PrintableName(folder) + "/");
}

void Sorter::Take(const std::string& name, ImageKind kind) {
  switch (kind) {
    case ImageKind::kPhoto:
      return;
    case ImageKind::kMask:
      rest_.erase(name);
      masks_by_key_[ReadName(name).key].push_back(name);
      return;
    case ImageKind::kInverseMask:
      return Ignore(name, "inverse_masks", "masks that are bright where nothing is to be used",
                    "invert them and call them NAME_mask.png");
    case ImageKind::kDepth:
      ++layout_.contents.depth_maps;
      return Ignore(name, "depth_maps", "depth maps", "dtr import takes them");
    case ImageKind::kNormals:
      return Ignore(name, "normal_maps", "normal maps", "");
    case ImageKind::kConfidence:
      return Ignore(name, "confidence_maps", "confidence maps", "");
    case ImageKind::kLabels:
      return Ignore(name, "label_maps", "label maps", "");
    case ImageKind::kPreview:
      return Ignore(name, "previews", "previews", "");
  }
}

// Of a folder that holds nothing else they are what was asked for.
void Sorter::TakeRendered() {
  std::vector<std::string> rendered;
  for (const std::string& name : rest_) {
    if (io::IsRendered(top_ / name)) rendered.push_back(name);
  }
  if (rendered.size() == rest_.size()) return;
  for (const std::string& name : rendered) {
    Ignore(name, "rendered_images", "images that dtr rendered", "give their folder to use them");
  }
}

// "a_mask.png" is the mask of "a.jpg" beside it.
void Sorter::TakeMaskFiles() {
  constexpr char kEnd[] = "_mask";
  std::multimap<std::string, std::string> by_stem;
  for (const std::string& name : rest_) by_stem.emplace(StemOf(name), name);
  for (const std::string& name : std::vector<std::string>(rest_.begin(), rest_.end())) {
    const std::string stem = StemOf(name);
    if (!stem.ends_with(kEnd)) continue;
    const auto [first, last] = by_stem.equal_range(stem.substr(0, stem.size() - strlen(kEnd)));
    if (first == last) continue;
    bool used = false;
    for (auto photo = first; photo != last; ++photo) {
      used = layout_.masks.emplace(photo->second, name).second || used;
    }
    if (!used) {
      layout_.skipped.push_back(
          {name, "a second mask of " + first->second + "; remove one of them"});
    }
    rest_.erase(name);
  }
}

void Sorter::TakeRawFiles() {
  std::set<std::string> developed;
  for (const std::string& name : rest_) {
    if (!IsRawExtension(fs::path(name).extension().string())) developed.insert(StemOf(name));
  }
  for (const std::string& name : std::vector<std::string>(rest_.begin(), rest_.end())) {
    if (!IsRawExtension(fs::path(name).extension().string())) continue;
    if (!developed.contains(StemOf(name))) continue;
    Ignore(name, "raw_files", "raw files", "the developed photo beside each is used");
  }
}

void Sorter::TakeProgramOutput() {
  if (std::all_of(rest_.begin(), rest_.end(), IsProgramOutput)) return;
  for (const std::string& name : std::vector<std::string>(rest_.begin(), rest_.end())) {
    if (IsProgramOutput(name)) {
      Ignore(name, "program_results", "images that other programs made",
             "give their folder to use them");
    }
  }
}

// A smaller image, of the same content where it is not cropped.
bool Sorter::IsPreview(const std::string& sample, const std::string& photo) {
  if (photo.empty()) return true;
  if (looks_.Difference(photo, sample) < kSameContent) return true;
  const ImageSize size = looks_.SizeOf(sample), full = looks_.SizeOf(photo);
  return size.width_px < full.width_px && size.height_px < full.height_px &&
         !looks_.IsReducedSize(sample, photo);
}

// Whether the pixels agree with the word. "normal" and "preview" are also names of cameras, speeds
// and exposures. `photo`: the one that it may belong to, if any.
bool Sorter::LooksLike(const NamedImage& named, const std::string& sample,
                       const std::string& photo) {
  const ImageSize size = looks_.SizeOf(sample);
  if (named.kind == ImageKind::kDepth) {
    return named.by_folder || size.one_channel || looks_.LookOf(sample).grey;
  }
  const ImageLook& look = looks_.LookOf(sample);
  if (!look.readable) return named.by_folder;
  switch (named.kind) {
    case ImageKind::kMask:
    case ImageKind::kInverseMask:
      return look.grey;
    case ImageKind::kConfidence:
      return look.grey || (named.by_folder && size.is_float);
    case ImageKind::kNormals:  // of floats, whose values are no colours, the folder's word is all
      return look.normals || (named.by_folder && size.is_float);
    case ImageKind::kLabels:
      return look.flat && (named.by_folder || look.few_colours);
    case ImageKind::kPreview:
      return IsPreview(sample, photo);
    default:
      return true;
  }
}

bool Sorter::AreDeep(const std::vector<std::string>& samples) {
  return std::all_of(samples.begin(), samples.end(), [&](const std::string& sample) {
    const ImageSize& size = looks_.SizeOf(sample);
    return size.one_channel && size.deep;
  });
}

// What words call something else than a photo, where there is the photo that it belongs to.
void Sorter::TakeNamedKinds() {
  std::map<std::string, NamedImage> named;
  std::map<std::string, std::string> photo_of;  // by key
  for (const std::string& name : rest_) {
    named[name] = ReadName(name);
    if (named[name].kind == ImageKind::kPhoto) photo_of.emplace(named[name].key, name);
  }
  if (photo_of.empty()) return;
  const auto photo = [&](const std::string& name) -> std::string {
    for (const std::string& key : {named[name].key, named[name].short_key}) {
      if (const auto found = photo_of.find(key); found != photo_of.end()) return found->second;
    }
    return {};
  };
  struct Group {
    std::vector<std::string> names;
    size_t matched = 0;
  };
  std::map<std::pair<std::string, ImageKind>, Group> groups;
  for (const auto& [name, read] : named) {
    if (read.kind == ImageKind::kPhoto) continue;
    Group& group = groups[{FolderOf(name), read.kind}];
    group.names.push_back(name);
    group.matched += !photo(name).empty();
  }
  for (const auto& [where, group] : groups) {
    const std::vector<std::string> samples = SamplesOf(group.names);
    const bool is_depth = where.second == ImageKind::kDepth && AreDeep(samples);
    if (2 * group.matched < group.names.size() && !is_depth) continue;
    if (group.matched == 0 && !named[samples.front()].by_folder) continue;
    const bool agree = std::all_of(samples.begin(), samples.end(), [&](const std::string& sample) {
      return LooksLike(named[sample], sample, photo(sample));
    });
    if (!agree) continue;
    for (const std::string& name : group.names) Take(name, where.second);
  }
}

// COLMAP's image_undistorter writes images/ beside stereo/ and sparse/; scripts for Gaussian splats
// keep the originals in input/ and what was undistorted in images/, beside distorted/.
bool HoldsUndistorted(const fs::path& top, const std::string& folder) {
  std::error_code ignored;
  for (fs::path part = folder; !part.empty(); part = part.parent_path()) {
    const fs::path parent = top / part.parent_path();
    const std::string name = LowerCase(part.filename().string());
    if (name == "images" && ((fs::is_directory(parent / "stereo", ignored) &&
                              fs::is_directory(parent / "sparse", ignored)) ||
                             fs::is_directory(parent / "distorted", ignored))) {
      return true;
    }
    if (name == "undistorted" || name == "undistorted_images" || name == "corrected_images") {
      return true;
    }
  }
  return false;
}

std::vector<Folder> Sorter::FoldersOfRest() {
  std::map<std::string, Folder> by_name;
  for (const std::string& name : rest_) {
    Folder& folder = by_name[FolderOf(name)];
    folder.name = FolderOf(name);
    folder.images.emplace(BareName(name), name);
  }
  std::vector<Folder> folders;
  for (auto& [name, folder] : by_name) {
    folder.copies = HoldsUndistorted(top_, name);
    folders.push_back(std::move(folder));
  }
  return folders;
}

std::vector<std::string> CommonNames(const Folder& a, const Folder& b) {
  std::vector<std::string> common;
  for (const auto& [bare, name] : a.images) {
    if (b.images.contains(bare)) common.push_back(bare);
  }
  return common;
}

bool Sorter::IsCopy(const Folder& folder, const Folder& of,
                    const std::vector<std::string>& common) {
  const std::vector<std::string> samples = SamplesOf(common);
  return std::all_of(samples.begin(), samples.end(), [&](const std::string& bare) {
    const std::string& a = folder.images.at(bare);
    const std::string& b = of.images.at(bare);
    if (looks_.IsReducedSize(a, b)) return looks_.Difference(b, a) < kSameContent;
    return folder.copies && !of.copies && looks_.Difference(b, a) < kUndistortedContent;
  });
}

// What a folder holds whose images have the names of `photos`.
void Sorter::SortFolder(const Folder& folder, const std::vector<const Folder*>& photos,
                        bool& is_photos) {
  for (const Folder* of : photos) {
    const std::vector<std::string> common = CommonNames(folder, *of);
    if (common.empty() || 2 * common.size() < folder.images.size()) continue;
    const std::vector<std::string> samples = SamplesOf(folder, common);
    const std::vector<std::string> photo_samples = SamplesOf(*of, common);
    ImageKind kind = ImageKind::kDepth;
    if (!AreDeep(samples) || looks_.SizeOf(photo_samples.front()).one_channel) {
      kind = looks_.KindOf(samples, IsCalledMasks(folder.name));
      if (kind != ImageKind::kPhoto && kind == looks_.KindOf(photo_samples, false)) {
        kind = ImageKind::kPhoto;
      }
    }
    const bool copy = kind == ImageKind::kPhoto && IsCopy(folder, *of, common);
    if (kind == ImageKind::kPhoto && !copy) continue;
    is_photos = false;
    for (const auto& [bare, name] : folder.images) {
      if (!copy && kind == ImageKind::kMask) {
        rest_.erase(name);
        const auto of_photo = of->images.find(bare);
        masks_by_key_[of_photo == of->images.end() ? name : ReadName(of_photo->second).key]
            .push_back(name);
      } else if (!copy) {
        Take(name, kind);
      } else if (folder.copies) {
        Ignore(name, "undistorted_copies", "undistorted copies", "the originals are used");
      } else {
        Ignore(name, "reduced_copies", "reduced copies", "");
      }
    }
    return;
  }
}

// Folders that hold the same names: copies and maps of photos, or the photos of several cameras.
void Sorter::TakeSiblings() {
  std::vector<Folder> folders = FoldersOfRest();
  // The names that more than one folder has; nothing else needs a look.
  std::map<std::string, int> uses;
  for (const Folder& folder : folders) {
    for (const auto& [bare, name] : folder.images) ++uses[bare];
  }
  std::erase_if(folders, [&](const Folder& folder) {
    return std::none_of(folder.images.begin(), folder.images.end(),
                        [&](const auto& image) { return uses[image.first] > 1; });
  });
  // Photos before what may belong to them, large ones before small ones.
  for (Folder& folder : folders) {
    std::vector<std::string> names;
    for (const auto& [bare, name] : folder.images) names.push_back(name);
    const std::vector<std::string> samples = SamplesOf(names);
    folder.maps = looks_.SizeOf(samples.front()).one_channel ||
                  looks_.KindOf(samples, IsCalledMasks(folder.name)) != ImageKind::kPhoto;
  }
  const auto rank = [&](const Folder& folder) {
    const ImageSize& size = looks_.SizeOf(folder.images.begin()->second);
    return std::tuple(folder.copies, folder.maps,
                      -static_cast<std::int64_t>(size.width_px) * size.height_px, folder.name);
  };
  std::sort(folders.begin(), folders.end(),
            [&](const Folder& a, const Folder& b) { return rank(a) < rank(b); });
  std::vector<const Folder*> photos;
  for (const Folder& folder : folders) {
    bool is_photos = true;
    SortFolder(folder, photos, is_photos);
    if (is_photos) photos.push_back(&folder);
  }
}

// Of several masks of a photo, as of its reduced copies too, the one that has its size.
void Sorter::AssignMasks() {
  std::set<std::string> used;
  for (const std::string& photo : rest_) {
    const auto found = masks_by_key_.find(ReadName(photo).key);
    if (found == masks_by_key_.end()) continue;
    const std::vector<std::string>& masks = found->second;
    const ImageSize size = looks_.SizeOf(photo);
    auto fits = std::find_if(masks.begin(), masks.end(), [&](const std::string& mask) {
      const ImageSize& other = looks_.SizeOf(mask);
      return other.width_px == size.width_px && other.height_px == size.height_px;
    });
    if (fits == masks.end()) fits = masks.begin();  // whoever reads it says what is wrong
    if (layout_.masks.emplace(photo, *fits).second) used.insert(*fits);
  }
  for (const auto& [key, masks] : masks_by_key_) {
    for (const std::string& mask : masks) {
      if (!used.contains(mask)) {
        Ignore(mask, "unused_masks", "masks",
               "of reduced size, or their photo has one or is absent");
      }
    }
  }
}

}  // namespace

Layout SortImages(const fs::path& folder, const std::vector<std::string>& images,
                  FolderContents contents, double memory_gb) {
  return Sorter(folder, images, std::move(contents), memory_gb).Sort();
}

}  // namespace dtr::capture
