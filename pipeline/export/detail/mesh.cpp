#include "pipeline/export/detail/mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "pipeline/export/detail/fuse.h"
#include "pipeline/export/detail/mesh_blocks.h"

namespace dtr::pipeline {
namespace {

constexpr double kVoxelPx = 2;
// What a block takes until its triangles are made: about 60 vertices and quads.
constexpr double kBytesPerBlock = 6000;
constexpr std::uint32_t kLeastTriangles = 100;  // of a part
constexpr size_t kBatch = 512;
constexpr double kVisible = 2;  // voxels that a vertex may lie off a view that colours it

double MedianFootprint(SurfaceViews& views) {
  std::vector<double> widths;
  for (const int v : views.WithDepth()) {
    const auto surface = views.Get(v);
    for (const Eigen::Vector3d& p : CoarsePoints(*surface)) {
      widths.push_back(surface->InCam(p).z() / surface->camera.fx_px());
    }
  }
  if (widths.empty()) return 1;
  const auto middle = widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2);
  std::nth_element(widths.begin(), middle, widths.end());
  return *middle;
}

std::vector<BlockPlace> AllBlocks(SurfaceViews& views, double voxel, Progress& progress) {
  std::vector<BlockPlace> all;
  for (const int v : views.WithDepth()) {
    progress.ThrowIfInterrupted();
    const std::vector<BlockPlace> own = BlocksOf(*views.Get(v), voxel);
    std::vector<BlockPlace> joined;
    std::set_union(all.begin(), all.end(), own.begin(), own.end(), std::back_inserter(joined));
    all = std::move(joined);
  }
  return all;
}

// Whether a view may see part of a block: a sphere around it reaches into the cone of the image.
bool MaySee(const View& view, const BlockPlace& place, double voxel) {
  const double side = voxel * (kBlockSide + 1);
  const double radius = side * std::sqrt(3.0) / 2;
  Eigen::Vector3d middle;
  for (int c = 0; c < 3; ++c) middle[c] = voxel * kBlockSide * place[static_cast<size_t>(c)];
  const Eigen::Vector3d p = view.cam_from_world * (middle + Eigen::Vector3d::Constant(side / 2));
  if (p.z() <= -radius) return false;
  if (p.z() <= radius) return true;
  const PinholeCamera& camera = view.camera;
  const auto outside = [&](double along, double focal, double centre, double size) {
    // Planes through the borders of the image: distance to the outside.
    const double low = -centre / focal, high = (size - centre) / focal;
    return (low * p.z() - along) / std::hypot(1, low) > radius ||
           (along - high * p.z()) / std::hypot(1, high) > radius;
  };
  return !outside(p.x(), camera.fx_px(), camera.cx_px(), camera.width_px()) &&
         !outside(p.y(), camera.fy_px(), camera.cy_px(), camera.height_px());
}

class MeshMaker {
 public:
  MeshMaker(SurfaceViews& views, const MeshOptions& options, Progress& progress)
      : views_(views), options_(options), progress_(progress) {}

  Mesh Make() {
    ChooseVoxel();
    LeaveOutEmptyBlocks();
    ComputeBlocks();
    Join();
    LeaveOutSmallParts();
    Colour();
    return std::move(mesh_);
  }

 private:
  void ChooseVoxel() {
    progress_.Stage("voxels", 1);
    mesh_.voxel = options_.voxel > 0 ? options_.voxel : kVoxelPx * MedianFootprint(views_);
    const double most = options_.memory_gb * kBytesPerGigabyte / kBytesPerBlock;
    for (;;) {
      places_ = AllBlocks(views_, mesh_.voxel, progress_);
      if (static_cast<double>(places_.size()) <= most || places_.size() < kBatch) return;
      // Blocks of a surface are as many as its area has.
      mesh_.voxel *= 1.1 * std::sqrt(static_cast<double>(places_.size()) / most);
    }
  }

  // A surface needs distances of several views: blocks that fewer of them reach have none. Of depth
  // that is far or noisy these are nearly all: every sample has blocks of its own.
  void LeaveOutEmptyBlocks() {
    std::vector<int> reached(places_.size());
    const std::vector<View>& all = views_.set().frames.front().views;
    for (const int v : views_.WithDepth()) {
      progress_.ThrowIfInterrupted();
      const View& view = all[static_cast<size_t>(v)];
      const auto surface = views_.Get(v);
      const NearDepths near_depths(*surface, mesh_.voxel);
      ParallelFor(0, static_cast<int>((places_.size() + kBatch - 1) / kBatch), [&](int batch) {
        const size_t first = static_cast<size_t>(batch) * kBatch;
        for (size_t i = first; i < std::min(first + kBatch, places_.size()); ++i) {
          if (reached[i] >= options_.min_views) continue;
          reached[i] += MaySee(view, places_[i], mesh_.voxel) && near_depths.MayReach(places_[i]);
        }
      });
    }
    size_t kept = 0;
    for (size_t i = 0; i < places_.size(); ++i) {
      if (reached[i] >= options_.min_views) places_[kept++] = places_[i];
    }
    places_.resize(kept);
  }

