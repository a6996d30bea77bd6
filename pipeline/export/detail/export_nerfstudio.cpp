// transforms.json with depth, masks and points.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "dtr/base/durable.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "pipeline/export/detail/coloured_points.h"
#include "pipeline/export/detail/common.h"
#include "pipeline/export/detail/depth_file.h"
#include "pipeline/export/detail/surface_views.h"
#include "pipeline/export/export.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// What readers take a unit for that does not say; finer than this share of the middle depth it is
// good enough.
constexpr double kUsualUnit = 0.001, kFineEnough = 0.001, kMost16Bits = 65535;

// OpenGL axes, camera to world.
Json TransformMatrix(const Pose& cam_from_world) {
  const Pose world_from_cam = cam_from_world.Inverse();
  const Eigen::Matrix3d r = world_from_cam.rotation.toRotationMatrix();
  const Eigen::Vector3d& t = world_from_cam.translation;
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) rows.push_back({r(i, 0), -r(i, 1), -r(i, 2), t[i]});
  rows.push_back({0, 0, 0, 1});
  return rows;
}

Json IntrinsicsJson(const PinholeCamera& camera) {
  return {{"fl_x", camera.fx_px()}, {"fl_y", camera.fy_px()}, {"cx", camera.cx_px()},
          {"cy", camera.cy_px()},   {"w", camera.width_px()}, {"h", camera.height_px()}};
}

class NerfstudioExport {
 public:
  NerfstudioExport(const ExportRequest& request, const DtrSet& set, const fs::path& folder)
      : request_(request),
        set_(set),
        folder_(folder),
        images_(ImageNames(Views())),
        pngs_(FileNames(Views(), ".png")),
        surfaces_(request.set, set, SurfaceOptions(request)) {}

  ExportReport Write(Progress& progress) {
    const std::vector<int> with_depth = surfaces_.WithDepth();
    progress.Stage("depth", static_cast<int>(2 * with_depth.size()));
    ChooseUnit(with_depth, progress);
    WriteDepth(with_depth, progress);
    WriteImagesAndMasks();
    const StartPoints start = StartPointsOf(request_.set, set_, progress);
    ExportReport report{.images = Views().size(),
                        .depth_maps = with_depth.size(),
                        .points_from_depth = start.from_depth};
    report.points = WritePointsPly(folder_ / "sparse_pc.ply", request_.set, set_, start.scene);
    WriteTransforms();
    return report;
  }

 private:
  const std::vector<View>& Views() const { return set_.frames.front().views; }

  void ChooseUnit(const std::vector<int>& with_depth, Progress& progress) {
    double largest = 0;
    std::vector<float> some;
    for (const int v : with_depth) {
      progress.ThrowIfInterrupted();
      for (const float w : surfaces_.Get(v)->inverse_depth.data()) {
        if (!(w > 0)) continue;
        largest = std::max(largest, 1.0 / w);
        if (some.size() < 1'000'000) some.push_back(1 / w);
      }
      progress.Update(++done_);
    }
    double middle = 0;
    if (!some.empty()) {
      const auto place = some.begin() + static_cast<std::ptrdiff_t>(some.size() / 2);
      std::nth_element(some.begin(), place, some.end());
      middle = *place;
    }
    const bool usual = largest <= kMost16Bits * kUsualUnit && kUsualUnit <= kFineEnough * middle;
    unit_ = usual ? kUsualUnit : Png16Unit(LengthUnit::kUnknown, largest);
    if (!usual) {
      progress.Note("depth is in steps of " + std::to_string(unit_) +
                    " scene units: give nerfstudio --depth-unit-scale-factor " +
                    std::to_string(unit_));
    }
  }

  // Readers want depth for all images or none: of held-out ones it is empty.
  void WriteDepth(const std::vector<int>& with_depth, Progress& progress) {
    for (size_t v = 0; v < Views().size(); ++v) {
      const View& view = Views()[v];
      if (view.depth_file) continue;
      io::WritePng16(InItsFolder(folder_ / "depth" / pngs_[v]),
                     Grid<std::uint16_t>(view.camera.width_px(), view.camera.height_px()));
    }
    for (const int v : with_depth) {
      progress.ThrowIfInterrupted();
      const DepthPlanes planes = PlanesOf(*surfaces_.Get(v), DepthKind::kPlaneZ);
      const int scale = Views()[static_cast<size_t>(v)].depth_scale;
      io::WritePng16(InItsFolder(folder_ / "depth" / pngs_[static_cast<size_t>(v)]),
                     Png16Codes(OnImageGrid(planes.depth, scale), unit_));
      progress.Update(++done_);
    }
  }

  bool HasMasks() const {
    return std::any_of(Views().begin(), Views().end(),
                       [](const View& view) { return view.mask_file.has_value(); });
  }

  void WriteImagesAndMasks() const {
    for (size_t v = 0; v < Views().size(); ++v) {
      const View& view = Views()[v];
      CopyFileAtomically(request_.set / view.image_file->path,
                         InItsFolder(folder_ / "images" / images_[v]));
      if (!HasMasks()) continue;
      const fs::path mask = InItsFolder(folder_ / "masks" / pngs_[v]);
      if (view.mask_file) {
        CopyFileAtomically(request_.set / view.mask_file->path, mask);
      } else {
        io::WriteMask(mask, Mask(view.camera.width_px(), view.camera.height_px(), 1, 255));
      }
    }
  }

  void WriteTransforms() const {
    Json json{{"camera_model", "OPENCV"}, {"k1", 0}, {"k2", 0}, {"p1", 0}, {"p2", 0}};
    const PinholeCamera& first = Views().front().camera;
    const bool shared = std::all_of(Views().begin(), Views().end(),
                                    [&](const View& view) { return view.camera == first; });
    if (shared) json.update(IntrinsicsJson(first));
    json["depth_unit_scale_factor"] = unit_;
    json["ply_file_path"] = "sparse_pc.ply";
    const Eigen::Vector3d& o = set_.world_origin;
    json["applied_transform"] = {{1, 0, 0, -o.x()}, {0, 1, 0, -o.y()}, {0, 0, 1, -o.z()}};
    json["dtr"] = SetFacts(set_);
    Json train = Json::array(), held_out = Json::array();
    json["frames"] = Json::array();
    for (size_t v = 0; v < Views().size(); ++v) {
      const View& view = Views()[v];
      Json frame{{"file_path", "images/" + images_[v]}};
      if (!shared) frame.update(IntrinsicsJson(view.camera));
      frame["depth_file_path"] = "depth/" + pngs_[v];
      if (HasMasks()) frame["mask_path"] = "masks/" + pngs_[v];
      frame["transform_matrix"] = TransformMatrix(view.cam_from_world);
      (view.role == ViewRole::kHeldOut ? held_out : train).push_back(frame["file_path"]);
      json["frames"].push_back(std::move(frame));
    }
    if (!held_out.empty()) {
      json["train_filenames"] = train;
      json["val_filenames"] = held_out;
      json["test_filenames"] = held_out;
    }
    WriteJson(folder_ / "transforms.json", json);
  }

  const ExportRequest& request_;
  const DtrSet& set_;
  fs::path folder_;
  std::vector<std::string> images_, pngs_;
  SurfaceViews surfaces_;
  double unit_ = kUsualUnit;
  int done_ = 0;
};

}  // namespace

ExportReport ExportNerfstudio(const ExportRequest& request, Progress& progress) {
  return ExportFolder(request, "nerfstudio", progress,
                      [&](const DtrSet& set, const fs::path& folder) {
                        return NerfstudioExport(request, set, folder).Write(progress);
                      });
}

}  // namespace dtr::pipeline
