// Scene and depth as OpenMVS reads them: its interface archive (version 5) and a .dmap per image.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/colmap/export.h"
#include "dtr/base/durable.h"
#include "dtr/base/file_stream.h"
#include "pipeline/export/detail/coloured_points.h"
#include "pipeline/export/detail/common.h"
#include "pipeline/export/detail/depth_file.h"
#include "pipeline/export/detail/fuse.h"
#include "pipeline/export/export.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::uint32_t kArchiveVersion = 5;
constexpr int kMostNeighbours = 10;
// The confidence of a depth whose standard deviation is this share of it is 1.
constexpr double kShareOfConfidence1 = 0.01;

void PutText(FileStream& stream, const std::string& text) {
  stream.Put(static_cast<std::uint64_t>(text.size()));
  stream.Write(text);
}

void PutMatrix(FileStream& stream, const Eigen::Matrix3d& m) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) stream.Put(m(i, j));
  }
}

void PutVector(FileStream& stream, const Eigen::Vector3d& v) {
  for (const double value : v) stream.Put(value);
}

// OpenMVS has the centre of the first pixel at 0.
Eigen::Matrix3d MatrixOf(const PinholeCamera& camera) {
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  k(0, 0) = camera.fx_px();
  k(1, 1) = camera.fy_px();
  k(0, 2) = camera.cx_px() - 0.5;
  k(1, 2) = camera.cy_px() - 0.5;
  return k;
}

class OpenMvsExport {
 public:
  OpenMvsExport(const ExportRequest& request, const DtrSet& set, fs::path folder)
      : request_(request),
        set_(set),
        folder_(std::move(folder)),
        surfaces_(request.set, set, SurfaceOptions(request)),
        chosen_(surfaces_.WithDepth()),
        image_of_(Views().size(), -1) {
    for (size_t i = 0; i < chosen_.size(); ++i) {
      image_of_[static_cast<size_t>(chosen_[i])] = static_cast<int>(i);
    }
    const std::vector<std::string> names = ImageNames(Views());
    for (const int v : chosen_) names_.push_back("images/" + names[static_cast<size_t>(v)]);
  }

  ExportReport Write(Progress& progress) {
    progress.Stage("depth", static_cast<int>(chosen_.size()));
    const auto neighbours = ViewsThatSeeTheSame(surfaces_, kMostNeighbours);
    for (size_t i = 0; i < chosen_.size(); ++i) {
      progress.ThrowIfInterrupted();
      const View& view = Views()[static_cast<size_t>(chosen_[i])];
      CopyFileAtomically(request_.set / view.image_file->path, InItsFolder(folder_ / names_[i]));
      if (view.mask_file) {
        CopyFileAtomically(request_.set / view.mask_file->path, InItsFolder(folder_ / MaskName(i)));
      }
      WriteDepth(i, neighbours[static_cast<size_t>(chosen_[i])]);
      progress.Update(static_cast<int>(i) + 1);
    }
    ExportReport report{.images = chosen_.size(), .depth_maps = chosen_.size()};
    WriteArchive(progress, report);
    WriteSidecar();
    return report;
  }

 private:
  const std::vector<View>& Views() const { return set_.frames.front().views; }
  const View& ViewOf(size_t image) const { return Views()[static_cast<size_t>(chosen_[image])]; }
  std::string MaskName(size_t image) const {
    return (fs::path("masks") / fs::path(names_[image]).lexically_relative("images"))
               .replace_extension()
               .generic_string() +
           ".mask.png";
  }

  // `neighbours`: views, this one perhaps among them.
  void WriteDepth(size_t image, const std::vector<int>& neighbours) {
    const auto surface = surfaces_.Get(chosen_[image]);
    const View& view = ViewOf(image);
    const DepthPlanes planes = PlanesOf(*surface, DepthKind::kPlaneZ);
    const Grid<float>& depth = planes.depth.grid();
    FileStream stream(folder_ / fmt::format("depth{:04}.dmap", image));
    constexpr std::uint8_t kDepth = 1, kNormal = 2, kConfidence = 4;
    stream.Write("DR");
    stream.Put(static_cast<std::uint8_t>(kDepth | kNormal | kConfidence));
    stream.Put(std::uint8_t{0});
    for (const int size :
         {view.camera.width_px(), view.camera.height_px(), depth.width(), depth.height()}) {
      stream.Put(static_cast<std::uint32_t>(size));
    }
    stream.Put(static_cast<float>(view.near_z));
    stream.Put(static_cast<float>(view.far_z));
    stream.Put(static_cast<std::uint16_t>(names_[image].size()));
    stream.Write(names_[image]);
    std::vector<std::uint32_t> ids = {static_cast<std::uint32_t>(image)};
    for (const int v : neighbours) {
      const int other = image_of_[static_cast<size_t>(v)];
      if (other >= 0 && v != chosen_[image]) ids.push_back(static_cast<std::uint32_t>(other));
    }
    stream.Put(static_cast<std::uint32_t>(ids.size()));
    for (const std::uint32_t id : ids) stream.Put(id);
    PutMatrix(stream, MatrixOf(view.camera));
    PutMatrix(stream, view.cam_from_world.rotation.toRotationMatrix());
    PutVector(stream, view.CenterInWorld());
    for (const float z : depth.data()) stream.Put(z);
    PutNormals(stream, *surface);
    for (int y = 0; y < depth.height(); ++y) {
      for (int x = 0; x < depth.width(); ++x) {
        const double z = depth(x, y), sigma = planes.sigma(x, y);
        stream.Put(static_cast<float>(sigma > 0 ? kShareOfConfidence1 * z / sigma : 0));
      }
    }
    stream.Flush();
  }

