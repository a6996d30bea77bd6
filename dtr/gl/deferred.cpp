#include "dtr/gl/deferred.h"

#include <algorithm>
#include <array>

#include "dtr/render/grid_placement.h"

namespace dtr::gl {
namespace {

// As in coarse_depth.glsl and the shaders that include it.
constexpr int kGroupSize = 64;
constexpr GLuint kPrimitiveBinding = 1, kCoarseDepthBinding = 2, kBatchBinding = 3;
// Groups in a row of a dispatch: the least limit that a driver may have.
constexpr int kGroupsPerRow = 65535;

// Rows that one invocation draws of a triangle before others share it.
constexpr double kRowsAlone = 32;
constexpr int kLargestLog2Sharing = 6;  // a whole group
static_assert(1 << kLargestLog2Sharing == kGroupSize);

int Log2Sharing(double rows) {
  int log2 = 0;
  while (log2 < kLargestLog2Sharing && rows > kRowsAlone * (1 << log2)) ++log2;
  return log2;
}

}  // namespace

/// Primitives [first, first + count), in pieces of at most a group of invocations.
void CoarseDepth::AddBatches(int first, int count, int log2_sharing) {
  const int piece = kGroupSize >> log2_sharing;
  for (int i = 0; i < count; i += piece) {
    batches_.push_back(
        {static_cast<std::uint32_t>(first + i),
         static_cast<std::uint32_t>(std::min(piece, count - i) | log2_sharing << 8)});
  }
}

void CoarseDepth::Draw(const RenderFrame& frame, const Band& band, const MeshStore& meshes,
                       ProgramCache& programs, const Targets& targets) {
  const auto pixels = static_cast<GLsizeiptr>(targets.width) * targets.rows;
  if (!buffer_) buffer_ = Buffer::Make();
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, buffer_.name());
  if (pixels_ != pixels) {
    glBufferData(GL_SHADER_STORAGE_BUFFER, pixels * GLsizeiptr{sizeof(GLuint)}, nullptr,
                 GL_STREAM_COPY);
    pixels_ = pixels;
  }
  DrawByShaders(frame, band, meshes, programs);
}

void CoarseDepth::DrawByShaders(const RenderFrame& frame, const Band& band, const MeshStore& meshes,
                                ProgramCache& programs) {
  glClearBufferData(GL_SHADER_STORAGE_BUFFER, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kCoarseDepthBinding, buffer_.name());
  struct Range {
    int first = 0, count = 0;
  };
  std::array<std::vector<Range>, 2> ranges;  // of batches, by view: triangles, cells
  std::vector<GridPlacement> placements;
  batches_.clear();
  for (size_t i = 0; i < frame.views.size(); ++i) {
    const AdaptiveMesh& mesh = meshes.LayoutOf(*frame.views[i]);
    placements.push_back(PlaceGrid(*frame.views[i], mesh, frame.placements[i], frame.novel));
    for (const bool cells : {false, true}) {
      const int first = static_cast<int>(batches_.size());
      for (const AdaptiveMesh::Tile& tile : mesh.tiles) {
        if (!MayBeSeen(tile, placements.back(), frame.novel.width_px(), band)) continue;
        if (cells) {
          AddBatches(tile.first_cell, tile.cell_count, 0);
        } else {
          AddBatches(tile.first_triangle, tile.triangle_count,
                     Log2Sharing(RowsOfTriangles(tile, placements.back())));
        }
      }
      ranges[cells].push_back({first, static_cast<int>(batches_.size()) - first});
    }
  }
  if (!batch_buffer_) batch_buffer_ = Buffer::Make();
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, batch_buffer_.name());
  glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(batches_.size() * sizeof(Batch)),
               batches_.data(), GL_STREAM_DRAW);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kBatchBinding, batch_buffer_.name());

  for (const bool cells : {false, true}) {
    const Uniforms set(programs.Get(
        {{GL_COMPUTE_SHADER, cells ? "coarse_cells.comp" : "coarse_triangles.comp"}}, {}));
    set.Set("width_px", frame.novel.width_px());
    set.Set("first_row", band.first);
    set.Set("rows", band.count);
    for (size_t i = 0; i < frame.views.size(); ++i) {
      const Range& range = ranges[cells][i];
      if (range.count == 0) continue;
      const CoarseMesh& mesh = meshes.MeshOf(*frame.views[i]);
      set.Set("screen_from_grid", placements[i].from_grid);
      set.Set("screen_from_centre", placements[i].from_centre);
      set.Set("near_z", placements[i].near_z);
      set.Set("first_batch", range.first);
      set.Set("batch_count", range.count);
      glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kPrimitiveBinding,
                       cells ? mesh.cells.name() : mesh.triangles.name());
      glDispatchCompute(static_cast<GLuint>(std::min(range.count, kGroupsPerRow)),
                        static_cast<GLuint>((range.count + kGroupsPerRow - 1) / kGroupsPerRow), 1);
    }
  }
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

}  // namespace dtr::gl
