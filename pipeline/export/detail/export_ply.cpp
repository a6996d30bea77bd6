// The fused depth maps as a cloud.
#include "dtr/base/file_stream.h"
#include "dtr/base/files.h"
#include "pipeline/export/detail/common.h"
#include "pipeline/export/detail/file_in_work.h"
#include "pipeline/export/detail/fuse.h"
#include "pipeline/export/detail/ply_header.h"
#include "pipeline/export/export.h"

namespace dtr::pipeline {
namespace {

struct CloudLayout {
  bool as_double = false, completed = false;
  std::vector<std::string> properties;
};

CloudLayout CloudLayoutOf(const DtrSet& set, const ExportRequest& request) {
  CloudLayout layout{!set.world_origin.isZero(0), request.completed, {}};
  const std::string number = layout.as_double ? "double " : "float ";
  for (const char* axis : {"x", "y", "z"}) layout.properties.push_back(number + axis);
  for (const char* property : {"float nx", "float ny", "float nz", "uchar red", "uchar green",
                               "uchar blue", "float sigma", "uchar views"}) {
    layout.properties.emplace_back(property);
  }
  if (layout.completed) layout.properties.emplace_back("uchar completed");
  return layout;
}

void Put(const FusedSample& sample, const Eigen::Vector3d& origin, const CloudLayout& layout,
         FileStream& file) {
  for (int c = 0; c < 3; ++c) {
    const double value = sample.p_in_world[c] + origin[c];
    layout.as_double ? file.Put(value) : file.Put(static_cast<float>(value));
  }
  for (int c = 0; c < 3; ++c) file.Put(sample.normal[c]);
  for (const std::uint8_t v : sample.rgb) file.Put(v);
  file.Put(sample.sigma);
  file.Put(static_cast<std::uint8_t>(std::min(sample.views, 255)));
  if (layout.completed) file.Put(static_cast<std::uint8_t>(sample.completed));
}

}  // namespace

ExportReport ExportPly(const ExportRequest& request, Progress& progress) {
  const DtrSet set = SetWithDepth(request, "ply", progress);
  const std::filesystem::path output = WithoutTrailingSlash(request.output);
  FileInWork target(output);
  const CloudLayout layout = CloudLayoutOf(set, request);
  std::vector<std::string> comments = FactLines(set);
  comments.emplace_back("sigma: standard deviation along the viewing ray in units, 0 not known");
  SurfaceViews views(request.set, set, SurfaceOptions(request, true));
  ExportReport report{.images = views.WithDepth().size()};
  FileStream file(target.path());
  file.Write(PlyHeader(0, comments, layout.properties));
  Fuse(
      views, {.min_views = request.min_views},
      [&](const SurfaceView&, const std::vector<FusedSample>& samples) {
        for (const FusedSample& sample : samples) Put(sample, set.world_origin, layout, file);
        report.points += samples.size();
      },
      progress);
  file.Replace(PlyHeader(report.points, comments, layout.properties));
  target.Publish();
  return report;
}

}  // namespace dtr::pipeline
