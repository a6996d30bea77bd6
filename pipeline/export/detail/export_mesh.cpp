// The depth maps as one triangle mesh.
#include <fmt/format.h>

#include "dtr/base/error.h"
#include "dtr/base/file_stream.h"
#include "dtr/base/files.h"
#include "dtr/base/lower_case.h"
#include "dtr/render/colour.h"
#include "pipeline/export/detail/common.h"
#include "pipeline/export/detail/file_in_work.h"
#include "pipeline/export/detail/glb.h"
#include "pipeline/export/detail/mesh.h"
#include "pipeline/export/export.h"

namespace dtr::pipeline {
namespace {

void WritePly(const Mesh& mesh, const DtrSet& set, const std::filesystem::path& path) {
  const bool as_double = !set.world_origin.isZero(0);
  const char* number = as_double ? "double" : "float";
  std::string header = "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& line : FactLines(set)) header += "comment " + line + "\n";
  header += fmt::format("comment voxel {}\nelement vertex {}\n", mesh.voxel, mesh.positions.size());
  for (const char* axis : {"x", "y", "z"}) header += fmt::format("property {} {}\n", number, axis);
  for (const char* name : {"nx", "ny", "nz"}) header += fmt::format("property float {}\n", name);
  for (const char* name : {"red", "green", "blue"}) {
    header += fmt::format("property uchar {}\n", name);
  }
  header += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                        mesh.triangles.size());
  FileStream file(path);
  file.Write(header);
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const float value = mesh.positions[i][c];
      as_double ? file.Put(value + set.world_origin[c]) : file.Put(value);
    }
    for (int c = 0; c < 3; ++c) file.Put(mesh.normals[i][c]);
    for (const std::uint8_t v : mesh.colours[i]) file.Put(v);
  }
  for (const auto& triangle : mesh.triangles) {
    file.Put(std::uint8_t{3});
    for (const std::uint32_t v : triangle) file.Put(v);
  }
  file.Flush();
}

// Colours of glTF are linear light, alpha last.
void WriteGlb(const Mesh& mesh, const DtrSet& set, const std::filesystem::path& path) {
  GlbArray position("POSITION", "VEC3", GlbArray::kFloat),
      normal("NORMAL", "VEC3", GlbArray::kFloat);
  GlbArray colour("COLOR_0", "VEC4", GlbArray::kUint16), indices("", "SCALAR", GlbArray::kUint32);
  const std::array<double, 256>& linear = LinearFromSrgb8();
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    position.Put(mesh.positions[i]);
    normal.Put(mesh.normals[i]);
    for (const std::uint8_t v : mesh.colours[i]) {
      colour.Put(static_cast<std::uint16_t>(65535 * linear[v] + 0.5));
    }
    colour.Put(std::uint16_t{65535});
  }
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t v : triangle) indices.Put(v);
  }
  GlbPrimitive primitive{.mode = 4, .arrays = {}, .extensions = {}, .unlit = true};
  primitive.arrays = {std::move(position), std::move(normal), std::move(colour),
                      std::move(indices)};
  WriteGlb(path, set, primitive);
}

}  // namespace

ExportReport ExportMesh(const ExportRequest& request, Progress& progress) {
  const DtrSet set = SetWithDepth(request, "mesh", progress);
  const std::filesystem::path output = WithoutTrailingSlash(request.output);
  const std::string extension = LowerExtension(output);
  if (extension != ".ply" && extension != ".glb") {
    throw UsageError(fmt::format("{}: expected a name ending in .ply or .glb, found '{}'",
                                 output.string(), output.extension().string()));
  }
  if (extension == ".glb") NoteOffset(set, progress);
  FileInWork target(output);
  SurfaceViews views(
      request.set, set,
      {.completed = request.completed, .colours = true, .memory_gb = request.memory_gb / 2});
  const Mesh mesh = MeshOf(
      views,
      {.voxel = request.voxel, .min_views = request.min_views, .memory_gb = request.memory_gb / 2},
      progress);
  if (mesh.triangles.empty()) {
    throw Error(fmt::format("{}: no surface that {} views show; choose fewer views",
                            request.set.string(), request.min_views));
  }
  if (extension == ".glb") {
    WriteGlb(mesh, set, target.path());
  } else {
    WritePly(mesh, set, target.path());
  }
  target.Publish();
  return {.images = views.WithDepth().size(),
          .points = mesh.positions.size(),
          .triangles = mesh.triangles.size()};
}

}  // namespace dtr::pipeline
