#include "pipeline/export/detail/coloured_points.h"

#include "calib/colmap/export.h"
#include "dtr/base/file_stream.h"
#include "dtr/io/set_io.h"
#include "pipeline/export/detail/common.h"
#include "pipeline/export/detail/ply_header.h"
#include "pipeline/export/detail/points_from_depth.h"

namespace dtr::pipeline {

StartPoints StartPointsOf(const std::filesystem::path& folder, const DtrSet& set,
                          Progress& progress) {
  StartPoints start;
  if (set.sparse_file) start.scene = io::LoadSparse(folder, set);
  start.from_depth = start.scene.points.empty();
  if (start.from_depth) start.scene = PointsFromDepth(folder, set, {}, progress);
  return start;
}

ImageRgb8 ImageOf(const std::filesystem::path& folder, View view) {
  io::LoadOptions load;
  load.depth = false;
  io::LoadPixels(folder, view, load);
  return std::move(view.image);
}

size_t WritePointsPly(const std::filesystem::path& file, const std::filesystem::path& folder,
                      const DtrSet& set, const SparseScene& scene) {
  DtrSet near = set;
  near.world_origin.setZero();
  const calib::SfmModel model =
      colmap::ModelFromViews(near, scene, [&](const View& view) { return ImageOf(folder, view); });
  FileStream stream(file);
  std::vector<std::string> comments = FactLines(set);
  comments.push_back("offset " + NumbersText(set.world_origin));
  stream.Write(
      PlyHeader(model.points.size(), comments,
                {"float x", "float y", "float z", "uchar red", "uchar green", "uchar blue"}));
  for (const auto& [id, point] : model.points) {
    for (int c = 0; c < 3; ++c) stream.Put(static_cast<float>(point.p_in_world[c]));
    for (const std::uint8_t v : point.rgb) stream.Put(v);
  }
  stream.Flush();
  return model.points.size();
}

}  // namespace dtr::pipeline
