#include "datasets/make_dynamic.h"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "datasets/layout.h"
#include "datasets/render_truth.h"
#include "datasets/scene.h"
#include "datasets/write_truth.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/random.h"
#include "dtr/base/work_folder.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/image_io.h"
#include "dtr/io/video.h"

namespace dtr::datasets {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// The file format has standard deviations; those of exact cameras are next to nothing.
constexpr double kExactSigma = 1e-9;

std::string Numbered(const char* format, int i) {
  char name[32];
  std::snprintf(name, sizeof name, format, i);
  return name;
}

std::string CameraName(int i) { return Numbered("cam%02d", i); }
std::string StepName(int step) { return Numbered("%04d", step); }

Json Diagonal(int size, double value) {
  Json rows = Json::array();
  for (int i = 0; i < size; ++i) {
    std::vector<double> row(static_cast<size_t>(size), 0.0);
    row[static_cast<size_t>(i)] = value;
    rows.push_back(row);
  }
  return rows;
}

Json RowsOf(const Pose& pose) {
  const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) {
    rows.push_back({rotation(i, 0), rotation(i, 1), rotation(i, 2), pose.translation[i]});
  }
  return rows;
}

/// Poses of all cameras from the first camera's frame.
std::vector<Pose> InRig(const std::vector<Pose>& cams_from_scene, double scale) {
  std::vector<Pose> poses;
  const Pose first = WrittenPose(cams_from_scene.front(), scale, Eigen::Vector3d::Zero());
  for (const Pose& pose : cams_from_scene) {
    poses.push_back(WrittenPose(pose, scale, Eigen::Vector3d::Zero()) * first.Inverse());
  }
  poses.front() = Pose();
  return poses;
}

std::string RigText(const PinholeCamera& camera, const std::vector<Pose>& cams_from_rig) {
  Json json{{"format", "dtr-calibration"},
            {"version", 1},
            {"board", "chessboard:9x6:25mm"},
            {"lenses_given", true}};
  json["cameras"] = Json::array();
  for (size_t i = 0; i < cams_from_rig.size(); ++i) {
    Json item{{"name", CameraName(static_cast<int>(i))},
              {"model", "pinhole"},
              {"width_px", camera.width_px()},
              {"height_px", camera.height_px()},
              {"params",
               {{"fx_px", camera.fx_px()},
                {"fy_px", camera.fy_px()},
                {"cx_px", camera.cx_px()},
                {"cy_px", camera.cy_px()}}},
              {"covariance", Diagonal(4, 0)},
              {"rms_px", 0.0},
              {"sigma_px", kExactSigma}};
    if (i > 0) {
      item["cam_from_rig"] = RowsOf(cams_from_rig[i]);
      item["place_covariance"] = Diagonal(6, kExactSigma * kExactSigma);
    }
    json["cameras"].push_back(std::move(item));
  }
  for (const char* none : {"models", "left_out", "views"}) json[none] = Json::array();
  return json.dump(1) + "\n";
}

std::string TimestampsText(const DatasetSpec& spec) {
  std::string text = "sync_index,cam_id,frame_index\n";
  for (int step = 0; step < spec.steps; ++step) {
    for (int i = 0; i < spec.views; ++i) {
      text += std::to_string(step) + "," + std::to_string(i) + "," + std::to_string(step) + "\n";
    }
  }
  return text;
}

std::string StepsSourceText(const DatasetSpec& spec) {
  return "# " + spec.scene + ", " + std::to_string(spec.views) + " cameras, " +
         std::to_string(spec.steps) +
         " time steps, synthetic\n"
         "Made by `dtr dataset make` (ray cast, analytic surfaces, procedural texture: no "
         "downloaded asset); the recipe is dataset.json.\n" +
         (spec.videos
              ? "- `videos/`: one per camera, without loss; `timestamps.csv`: equal clocks.\n"
              : "- `photos/camNN/TTTT.png`: camera and time step.\n") +
         "- `rig.json`: exact cameras in the form of `dtr calibrate rig`. No board was seen: the "
         "one "
         "it names has no meaning.\n"
         "- `truth/TTTT/`: cameras.json, depth (plane z at pixel centres, float32, 0 = nothing "
         "hit), and masks: `_visible` seen by at least 2 other views, `_texture` standard "
         "deviation of at least 4 levels in 9x9. The world is the first camera's frame.\n";
}

