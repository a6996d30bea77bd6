#include "calib/colmap/dense.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <system_error>

#include "calib/colmap/model_io.h"
#include "calib/colmap/program.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::colmap {
namespace {

namespace fs = std::filesystem;
static_assert(std::endian::native == std::endian::little, "the files are little endian");

constexpr size_t kLongestHeader = 3 * (10 + 1);  // three numbers of 32 bits, an '&' after each
constexpr int kSourceImages = 20;                // what COLMAP's own undistorter asks for

struct Header {
  int width = 0, height = 0, channels = 0;
  size_t bytes = 0;
};

[[noreturn]] void Reject(const fs::path& file, const std::string& expected,
                         const std::string& found) {
  throw Error(
      fmt::format("{}: expected {}, found {}; give the workspace of these very images and cameras",
                  file.string(), expected, found));
}

Header ParseHeader(const fs::path& file, std::string_view content) {
  Header header;
  for (int* number : {&header.width, &header.height, &header.channels}) {
    const char* begin = content.data() + header.bytes;
    const char* end = content.data() + std::min(content.size(), kLongestHeader);
    const auto [next, error] = std::from_chars(begin, end, *number);
    if (error != std::errc() || next == end || *next != '&' || *number <= 0) {
      Reject(file, "a depth map that begins with \"width&height&channels&\"", "something else");
    }
    header.bytes = static_cast<size_t>(next + 1 - content.data());
  }
  return header;
}

PinholeCamera DenseCameraOf(const fs::path& folder, const calib::SfmModel& model,
                            const calib::SfmImage& image) {
  const calib::LensCamera& lens = model.cameras.at(image.camera_id);
  if (!lens.IsUndistorted()) {
    throw Error(fmt::format(
        "{}: camera {}: expected an undistorted camera, found {}; give the workspace that "
        "colmap image_undistorter wrote",
        folder.string(), image.camera_id, calib::NameOf(lens.model)));
  }
  return lens.Pinhole();
}

}  // namespace

std::vector<DenseImage> ReadDenseWorkspace(const fs::path& workspace) {
  const fs::path sparse = ModelFolderIn(workspace / "sparse");
  const calib::SfmModel model = ReadModel(sparse);
  std::vector<DenseImage> images;
  for (const calib::SfmImage& image : model.images) {
    DenseImage dense{
        image.name, DenseCameraOf(sparse, model, image), image.cam_from_world, {}, true};
    const fs::path stem = workspace / "stereo" / "depth_maps" / image.name;
    for (const bool geometric : {true, false}) {
      const fs::path file = stem.string() + (geometric ? ".geometric.bin" : ".photometric.bin");
      if (!dense.depth_map.empty() || !fs::is_regular_file(file)) continue;
      dense.depth_map = file;
      dense.geometric = geometric;
    }
    images.push_back(std::move(dense));
  }
  return images;
}

DepthImage ReadDenseDepth(const fs::path& file, int width_px, int height_px) {
  const size_t count = static_cast<size_t>(width_px) * static_cast<size_t>(height_px);
  const std::string content = ReadFile(file, kLongestHeader + count * sizeof(float));
  const Header header = ParseHeader(file, content);
  if (header.width != width_px || header.height != height_px || header.channels != 1) {
    Reject(file, fmt::format("a depth map of {}x{} and 1 channel", width_px, height_px),
           fmt::format("{}x{} and {}", header.width, header.height, header.channels));
  }
  const size_t expected = header.bytes + count * sizeof(float);
  if (content.size() != expected) {
    Reject(file, fmt::format("{} bytes", expected), std::to_string(content.size()));
  }
  DepthImage depth(width_px, height_px);
  std::memcpy(depth.grid().data().data(), content.data() + header.bytes, count * sizeof(float));
  for (float& z : depth.grid().data()) {
    if (!std::isfinite(z) || DepthImage::IsHole(z)) z = 0;
  }
  return depth;
}

void WriteDenseWorkspace(const fs::path& workspace, const calib::SfmModel& model) {
  WriteModel(workspace / "sparse", model, Format::kBinary);
  for (const char* folder : {"depth_maps", "normal_maps", "consistency_graphs"}) {
    fs::create_directories(workspace / "stereo" / folder);
  }
  std::string list;
  for (const calib::SfmImage& image : model.images) {
    list += fmt::format("{}\n__auto__, {}\n", image.name, kSourceImages);
  }
  WriteFileAtomically(workspace / "stereo" / "patch-match.cfg", list);
}

void RequireCuda() {
  const Program program;
  if (program.has_cuda()) return;
  throw Error(fmt::format(
      "colmap patch_match_stereo: expected a COLMAP with CUDA, found {} without; let a machine "
      "with CUDA fill a dense workspace and give it with `workspace`, or use `engine` patchmatch",
      program.version()));
}

sfm::StepRecord RunPatchMatchStereo(const fs::path& workspace, Progress& progress) {
  RequireCuda();
  Arguments arguments("patch_match_stereo");
  arguments.Add({"workspace_path"}, workspace.string());
  arguments.Add({"PatchMatchStereo.geom_consistency"}, "1");
  sfm::StepRecord record;
  record.name = "dense depth";
  record.log_file = workspace / "patch_match_stereo.log";
  progress.Stage("colmap patch_match_stereo", 0);
  RunColmap(arguments.argv(), record, {}, progress);
  return record;
}

}  // namespace dtr::colmap