  // In the camera frame, to the camera; 0 where there is no depth.
  static void PutNormals(FileStream& stream, const SurfaceView& surface) {
    for (int y = 0; y < surface.inverse_depth.height(); ++y) {
      for (int x = 0; x < surface.inverse_depth.width(); ++x) {
        Eigen::Vector3d normal = Eigen::Vector3d::Zero();
        if (surface.inverse_depth(x, y) > 0) {
          normal = surface.rotation * NormalOf(surface, Eigen::Vector2d(x + 0.5, y + 0.5),
                                               PlaneAt(surface, x, y, kNormalRadius));
        }
        for (const double v : normal) stream.Put(static_cast<float>(v));
      }
    }
  }

  void WriteArchive(Progress& progress, ExportReport& report) {
    FileStream stream(folder_ / "scene.mvs");
    stream.Write("MVSI");
    stream.Put(kArchiveVersion);
    stream.Put(std::uint32_t{0});
    PutPlatform(stream);
    stream.Put(static_cast<std::uint64_t>(chosen_.size()));
    for (size_t i = 0; i < chosen_.size(); ++i) {
      const auto id = static_cast<std::uint32_t>(i);
      PutText(stream, names_[i]);
      PutText(stream, ViewOf(i).mask_file ? MaskName(i) : "");
      // Platform, camera on it, pose, number.
      for (const std::uint32_t number : {0U, id, id, id}) stream.Put(number);
    }
    PutPoints(stream, progress, report);
    for (int list = 0; list < 3; ++list) stream.Put(std::uint64_t{0});  // lines
    for (int i = 0; i < 16; ++i) stream.Put(i % 5 == 0 ? 1.0 : 0.0);    // absolute from relative
    stream.Flush();
  }

  // One platform in the world, on which every image has a camera of its own.
  void PutPlatform(FileStream& stream) const {
    stream.Put(std::uint64_t{1});
    PutText(stream, "dtr");
    stream.Put(static_cast<std::uint64_t>(chosen_.size()));
    for (size_t i = 0; i < chosen_.size(); ++i) {
      const PinholeCamera& camera = ViewOf(i).camera;
      PutText(stream, ViewOf(i).id);
      PutText(stream, "RGB");
      stream.Put(static_cast<std::uint32_t>(camera.width_px()));
      stream.Put(static_cast<std::uint32_t>(camera.height_px()));
      PutMatrix(stream, MatrixOf(camera));
      PutMatrix(stream, Eigen::Matrix3d::Identity());
      PutVector(stream, Eigen::Vector3d::Zero());
    }
    stream.Put(static_cast<std::uint64_t>(chosen_.size()));
    for (size_t i = 0; i < chosen_.size(); ++i) {
      PutMatrix(stream, ViewOf(i).cam_from_world.rotation.toRotationMatrix());
      PutVector(stream, ViewOf(i).CenterInWorld());
    }
  }

  // Points that two images see, with their colours.
  void PutPoints(FileStream& stream, Progress& progress, ExportReport& report) {
    StartPoints start = StartPointsOf(request_.set, set_, progress);
    std::vector<bool> keep(Views().size());
    for (size_t v = 0; v < keep.size(); ++v) keep[v] = image_of_[v] >= 0;
    const SparseScene scene = RestrictToViews(start.scene, keep);
    std::vector<std::vector<int>> images(scene.points.size());
    for (const SparseObservation& seen : scene.observations) {
      images[static_cast<size_t>(seen.point)].push_back(image_of_[static_cast<size_t>(seen.view)]);
    }
    DtrSet near = set_;
    near.world_origin.setZero();
    const calib::SfmModel model = colmap::ModelFromViews(
        near, scene, [&](const View& view) { return ImageOf(request_.set, view); });
    stream.Put(static_cast<std::uint64_t>(scene.points.size()));
    for (size_t p = 0; p < scene.points.size(); ++p) {
      for (const double v : scene.points[p].p_in_world) stream.Put(static_cast<float>(v));
      stream.Put(static_cast<std::uint64_t>(images[p].size()));
      for (const int image : images[p]) {
        stream.Put(static_cast<std::uint32_t>(image));
        stream.Put(0.0F);  // its confidence is not known
      }
    }
    stream.Put(std::uint64_t{0});  // normals
    stream.Put(static_cast<std::uint64_t>(scene.points.size()));
    for (const auto& [id, point] : model.points) {
      for (int c = 2; c >= 0; --c) stream.Put(point.rgb[static_cast<size_t>(c)]);
    }
    report.points = scene.points.size();
    report.points_from_depth = start.from_depth;
  }

  void WriteSidecar() const {
    Json json = SetFacts(set_);
    json["pixels"] = "OpenMVS' convention: the centre of the first pixel is (0, 0)";
    json["confidence"] =
        "1 where the standard deviation of depth is 1 % of it, inversely proportional to it; 0: "
        "not known, or completed";
    json["images"] = Json::array();
    for (size_t i = 0; i < chosen_.size(); ++i) {
      json["images"].push_back({{"number", i}, {"photo", ViewOf(i).name}, {"image", names_[i]}});
    }
    WriteJson(folder_ / "dtr.json", json);
  }

  const ExportRequest& request_;
  const DtrSet& set_;
  fs::path folder_;
  SurfaceViews surfaces_;
  std::vector<int> chosen_;    // the view of each image
  std::vector<int> image_of_;  // of each view; -1: none
  std::vector<std::string> names_;
};

}  // namespace

ExportReport ExportOpenmvs(const ExportRequest& request, Progress& progress) {
  return ExportFolder(request, "openmvs", progress, [&](const DtrSet& set, const fs::path& folder) {
    return OpenMvsExport(request, set, folder).Write(progress);
  });
}

}  // namespace dtr::pipeline
