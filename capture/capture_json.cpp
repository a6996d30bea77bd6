#include "capture/capture_json.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "capture/contents_json.h"
#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/io/json_fields.h"
#include "dtr/types/panorama.h"

namespace dtr::capture {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kFormat[] = "dtr-capture";
constexpr int kVersion = 1;
constexpr int kLargestSidePx = 1'000'000;
constexpr std::uint64_t kLargestCount = 1'000'000'000'000;  // both sides at their largest

// A JSON value that knows where it stands, for errors that name the field.
class Node {
 public:
  Node(const Json& value, std::string where) : value_(value), where_(std::move(where)) {}

  Node operator[](const char* key) const {
    if (!value_.is_object()) Fail("an object");
    const auto found = value_.find(key);
    if (found == value_.end())
      throw Error(where_ + ": expected a field \"" + key + "\", found none");
    return {*found, where_ + "." + key};
  }
  std::vector<Node> Items() const {
    if (!value_.is_array()) Fail("a list");
    std::vector<Node> items;
    for (size_t i = 0; i < value_.size(); ++i) {
      items.emplace_back(value_[i], where_ + "[" + std::to_string(i) + "]");
    }
    return items;
  }
  /// The field's value; nothing where there is none or it is null.
  std::optional<Node> Optional(const char* key) const {
    if (!value_.is_object()) Fail("an object");
    const auto found = value_.find(key);
    if (found == value_.end() || found->is_null()) return {};
    return Node(*found, where_ + "." + key);
  }
  bool IsNull() const { return value_.is_null(); }
  const std::string& where() const { return where_; }

  std::string Text() const {
    if (!value_.is_string()) Fail("a text");
    return value_.get<std::string>();
  }
  int Int(int low, int high) const {
    if (!value_.is_number_integer()) Fail("a whole number");
    const double number = value_.get<double>();
    if (!(number >= low && number <= high)) {
      Fail("a number from " + std::to_string(low) + " to " + std::to_string(high));
    }
    return static_cast<int>(number);
  }
  std::int64_t Count() const {
    if (!value_.is_number_unsigned() || value_.get<std::uint64_t>() > kLargestCount) {
      Fail("a number of pixels");
    }
    return value_.get<std::int64_t>();
  }
  bool Bool() const {
    if (!value_.is_boolean()) Fail("true or false");
    return value_.get<bool>();
  }
  double Number(double low, double high) const {
    if (!value_.is_number()) Fail("a number");
    const double number = value_.get<double>();
    if (!std::isfinite(number) || number < low || number > high) Fail("a number in its range");
    return number;
  }
  [[noreturn]] void Fail(const std::string& expected) const {
    constexpr size_t kShown = 60;
    std::string found = value_.dump(-1, ' ', true, Json::error_handler_t::replace);
    if (found.size() > kShown) found = found.substr(0, kShown) + "...";
    throw Error(where_ + ": expected " + expected + ", found " + found);
  }

