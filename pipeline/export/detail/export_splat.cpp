// Gaussians without training, as splat viewers read them.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "dtr/base/error.h"
#include "dtr/base/file_stream.h"
#include "dtr/base/files.h"
#include "dtr/base/lower_case.h"
#include "dtr/render/colour.h"
#include "pipeline/export/detail/backdrop.h"
#include "pipeline/export/detail/common.h"
#include "pipeline/export/detail/file_in_work.h"
#include "pipeline/export/detail/gaussians.h"
#include "pipeline/export/detail/glb.h"
#include "pipeline/export/detail/ply_header.h"
#include "pipeline/export/export.h"

namespace dtr::pipeline {
namespace {

constexpr float kUsualBound = 1;
constexpr size_t kBackdropPart = 4;  // the backdrop has at most one of so many of a given count
constexpr double kShDegree0 = 0.28209479177387814;  // 1 / (2 sqrt(pi))
constexpr int kShRest = 45;                         // degrees 1 to 3, three channels

class Gaussians {
 public:
  Gaussians(const ExportRequest& request, const DtrSet& set) : request_(request), set_(set) {}

  std::vector<Gaussian> Make(Progress& progress) {
    SurfaceViews views(request_.set, set_,
                       {.completed = true, .colours = true, .memory_gb = request_.memory_gb});
    Backdrop backdrop(set_);
    for (const int v : views.WithDepth()) {
      progress.ThrowIfInterrupted();
      backdrop.AddView(*views.Get(v));
    }
    if (request_.max_count == 0) gaussians_ = backdrop.Gaussians();
    Fuse(
        views, {.min_views = 1},
        [&](const SurfaceView& surface, std::vector<FusedSample> samples) {
          std::erase_if(samples, [&](const FusedSample& sample) {
            return backdrop.Hides(sample.p_in_world);
          });
          if (samples.empty()) return;
          SplatTree tree(surface, samples);
          if (request_.max_count == 0) {
            tree.AddGaussians(kUsualBound, gaussians_);
          } else {
            trees_.push_back(std::move(tree));
          }
        },
        progress);
    if (request_.max_count > 0) {
      const float bound = BoundForCount(backdrop);
      for (const SplatTree& tree : trees_) tree.AddGaussians(bound, gaussians_);
    }
    return std::move(gaussians_);
  }

 private:
  // The backdrop in a share of the count, or in what surfaces leave of it where they need more; the
  // cheapest merges of surfaces until few enough are left.
  float BoundForCount(const Backdrop& backdrop) {
    std::vector<SplatTree::Square> merges;
    size_t left = 0, fewer = 0;
    for (const SplatTree& tree : trees_) {
      const std::vector<SplatTree::Square> own = tree.Merges();
      merges.insert(merges.end(), own.begin(), own.end());
      left += tree.samples();
      for (const SplatTree::Square& square : own) fewer += static_cast<size_t>(square.fewer);
    }
    const size_t least = left - fewer, most = request_.max_count;
    gaussians_ = backdrop.Gaussians(std::min(most / kBackdropPart, most - std::min(most, least)));
    if (least + gaussians_.size() > most) {
      throw Error(fmt::format("`max_count` {} cannot be met: the least is {}; prune the set first",
                              most, least + gaussians_.size()));
    }
    std::sort(merges.begin(), merges.end(),
              [](const auto& a, const auto& b) { return a.cost < b.cost; });
    left += gaussians_.size();
    float bound = kUsualBound;
    for (auto merge = merges.begin(); left > most; ++merge) {
      bound = std::max(bound, merge->cost);
      left -= static_cast<size_t>(merge->fewer);
    }
    return bound;
  }

  const ExportRequest& request_;
  const DtrSet& set_;
  std::vector<SplatTree> trees_;
  std::vector<Gaussian> gaussians_;
};

// Coordinates are floats, so they stay relative to the set's origin.
std::vector<std::string> Comments(const DtrSet& set) {
  std::vector<std::string> comments = FactLines(set);
  comments.push_back("offset " + NumbersText(set.world_origin));
  return comments;
}

// The layout of Kerbl et al. 2023: logarithms of deviations, logits of opacities, w x y z.
void WritePly(const std::vector<Gaussian>& gaussians, const ExportRequest& request,
              const DtrSet& set, FileStream& file) {
  std::vector<std::string> properties;
  const int rest = request.full_sh ? kShRest : 0;
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"}) {
    properties.push_back(std::string("float ") + name);
  }
  for (int i = 0; i < rest; ++i) properties.push_back("float f_rest_" + std::to_string(i));
  for (const char* name :
       {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"}) {
    properties.push_back(std::string("float ") + name);
  }
  file.Write(PlyHeader(gaussians.size(), Comments(set), properties));
  for (const Gaussian& gaussian : gaussians) {
    for (int c = 0; c < 3; ++c) file.Put(gaussian.position[c]);
    for (int c = 0; c < 3; ++c) file.Put(0.0f);
    for (const float v : gaussian.rgb) file.Put(static_cast<float>((v - 0.5) / kShDegree0));
    for (int i = 0; i < rest; ++i) file.Put(0.0f);
    file.Put(std::log(gaussian.opacity / (1 - gaussian.opacity)));
    for (int c = 0; c < 3; ++c) file.Put(std::log(gaussian.deviation[c]));
    const Eigen::Quaternionf& q = gaussian.world_from_axes;
    for (const float v : {q.w(), q.x(), q.y(), q.z()}) file.Put(v);
  }
}

std::uint8_t Byte(float v) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(v), 0L, 255L));
}

