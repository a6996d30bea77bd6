#include "pipeline/evaluate/detail/cast_truth.h"

#include "datasets/render_truth.h"
#include "dtr/base/files.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
constexpr std::uintmax_t kSpecLimitBytes = 1 << 20;
constexpr int kMinVisibleOthers = 2;  // seen in at least 2 other views

// Inverse of datasets::WrittenPose, for poses that act on p_written - origin.
Pose ScenePose(const Pose& written, const datasets::DatasetSpec& spec,
               const Eigen::Vector3d& origin) {
  return {written.rotation,
          (written.translation + written.rotation * (spec.world_offset - origin)) / spec.scale};
}

}  // namespace

std::optional<CastTruth> CastTruth::FromFolder(const fs::path& folder, const io::CameraList& list) {
  const fs::path file = folder / "dataset.json";
  if (!fs::exists(file)) return std::nullopt;
  return CastTruth(datasets::ParseSpecJson(ReadFile(file, kSpecLimitBytes), file.string()), list);
}

CastTruth::CastTruth(datasets::DatasetSpec spec, const io::CameraList& list)
    : spec_(std::move(spec)), scene_(datasets::MakeScene(spec_.scene, spec_.seed, spec_.time_s)) {
  for (const io::NamedCamera& named : list.cameras) {
    cams_from_scene_.push_back(ScenePose(named.cam_from_world, spec_, list.world_origin));
  }
}

ViewTruth CastTruth::On(const View& view, size_t index) const {
  const Pose& cam_from_scene = cams_from_scene_[index];
  std::vector<Pose> others = cams_from_scene_;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(index));
  datasets::PhotoOptions clean;  // texture is evaluated before noise and exposure
  clean.supersampling = spec_.supersampling;
  ViewTruth truth{
      datasets::RenderDepth(scene_, view.camera, cam_from_scene, spec_.scale),
      datasets::VisibilityMask(scene_, view.camera, cam_from_scene, others, kMinVisibleOthers)};
  const Mask texture =
      datasets::TextureMask(datasets::RenderPhoto(scene_, view.camera, cam_from_scene, clean));
  for (size_t i = 0; i < texture.data().size(); ++i) truth.scored.data()[i] &= texture.data()[i];
  return truth;
}

}  // namespace dtr::pipeline