/// The photos of all cameras at one time step, and its truth.
std::vector<ImageRgb8> WriteStep(const DatasetSpec& spec, int step, const std::vector<Pose>& poses,
                                 const io::CameraList& list, const fs::path& folder) {
  const double time_s = spec.time_s + static_cast<double>(step) / spec.steps_per_second;
  const Scene scene = MakeScene(spec.scene, spec.seed, time_s);
  const PinholeCamera camera = MakeCamera(spec.width_px, spec.height_px, spec.focal_35mm);
  const fs::path truth = folder / "truth" / StepName(step);
  fs::create_directories(truth / "depth");
  fs::create_directories(truth / "masks");
  io::WriteCamerasJson(truth / "cameras.json", list);
  std::vector<ImageRgb8> photos;
  for (int i = 0; i < spec.views; ++i) {
    const PhotoOptions options = PhotoOptionsOf(
        spec, i,
        HashOf(spec.seed, static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(step)));
    const Grid<float> light = RenderLight(scene, camera, poses[static_cast<size_t>(i)], options);
    photos.push_back(Develop(light, options));
    WriteViewTruth(spec, scene, poses, i, light, options, truth, CameraName(i));
  }
  return photos;
}

/// What the cameras took, as photos or as videos.
class Recording {
 public:
  Recording(const DatasetSpec& spec, const fs::path& folder) : folder_(folder), views_(spec.views) {
    if (!spec.videos) {
      for (int i = 0; i < views_; ++i) fs::create_directories(folder / "photos" / CameraName(i));
      return;
    }
    fs::create_directories(folder / "videos");
    WriteFileAtomically(folder / "videos" / "timestamps.csv", TimestampsText(spec));
    for (int i = 0; i < views_; ++i) {
      videos_.push_back(
          std::make_unique<io::VideoWriter>(folder / "videos" / (CameraName(i) + ".mkv"),
                                            spec.steps_per_second, io::VideoCoding::kLossless));
    }
  }

  void Add(int step, const std::vector<ImageRgb8>& photos) {
    for (int i = 0; i < views_; ++i) {
      const ImageRgb8& photo = photos[static_cast<size_t>(i)];
      if (videos_.empty()) {
        io::WriteImage(folder_ / "photos" / CameraName(i) / (StepName(step) + ".png"), photo);
      } else {
        videos_[static_cast<size_t>(i)]->Add(photo);
      }
    }
  }

  void Finish(const Progress& progress) {
    for (auto& video : videos_) video->Finish(progress);
    videos_.clear();
  }

 private:
  fs::path folder_;
  int views_;
  std::vector<std::unique_ptr<io::VideoWriter>> videos_;
};

}  // namespace

void MakeDynamicDataset(const DatasetSpec& given, const fs::path& given_folder,
                        Progress& progress) {
  const fs::path out_folder = WithoutTrailingSlash(given_folder);
  DatasetSpec spec = given;
  CheckSpec(spec);
  const Scene scene =
      MakeScene(spec.scene, spec.seed, spec.time_s + 1.0 / spec.steps_per_second);  // must move
  if (spec.layout.empty()) spec.layout = scene.framing().layouts.front();
  const std::vector<Pose> poses = MakeLayout(scene, spec.layout, spec.views);
  const std::vector<Pose> in_rig = InRig(poses, spec.scale);
  const PinholeCamera camera = MakeCamera(spec.width_px, spec.height_px, spec.focal_35mm);
  io::CameraList list;
  list.unit = spec.scale == 1 ? LengthUnit::kMetre : LengthUnit::kArbitrary;
  for (int i = 0; i < spec.views; ++i) {
    io::NamedCamera named;
    named.name = CameraName(i);
    named.depth_file = CameraName(i) + ".exr";
    named.camera = camera;
    named.cam_from_world = in_rig[static_cast<size_t>(i)];
    list.cameras.push_back(std::move(named));
  }
  WorkFolder work(WorkFolder::Of(out_folder), "dataset");
  Recording recording(spec, work.path());
  progress.Stage("rendering time steps and truth", spec.steps);
  for (int step = 0; step < spec.steps; ++step) {
    progress.ThrowIfInterrupted();
    recording.Add(step, WriteStep(spec, step, poses, list, work.path()));
    progress.Update(step + 1);
  }
  recording.Finish(progress);
  WriteFileAtomically(work.path() / "rig.json", RigText(camera, in_rig));
  WriteFileAtomically(work.path() / "dataset.json", FormatSpecJson(spec));
  WriteFileAtomically(work.path() / "SOURCE.md", StepsSourceText(spec));
  work.Become(out_folder);
}

}  // namespace dtr::datasets
