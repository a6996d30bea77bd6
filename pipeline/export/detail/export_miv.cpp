// Cameras, texture and depth as the programs of MPEG immersive video read them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "dtr/base/file_stream.h"
#include "dtr/base/files.h"
#include "pipeline/export/detail/coloured_points.h"
#include "pipeline/export/detail/common.h"
#include "pipeline/export/detail/depth_file.h"
#include "pipeline/export/export.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kDepthSteps = 65535;
constexpr double kFramesPerSecond = 30;  // of a single frame: what the programs want to read

// Axes of ours, x right, y down, z forward, in those of the format: x forward, y left, z up. It is
// applied to the world and to cameras.
Eigen::Matrix3d FormatAxes() {
  Eigen::Matrix3d m;
  m << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return m;
}

Json Numbers(const Eigen::VectorXd& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(value);
  return list;
}

// Yaw, pitch and roll in degrees: r = Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Vector3d AnglesOf(const Eigen::Matrix3d& r) {
  constexpr double kDegrees = 180 / std::numbers::pi, kUpright = 1 - 1e-12;
  const double sine = std::clamp(-r(2, 0), -1.0, 1.0);
  // Looking straight up or down, yaw and roll turn about one axis: it is all yaw.
  if (std::abs(sine) > kUpright) {
    return Eigen::Vector3d(std::atan2(-r(0, 1), r(1, 1)), std::asin(sine), 0) * kDegrees;
  }
  return Eigen::Vector3d(std::atan2(r(1, 0), r(0, 0)), std::asin(sine),
                         std::atan2(r(2, 1), r(2, 2))) *
         kDegrees;
}

// Frames of 4:2:0 have even sizes: a last odd column or row is left out.
int Even(int size) { return size - size % 2; }

std::string FileName(const View& view, const char* what, const char* format) {
  return fmt::format("{}_{}_{}x{}_{}.yuv", view.id, what, Even(view.camera.width_px()),
                     Even(view.camera.height_px()), format);
}
std::string TextureName(const View& view) { return FileName(view, "texture", "yuv420p10le"); }
std::string DepthName(const View& view) { return FileName(view, "depth", "yuv420p16le"); }

Json CameraJson(const View& view, const std::string& name) {
  const Eigen::Matrix3d axes = FormatAxes();
  const Eigen::Matrix3d world_from_cam =
      view.cam_from_world.rotation.conjugate().toRotationMatrix();
  const PinholeCamera& camera = view.camera;
  return {{"Name", name},
          {"Position", Numbers(axes * view.CenterInWorld())},
          {"Rotation", Numbers(AnglesOf(axes * world_from_cam * axes.transpose()))},
          {"Depthmap", 1},
          {"Background", 0},
          {"HasInvalidDepth", true},
          {"Depth_range", {view.near_z, view.far_z}},
          {"Resolution", {Even(camera.width_px()), Even(camera.height_px())}},
          {"Projection", "Perspective"},
          {"Focal", {camera.fx_px(), camera.fy_px()}},
          {"Principle_point", {camera.cx_px(), camera.cy_px()}},
          {"BitDepthColor", 10},
          {"BitDepthDepth", 16},
          {"ColorSpace", "YUV420"},
          {"DepthColorSpace", "YUV420"}};
}

