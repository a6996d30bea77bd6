// tests/simd/exact_scenes.h -- the exact scenes of `datasets` as small sets, and one that is
// damaged as real captures are.
#pragma once
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "datasets/layout.h"
#include "datasets/render_truth.h"
#include "datasets/scene.h"
#include "dtr/base/random.h"
#include "tests/simd/parity_scenes.h"

namespace dtr::testing {

/// `views` source views of a scene in its default layout, and a novel camera between two of them,
/// nearer to one and a little off the line.
inline NamedScene ExactScene(const std::string& name, int views, int width_px, int height_px) {
  const datasets::Scene scene = datasets::MakeScene(name, 1);
  const std::vector<Pose> poses =
      datasets::MakeLayout(scene, scene.framing().layouts.front(), views);
  const PinholeCamera camera = datasets::MakeCamera(width_px, height_px);
  datasets::PhotoOptions photo;
  photo.supersampling = 2;
  NamedScene named{name, datasets::RenderTruthSet(scene, camera, poses, photo), {}};
  const Pose &a = poses[poses.size() / 2], &b = poses[poses.size() / 2 - 1];
  const Eigen::Vector3d between =
      0.6 * a.TargetOriginInSource() + 0.4 * b.TargetOriginInSource() +
      0.1 * (a.TargetOriginInSource() - b.TargetOriginInSource()).norm() * Eigen::Vector3d::UnitZ();
  const Eigen::Quaterniond rotation = a.rotation.slerp(0.4, b.rotation).normalized();
  named.novel.id = "n";
  named.novel.camera = camera;
  named.novel.cam_from_world = {rotation, -(rotation * between)};
  return named;
}

/// What stereo on real photos does: errors of half a pixel of disparity that go on for many pixels,
/// a little noise, wrong patches, holes; photos with noise, other exposures and masks.
inline NamedScene DamagedScene(const std::string& name, int views, int width_px, int height_px) {
  constexpr double kNoisePx = 0.05, kWavePx = 0.5, kWaveLength = 17;
  NamedScene named = ExactScene(name, views, width_px, height_px);
  named.name = name + ", damaged";
  Random random(3);
  double gain = 0.7;
  for (View& view : named.set.frames[0].views) {
    const double per_px = ThresholdsOf(view, {}).pixel;
    const double phase = random.Uniform(0, 6);
    for (int y = 0; y < height_px; ++y) {
      for (int x = 0; x < width_px; ++x) {
        float& z = view.depth(x, y);
        const double wave = std::sin(x / kWaveLength + phase) * std::sin(y / kWaveLength);
        const double w = 1 / z + per_px * (kWavePx * wave + kNoisePx * random.Normal());
        z = z > 0 && w > 0 ? static_cast<float>(1 / w) : 0.0f;
      }
    }
    view.mask = Mask(width_px, height_px, 1, 255);
    const int side = height_px / 10;
    for (int k = 0; k < 9; ++k) {
      const int left = random.Index(width_px - side), top = random.Index(height_px - side);
      const double wrong_px = random.Uniform(2, 6);
      for (int y = top; y < top + side; ++y) {
        for (int x = left; x < left + side; ++x) {
          float& z = view.depth(x, y);
          if (k % 3 == 0) z = 0;
          if (k % 3 == 1) view.mask(x, y) = 0;
          if (k % 3 == 2 && z > 0) z = static_cast<float>(1 / (1 / z + wrong_px * per_px));
        }
      }
    }
    for (std::uint8_t& level : view.image.data()) {
      level = static_cast<std::uint8_t>(std::clamp(level + 3 * random.Normal(), 0.0, 255.0));
    }
    view.gain = {gain, 1, 1.7 - gain};
    gain = gain > 1.2 ? 0.75 : gain + 0.13;
  }
  return named;
}

inline std::vector<std::string> ExactSceneNames() {
  return {"courtyard", "plane", "stairs", "sphere", "room", "damaged"};
}

/// By one of these names.
inline NamedScene ExactOrDamagedScene(const std::string& name, int views, int width_px,
                                      int height_px) {
  return name == "damaged" ? DamagedScene("courtyard", views, width_px, height_px)
                           : ExactScene(name, views, width_px, height_px);
}

/// The damaged scene, its novel camera moved towards an input camera until a share of the way is
/// left: there one view decides (SPEC 5.2) and borders fade less (SPEC 4.8).
inline NamedScene TowardsAnInputCamera(double share_left) {
  NamedScene scene = ExactOrDamagedScene("damaged", 5, 192, 128);
  const Pose own = scene.set.frames[0].views[2].cam_from_world;
  Pose& novel = scene.novel.cam_from_world;
  const Eigen::Vector3d center =
      (1 - share_left) * own.TargetOriginInSource() + share_left * novel.TargetOriginInSource();
  novel.rotation = own.rotation.slerp(share_left, novel.rotation);
  novel.translation = -(novel.rotation * center);
  return scene;
}

/// Masked samples are no holes: they have no vote (SPEC 5.2), and squares of them are passed over.
inline NamedScene MaskedInLargePieces() {
  NamedScene scene = ExactOrDamagedScene("courtyard", 5, 192, 128);
  int k = 0;
  for (View& view : scene.set.frames[0].views) {
    if (view.mask.empty()) view.mask = Mask(192, 128, 1, 255);
    for (int y = 0; y < 128; ++y) {
      for (int x = 0; x < 192; ++x) {
        const bool masked = (x / 64 + y / 64 + k) % 3 == 0;
        const bool hole = x < 70 && y > 60 && k % 2 == 0;
        if (masked) view.mask(x, y) = 0;
        if (masked || hole) view.depth(x, y) = 0;
      }
    }
    ++k;
  }
  return scene;
}

/// A map without one sample was never looked at (SPEC 2.1): from its own position others are seen.
inline NamedScene OneViewWithoutDepth() {
  NamedScene scene = ExactOrDamagedScene("courtyard", 5, 192, 128);
  View& empty = scene.set.frames[0].views[2];
  for (float& z : empty.depth.grid().data()) z = 0;
  scene.novel.camera = empty.camera;
  scene.novel.cam_from_world = empty.cam_from_world;
  return scene;
}

}  // namespace dtr::testing
