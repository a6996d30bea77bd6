// tests/io/small_set.h -- a set of three tiny views for the tests of dtr/io.
#pragma once
#include <filesystem>
#include <map>
#include <string>

#include "dtr/base/files.h"
#include "dtr/base/random.h"
#include "dtr/io/set_io.h"

namespace dtr::io::testing_support {

inline constexpr int kWidthPx = 8, kHeightPx = 6;
inline constexpr char kFingerprint[] = R"({"photos": ["a", "b"], "options": {"seed": 1}})";

/// A view with pixels drawn from the seed; sources have depth, the second also mask and sigma.
inline View SmallView(int index, ViewRole role = ViewRole::kSource) {
  Random random(static_cast<std::uint64_t>(index) + 1);
  View view;
  view.id = "view" + std::to_string(index);
  view.name = "photos/Säule " + std::to_string(index) + ".JPG";
  view.role = role;
  view.camera = PinholeCamera(kWidthPx, kHeightPx, 10.1 + index, 10.3, 4.05, 2.95);
  view.cam_from_world.rotation =
      Eigen::Quaterniond(1, 0.1 * index, random.Uniform(), 0.3).normalized();
  view.cam_from_world.translation = {0.1 * index, random.Uniform(), 1.0 / 3};
  view.image = ImageRgb8(kWidthPx, kHeightPx, 3);
  for (auto& value : view.image.data()) value = static_cast<std::uint8_t>(random.Index(256));
  if (role == ViewRole::kHeldOut) return view;
  view.depth_scale = index == 1 ? 2 : 1;
  view.depth = DepthImage(kWidthPx / view.depth_scale, kHeightPx / view.depth_scale);
  for (auto& z : view.depth.grid().data()) z = static_cast<float>(random.Uniform(2, 9));
  view.depth(1, 1) = 0;
  view.reference_baseline = 0.25;
  view.gain = {1.01, 0.99, 1.0 / 3};
  if (index != 1) return view;
  view.mask = Mask(kWidthPx, kHeightPx, 1, 255);
  view.mask(3, 3) = 0;
  view.inverse_depth_sigma = Grid<float>(view.depth.width(), view.depth.height(), 1, 0.125f);
  return view;
}

/// Metadata of a set without views.
inline DtrSet EmptySet() {
  DtrSet set;
  set.unit = LengthUnit::kMetre;
  set.world_origin = {5e5, 4.5e6 + 1.0 / 3, 100};
  set.scene_center = {0.1, -0.2, 5};
  set.bounds.min = {-1, -2, 3};
  set.bounds.max = {1, 2, 9};
  set.frames.resize(1);
  set.provenance_json = R"({"tool":"dtr test","photos":[{"name":"photos/a.JPG","width_px":8}]})";
  return set;
}

/// Two sources, one held-out view and sparse points, written through `writer` and finished.
inline DtrSet WriteSmallSet(SetWriter& writer) {
  DtrSet set = EmptySet();
  set.frames[0].views = {SmallView(0), SmallView(1), SmallView(2, ViewRole::kHeldOut)};
  for (View& view : set.frames[0].views) writer.WriteView(view, set.unit);
  SparseScene scene;
  scene.points = {{{0, 0, 5}}};
  scene.observations = {{0, 0, {1, 2}}, {1, 0, {3, 4}}};
  writer.WriteSparse(set, scene);
  writer.Finish(set);
  return set;
}

inline DtrSet WriteSmallSet(const std::filesystem::path& target, bool force = false) {
  SetWriter writer(target, kFingerprint, force);
  return WriteSmallSet(writer);
}

/// Every file below a folder with its content.
inline std::map<std::string, std::string> Contents(const std::filesystem::path& folder) {
  std::map<std::string, std::string> contents;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_directory()) continue;
    contents[entry.path().lexically_relative(folder)] = ReadFile(entry.path(), 1 << 24);
  }
  return contents;
}

}  // namespace dtr::io::testing_support