// BT.709 in the limited range of 10 bits: brightness, then the means of both colour differences
// over two by two pixels.
void WriteTexture(const fs::path& file, const ImageRgb8& image) {
  constexpr double kRed = 0.2126, kGreen = 0.7152, kBlue = 0.0722;
  constexpr double kBlack = 64, kLumaRange = 876, kGrey = 512, kChromaRange = 896;
  const int width = Even(image.width()), height = Even(image.height());
  const auto luma = [&](int x, int y) {
    return (kRed * image(x, y, 0) + kGreen * image(x, y, 1) + kBlue * image(x, y, 2)) / 255;
  };
  const auto put = [](FileStream& stream, double value) {
    stream.Put(static_cast<std::uint16_t>(std::lround(value)));
  };
  FileStream stream(file);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) put(stream, kBlack + kLumaRange * luma(x, y));
  }
  for (const auto& [channel, share] : {std::pair{2, kBlue}, std::pair{0, kRed}}) {
    for (int y = 0; y < height; y += 2) {
      for (int x = 0; x < width; x += 2) {
        double sum = 0;
        for (int k = 0; k < 4; ++k) {
          const int i = x + k % 2, j = y + k / 2;
          sum += (image(i, j, channel) / 255.0 - luma(i, j)) / (2 * (1 - share));
        }
        put(stream, kGrey + kChromaRange * sum / 4);
      }
    }
  }
  stream.Flush();
}

// Inverse depth in steps from far (0) to near; 0 says that there is none, so that the farthest has
// code 1. Colour differences are grey.
void WriteDepth(const fs::path& file, const View& view, const DepthImage& depth) {
  constexpr std::uint16_t kGrey = 32768;
  const double far = 1 / view.far_z, range = 1 / view.near_z - far;
  const int width = Even(depth.width()), height = Even(depth.height());
  FileStream stream(file);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double z = depth(x, y);
      const double code =
          z > 0 ? std::clamp(std::round((1 / z - far) / range * kDepthSteps), 1.0, kDepthSteps) : 0;
      stream.Put(static_cast<std::uint16_t>(code));
    }
  }
  for (int i = 0; i < width / 2 * (height / 2) * 2; ++i) stream.Put(kGrey);
  stream.Flush();
}

Json SequenceJson(const DtrSet& set, const std::vector<const View*>& views,
                  const std::string& name) {
  Json json{{"Version", "4.0"},
            {"Content_name", name},
            {"BoundingBox_center", Numbers(FormatAxes() * set.scene_center)},
            {"Fps", kFramesPerSecond},
            {"Frames_number", 1},
            {"Axial_system", "OMAF"},
            {"lengthsInMeters", set.unit == LengthUnit::kMetre},
            {"sourceCameraNames", Json::array()},
            {"dtr", SetFacts(set)},
            {"cameras", Json::array()}};
  for (const View* view : views) {
    json["sourceCameraNames"].push_back(view->id);
    Json camera = CameraJson(*view, view->id);
    camera["NameColor"] = TextureName(*view);
    camera["NameDepth"] = DepthName(*view);
    camera["photo"] = view->name;
    json["cameras"].push_back(std::move(camera));
  }
  // What the programs show where they are not asked for another place.
  json["cameras"].push_back(CameraJson(*views.front(), "viewport"));
  return json;
}

}  // namespace

ExportReport ExportMiv(const ExportRequest& request, Progress& progress) {
  return ExportFolder(request, "miv", progress, [&](const DtrSet& set, const fs::path& folder) {
    SurfaceViews surfaces(request.set, set, SurfaceOptions(request));
    std::vector<const View*> views;
    bool odd = false;
    ForEachDepth(surfaces, progress, [&](size_t, const View& view, const SurfaceView& surface) {
      const PinholeCamera& camera = view.camera;
      odd = odd || camera.width_px() % 2 != 0 || camera.height_px() % 2 != 0;
      WriteTexture(folder / TextureName(view), ImageOf(request.set, view));
      const DepthPlanes planes = PlanesOf(surface, DepthKind::kPlaneZ);
      WriteDepth(folder / DepthName(view), view, OnImageGrid(planes.depth, view.depth_scale));
      views.push_back(&view);
    });
    if (odd) {
      progress.Note("frames of 4:2:0 have even sizes: the last odd column or row is left out");
    }
    const std::string name = WithoutTrailingSlash(request.output).stem().string();
    WriteJson(folder / "sequence.json", SequenceJson(set, views, name));
    return ExportReport{.images = views.size(), .depth_maps = views.size()};
  });
}

}  // namespace dtr::pipeline
