#include "calib/files/camera_fields.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <set>

#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

// Top-level keys of a YAML file in the block style that FileStorage and ROS write.
std::vector<Field> YamlFields(const std::string& text, const std::string& where) {
  std::vector<Field> fields;
  std::set<std::string> names;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view line(text.data() + at, end - at);
    at = end + 1;
    const std::string_view words = Trimmed(line);
    if (words.empty() || words[0] == '#' || words[0] == '%' || words == "---" || words == "...") {
      continue;
    }
    const bool at_margin = line[0] != ' ' && line[0] != '\t' && line[0] != '-';
    const size_t colon = line.find(':');
    if (at_margin && colon != std::string_view::npos) {
      const std::string key(Trimmed(line.substr(0, colon)));
      if (!names.insert(key).second) {
        throw Error(where + ": the key '" + Shown(key) + "' stands twice");
      }
      fields.push_back({key, std::string(Trimmed(line.substr(colon + 1)))});
    } else if (!fields.empty()) {
      fields.back().text += '\n';
      fields.back().text += words;
    } else {
      throw Error(where + ": expected YAML with keys at the margin, found '" + Shown(words) + "'");
    }
  }
  return fields;
}

// "1 2\n3" -> "data: [ 1, 2, 3 ]".
std::string AsData(std::string_view numbers) {
  std::string list;
  bool in_word = false;
  for (const char c : numbers) {
    const bool blank = c == ' ' || c == '\n' || c == '\t' || c == '\r';
    if (!blank && !in_word && !list.empty()) list += ", ";
    if (!blank) list += c;
    in_word = !blank;
  }
  return "data: [ " + list + " ]";
}

// What lies between <name> and </name>, from `at` on, which moves behind it; empty: no such pair.
std::optional<std::string_view> Inside(std::string_view text, std::string_view name, size_t& at) {
  const std::string open = "<" + std::string(name), close = "</" + std::string(name) + ">";
  const size_t begin = text.find(open, at);
  const size_t body = begin == std::string_view::npos ? begin : text.find('>', begin);
  const size_t end = body == std::string_view::npos ? body : text.find(close, body);
  if (end == std::string_view::npos) return std::nullopt;
  at = end + close.size();
  return text.substr(body + 1, end - body - 1);
}

// The elements below <opencv_storage>.
std::vector<Field> XmlFields(const std::string& text, const std::string& where) {
  size_t at = 0;
  const auto storage = Inside(text, "opencv_storage", at);
  if (!storage) {
    throw Error(where +
                ": expected <opencv_storage> ... </opencv_storage>, found other XML; the "
                "file may be cut short");
  }
  std::vector<Field> fields;
  std::set<std::string> names;
  for (at = 0; (at = storage->find('<', at)) != std::string_view::npos;) {
    if (storage->substr(at, 4) == "<!--") {
      at = std::min(storage->find("-->", at), storage->size());
      continue;
    }
    const size_t name_end = storage->find_first_of(" \t\r\n/>", at + 1);
    const std::string name(storage->substr(at + 1, std::min(name_end, storage->size()) - at - 1));
    const auto body = name.empty() ? std::nullopt : Inside(*storage, name, at);
    if (!body) throw Error(where + ": the element '" + Shown(name) + "' does not end");
    if (!names.insert(name).second) {
      throw Error(where + ": the key '" + Shown(name) + "' stands twice");
    }
    size_t in_body = 0;
    const auto data = Inside(*body, "data", in_body);
    const std::string_view words = Trimmed(*body);
    const bool several = words.find_first_of(" \n\t") != std::string_view::npos;
    fields.push_back({name, data ? AsData(*data) : several ? AsData(words) : std::string(words)});
  }
  return fields;
}

struct Role {
  FieldRole role;
  const char* what;
  std::vector<const char*> names;  // as they are shown; upper case and '_' make no difference
};

