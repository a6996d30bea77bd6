// Depth maps as files of their own, one per photo.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/work_folder.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/image_io.h"
#include "pipeline/core/photos/lens_of_photo.h"
#include "pipeline/export/detail/common.h"
#include "pipeline/export/detail/depth_file.h"
#include "pipeline/export/detail/photo_depth.h"
#include "pipeline/export/detail/surface_views.h"
#include "pipeline/export/export.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// What one view's files are called, relative to the folder of their kind.
struct DepthNames {
  std::vector<std::string> images, depth, sigma, valid;
};

DepthNames DepthNamesOf(const DtrSet& set, DepthFileFormat format) {
  const std::vector<View>& views = set.frames.front().views;
  return {ImageNames(views), FileNames(views, ExtensionOf(format)),
          FileNames(views, ExtensionOf(FloatFormatOf(format))), FileNames(views, ".png")};
}

Json ConventionsOf(const ExportRequest& request, double png16_unit) {
  Json json;
  const bool png = request.depth_format == DepthFileFormat::kPng16;
  json["grid"] = request.depth_grid == DepthGrid::kPhoto
                     ? "original photo, with its distortion, upright"
                     : "undistorted image, 1 / depth_scale of it per axis";
  json["depth_kind"] = request.depth_kind == DepthKind::kPlaneZ ? "z" : "ray";
  json["depth_meaning"] = request.depth_kind == DepthKind::kPlaneZ
                              ? "z of the point in the camera frame"
                              : "distance of the point from the camera centre";
  json["scene_units_per_step"] = png ? png16_unit : 1.0;
  json["hole"] = 0;
  json["sigma"] = "standard deviation of the depth in scene units (float); 0: not known";
  json["valid"] = {
      {"measured", DepthPlanes::kMeasured}, {"completed", DepthPlanes::kCompleted}, {"hole", 0}};
  json["pixels"] =
      "the centre of pixel (i, j) is (i + 0.5, j + 0.5); for OpenCV subtract 0.5 from cx and cy";
  json["axes"] = "x right, y down, z forward; p_cam = cam_from_world (p_world - world_origin)";
  return json;
}

Json CameraJson(const View& view) {
  return {{"width", view.camera.width_px()}, {"height", view.camera.height_px()},
          {"fx", view.camera.fx_px()},       {"fy", view.camera.fy_px()},
          {"cx", view.camera.cx_px()},       {"cy", view.camera.cy_px()}};
}

double Largest(const DepthImage& depth) {
  float largest = 0;
  for (const float value : depth.grid().data()) {
    if (!DepthImage::IsHole(value)) largest = std::max(largest, value);
  }
  return largest;
}

class DepthExport {
 public:
  DepthExport(const ExportRequest& request, const DtrSet& set, const fs::path& folder)
      : request_(request),
        set_(set),
        folder_(folder),
        names_(DepthNamesOf(set, request.depth_format)),
        surfaces_(request.set, set, SurfaceOptions(request)) {}

  ExportReport Write(Progress& progress) {
    if (request_.depth_grid == DepthGrid::kPhoto) FindLenses();
    const std::vector<int> with_depth = surfaces_.WithDepth();
    const bool png = request_.depth_format == DepthFileFormat::kPng16;
    progress.Stage("depth", static_cast<int>(with_depth.size()) * (png ? 2 : 1));
    int done = 0;
    if (png) {
      double largest = 0;
      for (const int v : with_depth) {
        progress.ThrowIfInterrupted();
        largest = std::max(largest, Largest(PlanesFor(v).depth));
        progress.Update(++done);
      }
      unit_ = Png16Unit(set_.unit, largest);
    }
    for (const int v : with_depth) {
      progress.ThrowIfInterrupted();
      WriteView(static_cast<size_t>(v), PlanesFor(v));
      progress.Update(++done);
    }
    if (request_.depth_grid == DepthGrid::kSet) CopyImages();
    WriteCameras();
    return {.images = set_.frames.front().views.size(), .depth_maps = with_depth.size()};
  }

 private:
  const std::vector<View>& views() const { return set_.frames.front().views; }

  void FindLenses() {
    for (const View& view : views()) {
      lenses_.push_back(LensOfPhoto(set_, view.name));
      if (lenses_.back() || !view.depth_file) continue;
      throw Error(
          fmt::format("{}: the set does not know the lens of this photo, which depth on "
                      "the photo's own grid needs; build the set again with dtr build, or "
                      "choose the set's grid",
                      view.name));
    }
  }

  DepthPlanes PlanesFor(int v) {
    const auto surface = surfaces_.Get(v);
    if (request_.depth_grid == DepthGrid::kSet) return PlanesOf(*surface, request_.depth_kind);
    return PlanesOnPhoto(*surface, *lenses_[static_cast<size_t>(v)], request_.depth_kind);
  }

  void WriteView(size_t v, const DepthPlanes& planes) const {
    const fs::path depth = InItsFolder(folder_ / "depth" / names_.depth[v]);
    if (request_.depth_format == DepthFileFormat::kPng16) {
      io::WritePng16(depth, Png16Codes(planes.depth, unit_));
    } else {
      WriteFloats(depth, planes.depth.grid(), request_.depth_format);
    }
    WriteFloats(InItsFolder(folder_ / "sigma" / names_.sigma[v]), planes.sigma,
                FloatFormatOf(request_.depth_format));
    io::WriteMask(InItsFolder(folder_ / "valid" / names_.valid[v]), planes.validity);
  }

  void CopyImages() const {
    for (size_t v = 0; v < views().size(); ++v) {
      CopyFileAtomically(request_.set / views()[v].image_file->path,
                         InItsFolder(folder_ / "images" / names_.images[v]));
    }
  }

  Json ViewJson(size_t v) const {
    const View& view = views()[v];
    const bool on_photo = request_.depth_grid == DepthGrid::kPhoto;
    Json json{{"name", on_photo ? view.name : names_.images[v]}, {"photo", view.name}};
    if (on_photo && lenses_[v]) json["lens"] = LensJson(*lenses_[v]);
    if (!on_photo) {
      json.update(CameraJson(view));
      json["depth_scale"] = view.depth_scale;
    }
    json["cam_from_world"] = MatrixJson(view.cam_from_world);
    json["role"] = NameOf(view.role);
    if (!view.depth_file) return json;
    json["depth"] = names_.depth[v];
    json["depth_kind"] = request_.depth_kind == DepthKind::kPlaneZ ? "z" : "ray";
    json["sigma"] = names_.sigma[v];
    json["valid"] = names_.valid[v];
    return json;
  }

  void WriteCameras() const {
    Json json = SetFacts(set_);
    json["conventions"] = ConventionsOf(request_, unit_);
    json["views"] = Json::array();
    for (size_t v = 0; v < views().size(); ++v) json["views"].push_back(ViewJson(v));
    WriteJson(folder_ / "cameras.json", json);
  }

  const ExportRequest& request_;
  const DtrSet& set_;
  fs::path folder_;
  DepthNames names_;
  SurfaceViews surfaces_;
  std::vector<std::optional<calib::LensCamera>> lenses_;
  double unit_ = 1;
};

}  // namespace

ExportReport ExportDepth(const ExportRequest& request, Progress& progress) {
  const DtrSet set = SetWithDepth(request, "depth", progress);
  const fs::path output = WithoutTrailingSlash(request.output);
  WorkFolder work(WorkFolder::Of(output), "export");
  const ExportReport report = DepthExport(request, set, work.path()).Write(progress);
  MarkExport(set, "depth", work.path());
  work.Become(output);
  return report;
}

}  // namespace dtr::pipeline