  void ComputeBlocks() {
    progress_.Stage("surface", static_cast<int>(places_.size()));
    blocks_.resize(places_.size());
    const std::vector<View>& all = views_.set().frames.front().views;
    const std::vector<int> with_depth = views_.WithDepth();
    for (size_t first = 0; first < places_.size(); first += kBatch) {
      progress_.ThrowIfInterrupted();
      const size_t end = std::min(first + kBatch, places_.size());
      std::vector<std::vector<int>> seeing(end - first);
      std::vector<int> needed;
      for (size_t i = first; i < end; ++i) {
        for (const int v : with_depth) {
          if (MaySee(all[static_cast<size_t>(v)], places_[i], mesh_.voxel)) {
            seeing[i - first].push_back(v);
          }
        }
        needed.insert(needed.end(), seeing[i - first].begin(), seeing[i - first].end());
      }
      std::sort(needed.begin(), needed.end());
      needed.erase(std::unique(needed.begin(), needed.end()), needed.end());
      const SurfaceList loaded = views_.GetAll(needed);
      ParallelFor(0, static_cast<int>(end - first), [&](int i) {
        SurfaceList own;
        for (const int v : seeing[static_cast<size_t>(i)]) {
          const auto at = std::lower_bound(needed.begin(), needed.end(), v) - needed.begin();
          own.push_back(loaded[static_cast<size_t>(at)]);
        }
        const size_t block = first + static_cast<size_t>(i);
        blocks_[block] = MeshBlockOf(places_[block], mesh_.voxel, options_.min_views, own);
      });
      progress_.Update(static_cast<int>(end));
    }
  }

  // Number of the vertex of a cell given by voxels from a block's first; -1: it has none.
  std::int64_t VertexAt(size_t block, Eigen::Vector3i cell) const {
    BlockPlace place = places_[block];
    bool own = true;
    for (int c = 0; c < 3; ++c) {
      if (cell[c] >= 0) continue;
      cell[c] += kBlockSide;
      --place[static_cast<size_t>(c)];
      own = false;
    }
    if (!own) {
      const auto found = std::lower_bound(places_.begin(), places_.end(), place);
      if (found == places_.end() || *found != place) return -1;
      block = static_cast<size_t>(found - places_.begin());
    }
    const auto number =
        static_cast<std::uint16_t>(cell.x() + kBlockSide * (cell.y() + kBlockSide * cell.z()));
    const std::vector<MeshBlock::Vertex>& vertices = blocks_[block].vertices;
    const auto found = std::lower_bound(
        vertices.begin(), vertices.end(), number,
        [](const MeshBlock::Vertex& vertex, std::uint16_t n) { return vertex.cell < n; });
    if (found == vertices.end() || found->cell != number) return -1;
    return firsts_[block] + (found - vertices.begin());
  }

  void Join() {
    for (const MeshBlock& block : blocks_) {
      firsts_.push_back(static_cast<std::int64_t>(mesh_.positions.size()));
      for (const MeshBlock::Vertex& vertex : block.vertices) {
        mesh_.positions.push_back(vertex.position);
        mesh_.normals.push_back(vertex.normal);
      }
    }
    for (size_t block = 0; block < blocks_.size(); ++block) {
      for (const MeshBlock::Quad& quad : blocks_[block].quads) AddQuad(block, quad);
    }
    blocks_.clear();
  }

  void AddQuad(size_t block, const MeshBlock::Quad& quad) {
    const int n = quad.point;
    const Eigen::Vector3i point(n % kBlockSide, n / kBlockSide % kBlockSide,
                                n / (kBlockSide * kBlockSide));
    const Eigen::Vector3i u = Eigen::Vector3i::Unit((quad.axis + 1) % 3);
    const Eigen::Vector3i w = Eigen::Vector3i::Unit((quad.axis + 2) % 3);
    std::array<std::int64_t, 4> at = {VertexAt(block, point - u - w), VertexAt(block, point - w),
                                      VertexAt(block, point), VertexAt(block, point - u)};
    if (std::any_of(at.begin(), at.end(), [](std::int64_t v) { return v < 0; })) return;
    if (!quad.outwards) std::swap(at[1], at[3]);
    std::array<std::uint32_t, 4> v{};
    for (size_t i = 0; i < 4; ++i) v[i] = static_cast<std::uint32_t>(at[i]);
    const auto apart = [&](size_t i, size_t j) {
      return (mesh_.positions[v[i]] - mesh_.positions[v[j]]).squaredNorm();
    };
    if (apart(0, 2) <= apart(1, 3)) {
      mesh_.triangles.push_back({v[0], v[1], v[2]});
      mesh_.triangles.push_back({v[0], v[2], v[3]});
    } else {
      mesh_.triangles.push_back({v[0], v[1], v[3]});
      mesh_.triangles.push_back({v[1], v[2], v[3]});
    }
  }