 private:
  const Json& value_;
  std::string where_;
};

constexpr double kHuge = std::numeric_limits<double>::max();

Json ToJson(const Screening& screening) {
  Json faults = Json::array();
  for (const Fault fault : screening.faults) faults.push_back(NameOf(fault));
  return {{"sharpness", screening.sharpness},
          {"overexposed_share", screening.overexposed_share},
          {"underexposed_share", screening.underexposed_share},
          {"duplicate_of", screening.duplicate_of},
          {"faults", faults},
          {"remarks", screening.remarks}};
}

Json ToJson(const io::GpsPosition& gps) {
  Json json{{"latitude_deg", gps.latitude_deg}, {"longitude_deg", gps.longitude_deg}};
  json["altitude_m"] = gps.altitude_m ? Json(*gps.altitude_m) : Json();
  if (gps.horizontal_error_m) json["horizontal_error_m"] = *gps.horizontal_error_m;
  return json;
}

Json ToJson(const Photo& photo) {
  Json json;
  json["id"] = photo.id;
  json["name"] = photo.name;
  json["file"] = photo.file.generic_string();
  json["width_px"] = photo.width_px;
  json["height_px"] = photo.height_px;
  json["exif_orientation"] = photo.exif_orientation;
  json["focal_prior_px"] = photo.focal_prior_px ? Json(*photo.focal_prior_px) : Json();
  json["focal_source"] = photo.focal_source;
  json["camera_group"] = photo.camera_group;
  json["make"] = photo.make;
  json["model"] = photo.model;
  json["lens_model"] = photo.lens_model;
  json["date_time"] = photo.date_time;
  json["gps"] = photo.gps ? ToJson(*photo.gps) : Json();
  if (const auto& frame = photo.video_frame) {
    json["video_frame"] = {
        {"video", frame->video}, {"number", frame->number}, {"time_s", frame->time_s}};
  }
  if (const auto& face = photo.face) {
    json["panorama"] = {{"name", face->panorama}, {"face", face->face}};
  }
  if (!photo.mask_file.empty()) {
    json["mask"] = {{"file", photo.mask_file.generic_string()}, {"sha256", photo.mask_sha256}};
  }
  if (photo.alpha) {
    json["alpha"] = {{"transparent_px", photo.alpha->transparent_px},
                     {"partial_px", photo.alpha->partial_px},
                     {"masks", photo.alpha->masks}};
  }
  json["source_sha256"] = photo.source_sha256;
  json["screening"] = photo.screening ? ToJson(*photo.screening) : Json();
  return json;
}

Screening ScreeningFrom(const Node& node) {
  Screening screening;
  screening.sharpness = node["sharpness"].Number(0, kHuge);
  screening.overexposed_share = node["overexposed_share"].Number(0, 1);
  screening.underexposed_share = node["underexposed_share"].Number(0, 1);
  screening.duplicate_of = node["duplicate_of"].Text();
  if (const auto faults = node.Optional("faults")) {
    for (const Node& name : faults->Items()) {
      const auto fault = FaultCalled(name.Text());
      if (!fault) name.Fail("blurred, overexposed, underexposed or duplicate");
      screening.faults.push_back(*fault);
    }
  }
  for (const Node& remark : node["remarks"].Items()) screening.remarks.push_back(remark.Text());
  if (screening.faults.size() > screening.remarks.size()) {
    node["faults"].Fail("a remark for each fault");
  }
  return screening;
}

io::GpsPosition GpsFrom(const Node& node) {
  io::GpsPosition gps;
  gps.latitude_deg = node["latitude_deg"].Number(-90, 90);
  gps.longitude_deg = node["longitude_deg"].Number(-180, 180);
  const Node altitude = node["altitude_m"];
  if (!altitude.IsNull()) gps.altitude_m = altitude.Number(-kHuge, kHuge);
  if (const auto error = node.Optional("horizontal_error_m")) {
    gps.horizontal_error_m = error->Number(0, kHuge);
  }
  return gps;
}

bool IsSafeId(const std::string& id) {
  return !id.empty() && id.size() <= 255 && id.front() != '-' &&
         id.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
             std::string::npos;
}

Photo PhotoFrom(const Node& node) {
  Photo photo;
  photo.id = node["id"].Text();
  if (!IsSafeId(photo.id)) node["id"].Fail("letters, digits, '_' and '-'");
  photo.name = node["name"].Text();
  RequireSafeName(photo.name, node["name"].where());
  const std::string file = node["file"].Text();
  RequireSafeName(file, node["file"].where());
  photo.file = file;
  photo.width_px = node["width_px"].Int(1, kLargestSidePx);
  photo.height_px = node["height_px"].Int(1, kLargestSidePx);
  photo.exif_orientation = node["exif_orientation"].Int(1, 8);
  const Node focal = node["focal_prior_px"];
  if (!focal.IsNull()) {
    photo.focal_prior_px = focal.Number(std::numeric_limits<double>::min(), kHuge);
  }
  photo.focal_source = node["focal_source"].Text();
  photo.camera_group = node["camera_group"].Text();
  photo.make = node["make"].Text();
  photo.model = node["model"].Text();
  photo.lens_model = node["lens_model"].Text();
  photo.date_time = node["date_time"].Text();
  if (!node["gps"].IsNull()) photo.gps = GpsFrom(node["gps"]);
  if (const auto frame = node.Optional("video_frame")) {
    photo.video_frame = {(*frame)["video"].Text(),
                         (*frame)["number"].Int(0, std::numeric_limits<int>::max()),
                         (*frame)["time_s"].Number(-kHuge, kHuge)};
  }
  if (const auto panorama = node.Optional("panorama")) {
    photo.face = {(*panorama)["name"].Text(), (*panorama)["face"].Text()};
    if (FaceCalled(photo.face->face).name.empty()) {
      (*panorama)["face"].Fail(
          "the name of a panorama's face: front, right, back, left, up or down");
    }
    if (photo.width_px != photo.height_px)
      node["height_px"].Fail("its width, of a panorama's face");
  }
  if (const auto mask = node.Optional("mask")) {
    const std::string mask_file = (*mask)["file"].Text();
    RequireSafeName(mask_file, (*mask)["file"].where());
    photo.mask_file = mask_file;
    photo.mask_sha256 = (*mask)["sha256"].Text();
  }
  if (const auto alpha = node.Optional("alpha")) {
    photo.alpha = PhotoAlpha{(*alpha)["transparent_px"].Count(), (*alpha)["partial_px"].Count(),
                             (*alpha)["masks"].Bool()};
  }
  photo.source_sha256 = node["source_sha256"].Text();
  if (!node["screening"].IsNull()) photo.screening = ScreeningFrom(node["screening"]);
  return photo;
}

// Names rise byte by byte, ids differ: both are keys elsewhere.
void CheckKeys(const Capture& capture, const std::string& source) {
  std::set<std::string> ids;
  for (size_t i = 0; i < capture.photos.size(); ++i) {
    const Photo& photo = capture.photos[i];
    if (!ids.insert(photo.id).second) {
      throw Error(source + ": expected a different id for each photo, found \"" + photo.id +
                  "\" twice");
    }
    if (i > 0 && !(capture.photos[i - 1].name < photo.name)) {
      throw Error(source + ": expected photos in rising byte order of their names, found \"" +
                  photo.name + "\" after \"" + capture.photos[i - 1].name + "\"");
    }
  }
}

}  // namespace

