#include "pipeline/detail/web/web_view.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/lower_case.h"
#include "dtr/base/order_statistics.h"
#include "dtr/io/code_residuals.h"
#include "dtr/io/depth_io.h"
#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/scene.h"
#include "dtr/report/encode.h"
#include "dtr/types/inverse_depth_code.h"
#include "pipeline/detail/web/depth_coder.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Codes of both maps fit into 16 bits together.
constexpr int kMaxMeasuredSteps = 49152, kMaxCompletedSteps = 16000;
constexpr std::uintmax_t kMaxJpegBytes = std::uintmax_t{1} << 30;

/// A map in codes of inverse depth, and its depth as it is read back.
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
  const bool in_steps = view.depth_coding == DepthCoding::kZstdInverseDepth &&
                        view.depth_steps <= kMaxMeasuredSteps && view.depth_steps > 0;
  const int wanted = StepsFor(range.near_z, range.far_z, coding.depth_error_px, pixel);
  const bool own = in_steps && view.depth_steps <= wanted;
  return Coded(measured, range.near_z, range.far_z, own ? view.depth_steps : wanted);
}

CodedMap CodedCompleted(const View& view, const DepthImage& completed) {
  const int steps = std::clamp(view.completed_steps, 1, kMaxCompletedSteps);
  return Coded(completed, view.completed_near_z, view.completed_far_z, steps);
}

void PutDepth(const CodedMap& map, DepthImage& depth) {
  const InverseDepthCode code(map.near_z, map.far_z, map.steps);
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      if (map.codes(x, y) != 0) depth(x, y) = code.Decode(map.codes(x, y));
    }
  }
}

/// RFC 1950, as browsers read it.
std::string Deflated(const std::string& bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string out(size, '\0');
  const auto* from = reinterpret_cast<const Bytef*>(bytes.data());
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &size, from, static_cast<uLong>(bytes.size()),
                Z_BEST_COMPRESSION) != Z_OK) {
    throw std::bad_alloc();
  }
  out.resize(size);
  return out;
}

/// Parts of a view's bytes, one after the other, each with its size before compression.
class Parts {
 public:
  void Add(const char* name, const std::string& stored, size_t size) {
    json_[name] = {stored.size(), size};
    bytes_ += stored;
  }
  void AddDeflated(const char* name, const std::string& plain) {
    Add(name, Deflated(plain), plain.size());
  }
  const std::string& bytes() const { return bytes_; }
  const Json& json() const { return json_; }

 private:
  std::string bytes_;
  Json json_ = Json::object();
};

std::string PlainBytes(const Mask& mask) {
  const size_t row_bytes = io::ValidityRowBytes(mask.width());
  std::string bytes(row_bytes * static_cast<size_t>(mask.height()), '\0');
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      char& byte = bytes[row_bytes * static_cast<size_t>(y) + static_cast<size_t>(x / 8)];
      if (mask(x, y) != 0) byte = static_cast<char>(byte | 1 << (x % 8));
    }
  }
  return bytes;
}

/// docs/FORMAT.md section 7: per root square the number of rectangles, then they.
std::string PlainBytes(const BlockCover& cover) {
  constexpr int kRootSide = BlockCover::kRootSide;
  const int across = (cover.columns + kRootSide - 1) / kRootSide;
  const int down = (cover.rows + kRootSide - 1) / kRootSide;
  std::vector<std::string> roots(static_cast<size_t>(across) * static_cast<size_t>(down));
  const auto append = [](std::string& out, int value) {
    out += static_cast<char>(value & 255);
    out += static_cast<char>(value >> 8);
  };
  for (const BlockCover::Rectangle& r : cover.rectangles) {
    std::string& root = roots[static_cast<size_t>(r.y / kRootSide) * static_cast<size_t>(across) +
                              static_cast<size_t>(r.x / kRootSide)];
    append(root,
           r.x % kRootSide + 16 * (r.y % kRootSide) + 256 * (r.width - 1) + 4096 * (r.height - 1));
  }
  std::string bytes;
  for (const std::string& root : roots) {
    append(bytes, static_cast<int>(root.size() / 2));
    bytes += root;
  }
  return bytes;
}

/// The set's own cover where depth is as the set has it; else one for what the page holds.
BlockCover CoverOf(const View& set_view, const View& view) {
  const RenderOptions options;
  const MeshRule rule = MeshRuleOf(view, options);
  if (set_view.mesh && set_view.depth == view.depth && set_view.mesh->resolution == 1 &&
      MeshRule{{set_view.mesh->depth_break, set_view.mesh->absolute_depth_break},
               set_view.mesh->tolerance} == rule) {
    return set_view.mesh->cover;
  }
  return MakeStoredMesh(view, options, 1).cover;
}

std::string JpegOf(const View& view, const fs::path& set, const WebCoding& coding) {
  if (!coding.recodes_jpeg && IsStoredAsJpeg(view)) {
    return ReadFile(set / view.image_file->path, kMaxJpegBytes);
  }
  return report::EncodeJpeg(view.image, coding.jpeg_quality);
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
  const bool completes = completed_depth.width() > 0;
  View coded = view;
  PutDepth(measured, coded.depth);
  Json json = JsonOf(view, DisparityBaseline(view));
  json["depth"] = JsonOf(measured);
  json["completed"] = nullptr;

  Parts parts;
  parts.Add("image", JpegOf(view, set, coding), 0);
  CodedMap completed;
  if (completes) {
    completed = CodedCompleted(view, completed_depth);
    PutDepth(completed, coded.depth);
    json["completed"] = JsonOf(completed);
  }
  parts.Add("depth", EncodeDepthCodes(measured.codes, completed.codes), 0);
  if (!view.mask.empty()) parts.AddDeflated("mask", PlainBytes(view.mask));
  parts.AddDeflated("mesh", PlainBytes(CoverOf(view, coded)));
  json["parts"] = parts.json();
  json["bytes"] = parts.bytes().size();
  json["crc32"] = crc32(0, reinterpret_cast<const Bytef*>(parts.bytes().data()),
                        static_cast<uInt>(parts.bytes().size()));
  return {parts.bytes(),
          json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)};
}

}  // namespace dtr::pipeline