  void LeaveOutSmallParts() {
    std::vector<std::uint32_t> parent(mesh_.positions.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](std::uint32_t v) {
      while (parent[v] != v) v = parent[v] = parent[parent[v]];
      return v;
    };
    for (const auto& t : mesh_.triangles) {
      for (size_t i = 1; i < 3; ++i) {
        const std::uint32_t a = root(t[0]), b = root(t[i]);
        parent[std::max(a, b)] = std::min(a, b);
      }
    }
    std::vector<std::uint32_t> count(parent.size());
    for (const auto& t : mesh_.triangles) ++count[root(t[0])];
    std::erase_if(mesh_.triangles,
                  [&](const auto& t) { return count[root(t[0])] < kLeastTriangles; });
    std::vector<std::uint32_t> number(parent.size());
    std::uint32_t kept = 0;
    for (std::uint32_t v = 0; v < number.size(); ++v) {
      if (count[root(v)] < kLeastTriangles) continue;
      mesh_.positions[kept] = mesh_.positions[v];
      mesh_.normals[kept] = mesh_.normals[v];
      number[v] = kept++;
    }
    mesh_.positions.resize(kept);
    mesh_.normals.resize(kept);
    for (auto& t : mesh_.triangles) {
      for (std::uint32_t& v : t) v = number[v];
    }
  }

  // Mean of the views that show the vertex; those that show it finer weigh more.
  void Colour() {
    const std::vector<int> with_depth = views_.WithDepth();
    progress_.Stage("colours", static_cast<int>(with_depth.size()));
    std::vector<Eigen::Vector4f> sums(mesh_.positions.size(), Eigen::Vector4f::Zero());
    int done = 0;
    for (const int v : with_depth) {
      progress_.ThrowIfInterrupted();
      const auto surface = views_.Get(v);
      ParallelFor(0, static_cast<int>(sums.size()), [&](int i) {
        AddColour(*surface, static_cast<size_t>(i), sums[static_cast<size_t>(i)]);
      });
      progress_.Update(++done);
    }
    mesh_.colours.resize(sums.size());
    for (size_t i = 0; i < sums.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        mesh_.colours[i][static_cast<size_t>(c)] = static_cast<std::uint8_t>(
            sums[i][3] > 0 ? std::min(255.0f, sums[i][c] / sums[i][3] + 0.5f) : 128.0f);
      }
    }
  }

  void AddColour(const SurfaceView& surface, size_t vertex, Eigen::Vector4f& sum) const {
    const Eigen::Vector3d p_in_world = mesh_.positions[vertex].cast<double>();
    const Eigen::Vector3d p = surface.InCam(p_in_world);
    const auto pixel = surface.camera.PixelFromCam(p);
    if (!pixel || !surface.camera.Contains(*pixel)) return;
    const auto w = surface.InverseDepthAt(*pixel);
    const Eigen::Vector3d to_camera = (surface.centre - p_in_world).normalized();
    const double cosine = mesh_.normals[vertex].cast<double>().dot(to_camera);
    if (!w || cosine < 0.05 ||
        std::abs(1 / *w - p.z()) * cosine > kVisible * mesh_.voxel * p.z() / p.norm()) {
      return;
    }
    const double finer = cosine * surface.camera.fx_px() / p.z() * mesh_.voxel;
    const auto weight = static_cast<float>(std::pow(finer, 4) + 1e-12);
    const std::array<double, 3> rgb = surface.ColourAt(*pixel);
    for (int c = 0; c < 3; ++c) sum[c] += weight * static_cast<float>(rgb[static_cast<size_t>(c)]);
    sum[3] += weight;
  }

  SurfaceViews& views_;
  const MeshOptions& options_;
  Progress& progress_;
  Mesh mesh_;
  std::vector<BlockPlace> places_;
  std::vector<MeshBlock> blocks_;
  std::vector<std::int64_t> firsts_;  // number of each block's first vertex
};

}  // namespace

Mesh MeshOf(SurfaceViews& views, const MeshOptions& options, Progress& progress) {
  return MeshMaker(views, options, progress).Make();
}

}  // namespace dtr::pipeline
