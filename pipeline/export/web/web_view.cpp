#include "pipeline/export/web/web_view.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/lower_case.h"
#include "dtr/base/order_statistics.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/small_jpeg.h"
#include "dtr/render/scene.h"
#include "dtr/types/inverse_depth_code.h"
#include "pipeline/export/web/coded_map.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Codes of both maps fit into 16 bits together.
constexpr int kMaxMeasuredSteps = 49152, kMaxCompletedSteps = 16000;
constexpr std::uintmax_t kMaxJpegBytes = std::uintmax_t{1} << 30;

/// A map in codes of inverse depth.
struct CodedMap {
  Grid<std::uint16_t> codes;
  double near_z = 1, far_z = 2;
  int steps = 1;
};

CodedMap Coded(const DepthImage& depth, double near_z, double far_z, int steps) {
  const InverseDepthCode code(near_z, far_z, steps);
  CodedMap map{Grid<std::uint16_t>(depth.width(), depth.height()), near_z, far_z, steps};
  for (size_t p = 0; p < map.codes.data().size(); ++p) {
    const float z = depth.grid().data()[p];
    if (!DepthImage::IsHole(z)) map.codes.data()[p] = code.Encode(z);
  }
  return map;
}

/// Steps with which 1/z is off by at most so many pixels of disparity.
int StepsFor(double near_z, double far_z, double error_px, double pixel) {
  const double steps = std::ceil((1 / near_z - 1 / far_z) / (2 * error_px * pixel));
  return static_cast<int>(std::clamp(steps, 1.0, static_cast<double>(kMaxMeasuredSteps)));
}

/// The set's own codes where they are not finer than asked for.
CodedMap CodedMeasured(const View& view, const DepthImage& measured, const WebCoding& coding) {
  const double pixel = ThresholdsOf(view, {}).pixel;
  io::DepthRangeOfMap range{view.near_z, view.far_z};
  if (!InverseDepthCode::IsRange(range.near_z, range.far_z)) range = io::RangeOf(measured);
  const int wanted = StepsFor(range.near_z, range.far_z, coding.depth_error_px, pixel);
  const bool own = view.depth_coding == DepthCoding::kZstdInverseDepth && view.depth_steps > 0 &&
                   view.depth_steps <= wanted;
  return Coded(measured, range.near_z, range.far_z, own ? view.depth_steps : wanted);
}

CodedMap CodedCompleted(const View& view, const DepthImage& completed) {
  const int steps = std::clamp(view.completed_steps, 1, kMaxCompletedSteps);
  return Coded(completed, view.completed_near_z, view.completed_far_z, steps);
}

/// Parts of a view's bytes, one after the other.
class Parts {
 public:
  void Add(const char* name, const std::string& stored) {
    json_[name] = stored.size();
    bytes_ += stored;
  }
  void Add(const char* places, const char* values, const CodedMap& map,
           const Grid<std::uint16_t>& known) {
    Add(places, CodedPlaces(map.codes, known));
    Add(values, CodedValues(map.codes));
  }
  const std::string& bytes() const { return bytes_; }
  const Json& json() const { return json_; }

 private:
  std::string bytes_;
  Json json_ = Json::object();
};

/// 1 where a pixel may be used.
Grid<std::uint16_t> UsablePixels(const Mask& mask) {
  Grid<std::uint16_t> usable(mask.width(), mask.height());
  std::transform(mask.data().begin(), mask.data().end(), usable.data().begin(),
                 [](std::uint8_t value) { return value != 0 ? 1 : 0; });
  return usable;
}

std::string JpegOf(const View& view, const fs::path& set, const WebCoding& coding) {
  if (!coding.recodes_jpeg && IsStoredAsJpeg(view)) {
    return ReadFile(set / view.image_file->path, kMaxJpegBytes);
  }
  return io::SmallJpeg(view.image, coding.jpeg_quality);
}

/// Median standard deviation of the measured depth, pixels of disparity; 0: the set has none.
double SigmaPx(const View& view) {
  if (!view.inverse_depth_sigma) return 0;
  std::vector<float> sigmas;
  for (const float sigma : view.inverse_depth_sigma->data()) {
    if (sigma > 0) sigmas.push_back(sigma);
  }
  if (sigmas.empty()) return 0;
  return static_cast<double>(UpperMedian(sigmas)) / ThresholdsOf(view, {}).pixel;
}

Json JsonOf(const CodedMap& map) {
  return {{"near_z", map.near_z}, {"far_z", map.far_z}, {"steps", map.steps}};
}

Json JsonOf(const View& view, double baseline) {
  const PinholeCamera& camera = view.camera;
  const Eigen::Quaterniond& q = view.cam_from_world.rotation;
  const Eigen::Vector3d &t = view.cam_from_world.translation, &gain = view.gain;
  return {{"name", view.name},
          {"width", camera.width_px()},
          {"height", camera.height_px()},
          {"depth_scale", view.depth_scale},
          {"camera", {camera.fx_px(), camera.fy_px(), camera.cx_px(), camera.cy_px()}},
          {"rotation_wxyz", {q.w(), q.x(), q.y(), q.z()}},
          {"translation", {t.x(), t.y(), t.z()}},
          {"baseline", baseline},
          {"gain", {gain.x(), gain.y(), gain.z()}},
          {"sigma_px", SigmaPx(view)}};
}

}  // namespace

bool IsStoredAsJpeg(const View& view) {
  const std::string extension = LowerExtension(view.image_file->path);
  return extension == ".jpg" || extension == ".jpeg";
}

WebView PackView(const View& view, const fs::path& set, const WebCoding& coding) {
  const CodedMap measured = CodedMeasured(view, MeasuredDepth(view), coding);
  const DepthImage completed_depth = CompletedDepth(view);
  Json json = JsonOf(view, DisparityBaseline(view));
  json["depth"] = JsonOf(measured);
  json["completed"] = nullptr;

  Parts parts;
  parts.Add("image", JpegOf(view, set, coding));
  parts.Add("depth_places", "depth", measured, {});
  if (completed_depth.width() > 0) {
    const CodedMap completed = CodedCompleted(view, completed_depth);
    json["completed"] = JsonOf(completed);
    parts.Add("completed_places", "completed", completed, measured.codes);
  }
  if (!view.mask.empty()) parts.Add("mask", CodedPlaces(UsablePixels(view.mask), {}));
  json["parts"] = parts.json();
  json["bytes"] = parts.bytes().size();
  json["crc32"] = crc32(0, reinterpret_cast<const Bytef*>(parts.bytes().data()),
                        static_cast<uInt>(parts.bytes().size()));
  return {parts.bytes(),
          json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)};
}

}  // namespace dtr::pipeline
