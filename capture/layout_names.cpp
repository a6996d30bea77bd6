#include "capture/layout_names.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "capture/ingest.h"
#include "capture/names.h"

namespace dtr::capture {
namespace {

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

// Runs of letters and of digits, in lower case; what is neither separates.
std::vector<std::string> Tokens(const std::string& text) {
  std::vector<std::string> tokens;
  char before = 0;  // kind of the last character: letter, digit or neither
  for (const char c : LowerCase(text)) {
    const char kind = IsDigit(c)                                                       ? 'd'
                      : (c >= 'a' && c <= 'z') || static_cast<unsigned char>(c) >= 128 ? 'a'
                                                                                       : 0;
    if (kind == 0) {
      before = 0;
      continue;
    }
    if (kind != before) tokens.emplace_back();
    tokens.back() += c;
    before = kind;
  }
  return tokens;
}

std::optional<ImageKind> KindOf(const std::string& word) {
  using enum ImageKind;
  static const std::map<std::string_view, ImageKind> kWords{{"mask", kMask},
                                                            {"masks", kMask},
                                                            {"matte", kMask},
                                                            {"mattes", kMask},
                                                            {"depth", kDepth},
                                                            {"depths", kDepth},
                                                            {"depthmap", kDepth},
                                                            {"depthmaps", kDepth},
                                                            {"disparity", kDepth},
                                                            {"disparities", kDepth},
                                                            {"disp", kDepth},
                                                            {"normal", kNormals},
                                                            {"normals", kNormals},
                                                            {"conf", kConfidence},
                                                            {"confidence", kConfidence},
                                                            {"confidences", kConfidence},
                                                            {"seg", kLabels},
                                                            {"segmentation", kLabels},
                                                            {"segmentations", kLabels},
                                                            {"semantic", kLabels},
                                                            {"semantics", kLabels},
                                                            {"label", kLabels},
                                                            {"labels", kLabels},
                                                            {"panoptic", kLabels},
                                                            {"thumb", kPreview},
                                                            {"thumbs", kPreview},
                                                            {"thumbnail", kPreview},
                                                            {"thumbnails", kPreview},
                                                            {"preview", kPreview},
                                                            {"previews", kPreview}};
  const auto found = kWords.find(word);
  return found == kWords.end() ? std::nullopt : std::optional(found->second);
}

bool MeansPhoto(const std::string& word) {
  static const std::set<std::string_view> kWords{"image", "images", "img",    "imgs",  "rgb",
                                                 "color", "colors", "colour", "photo", "photos",
                                                 "frame", "frames", "input"};
  return kWords.contains(word);
}

bool IsFiller(const std::string& word) {
  return MeansPhoto(word) || IsDigit(word.front()) || word == "map" || word == "maps";
}

// A folder whose name is nothing but a word for a kind of image, maybe with a number: "depth_maps",
// "masks_2", "images_4". What it is called is no part of its images' key.
bool IsWordFolder(const std::vector<std::string>& tokens) {
  return !tokens.empty() && std::all_of(tokens.begin(), tokens.end(), [](const auto& token) {
    return IsFiller(token) || KindOf(token);
  }) && std::any_of(tokens.begin(), tokens.end(), [](const auto& token) {
    return MeansPhoto(token) || KindOf(token);
  });
}

std::vector<std::string> Parts(const std::string& folders) {
  std::vector<std::string> parts;
  for (size_t at = 0; at < folders.size();) {
    const size_t end = std::min(folders.find('/', at), folders.size());
    parts.push_back(folders.substr(at, end - at));
    at = end + 1;
  }
  return parts;
}

}  // namespace

std::string FolderOf(const std::string& name) {
  const size_t slash = name.rfind('/');
  return slash == std::string::npos ? "" : name.substr(0, slash);
}

std::string BareName(const std::string& name) {
  const std::filesystem::path stem = std::filesystem::path(name).stem();
  return LowerCase((IsImageExtension(stem.extension().string()) ? stem.stem() : stem).string());
}

NamedImage ReadName(const std::string& name) {
  NamedImage read;
  for (const std::string& part : Parts(FolderOf(name))) {
    const std::vector<std::string> tokens = Tokens(part);
    if (!IsWordFolder(tokens)) {
      read.key += part + "/";
      continue;
    }
    for (const std::string& token : tokens) {
      if (const auto kind = KindOf(token)) {
        read.kind = *kind;
        read.by_folder = true;
      }
    }
  }
  read.short_key = read.key;
  bool behind_kind = false, dynamic = false;
  for (const std::string& token : Tokens(BareName(name))) {
    if (const auto kind = KindOf(token)) {
      if (!read.by_folder) read.kind = *kind;
      // time step-ngp's dynamic_mask_NAME is bright where the photo is not to be used.
      if (dynamic && *kind == ImageKind::kMask) read.kind = ImageKind::kInverseMask;
      behind_kind = true;
      continue;
    }
    dynamic = token == "dynamic";
    if (MeansPhoto(token) || dynamic) continue;
    read.key += token + "_";
    if (!behind_kind || !IsDigit(token.front())) read.short_key += token + "_";
  }
  return read;
}

bool IsCalledMasks(const std::string& folder) {
  const std::vector<std::string> tokens = Tokens(folder);
  return std::any_of(tokens.begin(), tokens.end(),
                     [](const auto& token) { return KindOf(token) == ImageKind::kMask; });
}

bool IsProgramOutput(const std::string& name) {
  for (const std::string& part : Parts(FolderOf(name))) {
    const std::string lower = LowerCase(part);
    if (lower == "meshroomcache" || lower == "opensfm" || lower.rfind("odm_", 0) == 0) return true;
  }
  return false;
}

}  // namespace dtr::capture