std::string CaptureToJson(const Capture& capture) {
  Json json;
  json["format"] = kFormat;
  json["version"] = kVersion;
  json["photos"] = Json::array();
  for (const Photo& photo : capture.photos) json["photos"].push_back(ToJson(photo));
  json["skipped"] = Json::array();
  for (const Skipped& skipped : capture.skipped) {
    json["skipped"].push_back({{"name", skipped.name}, {"reason", skipped.reason}});
  }
  json["remarks"] = Json::array();
  for (const Remark& remark : capture.remarks) {
    json["remarks"].push_back({{"name", remark.name}, {"text", remark.text}});
  }
  json["contents"] = JsonOf(capture.contents);  // for people and other programs
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Capture CaptureFromJson(std::string_view text, const std::string& source) {
  const Json json = io::ParseJson(std::string(text), source);
  const Node root(json, source);
  if (root["format"].Text() != kFormat) root["format"].Fail(std::string("\"") + kFormat + "\"");
  if (root["version"].Int(0, std::numeric_limits<int>::max()) != kVersion) {
    root["version"].Fail("version " + std::to_string(kVersion) + " (newer ones need a newer dtr)");
  }
  Capture capture;
  for (const Node& photo : root["photos"].Items()) capture.photos.push_back(PhotoFrom(photo));
  for (const Node& skipped : root["skipped"].Items()) {
    capture.skipped.push_back({skipped["name"].Text(), skipped["reason"].Text()});
  }
  if (json.contains("remarks")) {  // since 2026-11-25
    for (const Node& remark : root["remarks"].Items()) {
      capture.remarks.push_back({remark["name"].Text(), remark["text"].Text()});
    }
  }
  CheckKeys(capture, source);
  return capture;
}

}  // namespace dtr::capture