const Role& RoleOf(FieldRole role) {
  static const std::vector<Role> kRoles = {
      {FieldRole::kMatrix,
       "camera matrix",
       {"camera_matrix", "K", "mtx", "intrinsic_matrix", "camera_intrinsics"}},
      {FieldRole::kDistortion,
       "distortion coefficients",
       {"distortion_coefficients", "D", "dist", "dist_coeffs", "distortion", "distortion_coeffs",
        "dist_coefficients"}},
      {FieldRole::kWidth, "image width", {"image_width", "width"}},
      {FieldRole::kHeight, "image height", {"image_height", "height"}},
      {FieldRole::kSize, "image size", {"image_size", "img_size", "calibration_image_size"}}};
  return *std::find_if(kRoles.begin(), kRoles.end(), [&](const Role& r) { return r.role == role; });
}

std::string Plain(std::string_view name) {
  std::string plain;
  for (const char c : name) {
    if (c != '_') plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return plain;
}

bool BeginsWithAny(const std::vector<Field>& fields, std::initializer_list<const char*> starts) {
  return std::any_of(fields.begin(), fields.end(), [&](const Field& field) {
    return std::any_of(starts.begin(), starts.end(),
                       [&](const char* start) { return field.name.starts_with(start); });
  });
}

// Whose file it seems to be, as a clause; empty: nobody's in particular.
std::string SeemsToBe(const std::vector<Field>& fields) {
  const bool chain = std::any_of(fields.begin(), fields.end(), [](const Field& field) {
    return field.name.starts_with("cam") && field.text.find("intrinsics:") != std::string::npos;
  });
  if (chain) return "; it seems to be a camera chain of Kalibr, which is another format";
  if (BeginsWithAny(fields, {"Camera.fx", "Camera1.fx", "Camera.type"})) {
    return "; it seems to be settings of ORB-SLAM, which are another format";
  }
  if (BeginsWithAny(fields, {"M1", "cameraMatrix1", "camera_matrix_1", "K1"})) {
    return "; it seems to hold two cameras of a stereo pair; write the one that took the photos "
           "into a file of its own";
  }
  return "";
}

std::string NamesOf(const std::vector<Field>& fields) {
  constexpr size_t kMax = 8;
  std::string names;
  for (size_t i = 0; i < std::min(kMax, fields.size()); ++i) {
    names += (i > 0 ? ", " : "") + Shown(fields[i].name);
  }
  return fields.empty() ? "nothing" : fields.size() > kMax ? names + ", ..." : names;
}

}  // namespace

std::string_view Trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string Shown(std::string_view text) {
  constexpr size_t kLongest = 40;
  std::string shown(Trimmed(text.substr(0, kLongest)));
  for (char& c : shown) c = static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  return shown;
}

CameraFields::CameraFields(const std::string& content, std::string where)
    : where_(std::move(where)) {
  const bool xml = Trimmed(content).starts_with("<");
  fields_ = xml ? XmlFields(content, where_) : YamlFields(content, where_);
}

const Field* CameraFields::Named(std::string_view name) const {
  const auto found = std::find_if(fields_.begin(), fields_.end(),
                                  [&](const Field& field) { return field.name == name; });
  return found == fields_.end() ? nullptr : &*found;
}

const Field* CameraFields::Find(FieldRole role) const {
  const Role& sought = RoleOf(role);
  const Field* found = nullptr;
  for (const Field& field : fields_) {
    const bool is_meant =
        std::any_of(sought.names.begin(), sought.names.end(),
                    [&](const char* name) { return Plain(name) == Plain(field.name); });
    if (!is_meant) continue;
    if (found != nullptr) {
      throw Error(fmt::format("{}: {} and {} may both be the {}; leave the one that is meant",
                              where_, Shown(found->name), Shown(field.name), sought.what));
    }
    found = &field;
  }
  return found;
}

const Field& CameraFields::Get(FieldRole role) const {
  const Field* found = Find(role);
  if (found != nullptr) return *found;
  const Role& sought = RoleOf(role);
  throw Error(fmt::format(
      "{}: no {}: looked for {}, the file has {}{}; write image_width, image_height, camera_matrix "
      "and distortion_coefficients as OpenCV's FileStorage does",
      where_, sought.what, fmt::join(sought.names, ", "), NamesOf(fields_), SeemsToBe(fields_)));
}

}  // namespace dtr::calib