// 32 bytes each, those that cover most first, as viewers show what has arrived.
void WriteSplat(std::vector<Gaussian> gaussians, FileStream& file) {
  const auto weight = [](const Gaussian& gaussian) {
    return gaussian.opacity * gaussian.deviation.prod();
  };
  std::stable_sort(gaussians.begin(), gaussians.end(),
                   [&](const Gaussian& a, const Gaussian& b) { return weight(a) > weight(b); });
  for (const Gaussian& gaussian : gaussians) {
    for (int c = 0; c < 3; ++c) file.Put(gaussian.position[c]);
    for (int c = 0; c < 3; ++c) file.Put(gaussian.deviation[c]);
    for (const float v : gaussian.rgb) file.Put(Byte(255 * v));
    file.Put(Byte(255 * gaussian.opacity));
    const Eigen::Quaternionf& q = gaussian.world_from_axes;
    for (const float v : {q.w(), q.x(), q.y(), q.z()}) file.Put(Byte(128 + 128 * v));
  }
}

// KHR_gaussian_splatting (Khronos, 2026): scales as they are, x y z w. COLOR_0 is for programs that
// do not know it and draw points: linear light.
void WriteGlb(const std::vector<Gaussian>& gaussians, const DtrSet& set,
              const std::filesystem::path& file) {
  const std::string prefix = "KHR_gaussian_splatting:";
  GlbPrimitive primitive{.mode = 0, .arrays = {}, .extensions = {}, .unlit = true};
  primitive.extensions["KHR_gaussian_splatting"] = {{"kernel", "ellipse"},
                                                    {"colorSpace", "srgb_rec709_display"},
                                                    {"projection", "perspective"},
                                                    {"sortingMethod", "cameraDistance"}};
  GlbArray position("POSITION", "VEC3", GlbArray::kFloat);
  GlbArray rotation(prefix + "ROTATION", "VEC4", GlbArray::kFloat);
  GlbArray scale(prefix + "SCALE", "VEC3", GlbArray::kFloat);
  GlbArray opacity(prefix + "OPACITY", "SCALAR", GlbArray::kFloat);
  GlbArray degree0(prefix + "SH_DEGREE_0_COEF_0", "VEC3", GlbArray::kFloat);
  GlbArray colour("COLOR_0", "VEC4", GlbArray::kUint8);
  for (const Gaussian& gaussian : gaussians) {
    const Eigen::Quaternionf& q = gaussian.world_from_axes;
    position.Put(gaussian.position);
    for (const float v : {q.x(), q.y(), q.z(), q.w()}) rotation.Put(v);
    scale.Put(gaussian.deviation);
    opacity.Put(gaussian.opacity);
    for (const float v : gaussian.rgb) degree0.Put(static_cast<float>((v - 0.5) / kShDegree0));
    for (const float v : gaussian.rgb) {
      colour.Put(Byte(static_cast<float>(255 * LinearFromSrgb(std::clamp(v, 0.0f, 1.0f)))));
    }
    colour.Put(Byte(255 * gaussian.opacity));
  }
  primitive.arrays = {std::move(position), std::move(rotation), std::move(scale),
                      std::move(opacity),  std::move(degree0),  std::move(colour)};
  WriteGlb(file, set, primitive);
}

}  // namespace

ExportReport ExportSplat(const ExportRequest& request, Progress& progress) {
  const DtrSet set = SetWithDepth(request, "splat", progress);
  const std::filesystem::path output = WithoutTrailingSlash(request.output);
  const std::string extension = LowerExtension(output);
  if (extension != ".ply" && extension != ".splat" && extension != ".glb") {
    throw UsageError(fmt::format("{}: expected a name ending in .ply or .splat or .glb, found '{}'",
                                 output.string(), output.extension().string()));
  }
  const std::filesystem::path sidecar = output.string() + ".json";
  if (extension == ".splat" && std::filesystem::exists(sidecar)) {
    throw UsageError(fmt::format("{}: exists already; choose another name", sidecar.string()));
  }
  NoteOffset(set, progress);
  FileInWork target(output);
  ExportReport report;
  for (const View& view : set.frames.front().views) report.images += view.depth_file.has_value();
  std::vector<Gaussian> gaussians = Gaussians(request, set).Make(progress);
  report.points = gaussians.size();
  if (extension == ".glb") {
    WriteGlb(gaussians, set, target.path());
  } else {
    FileStream file(target.path());
    if (extension == ".ply") {
      WritePly(gaussians, request, set, file);
    } else {
      WriteSplat(std::move(gaussians), file);
    }
    file.Flush();
  }
  target.Publish();
  if (extension == ".splat") {  // which has no place for words
    nlohmann::ordered_json facts = SetFacts(set);
    facts["gaussians"] = report.points;
    WriteJson(sidecar, facts);
  }
  return report;
}

}  // namespace dtr::pipeline
