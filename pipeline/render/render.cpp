#include "pipeline/render/render.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "dtr/base/batches.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/lower_case.h"
#include "dtr/base/memory_budget.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "dtr/io/video.h"
#include "dtr/render/frame.h"
#include "dtr/render/frame_memory.h"
#include "dtr/render/scene.h"
#include "dtr/render/time_steps.h"
#include "dtr/render/view_stream.h"
#include "pipeline/core/run/output_folder.h"
#include "pipeline/render/detail/dynamic_scene.h"
#include "pipeline/render/novel_frames.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

// Of the memory, for images that wait to be encoded together.
constexpr double kShareOfImages = 0.06;

// Writes frames where the output says: one image, a folder of images, or a video.
class FrameSink {
 public:
  FrameSink(const RenderRequest& request, const std::vector<NovelFrame>& frames)
      : output_(request.output),
        images_(BytesOfLargest(frames), kShareOfImages * request.memory_gb * kBytesPerGigabyte,
                [](Image& image) { Write(image); }) {
    if (output_.extension() == ".mp4") {
      video_.emplace(output_, io::kVideoFramesPerSecond);
    } else if (request.several()) {
      std::vector<std::string> names;
      for (const NovelFrame& frame : frames) names.push_back(FileOf(frame));
      folder_.emplace(output_, "frames", names, request.force);
    }
  }
  std::string Add(const NovelFrame& camera, RenderResult&& result, bool filled) {
    if (video_) {
      video_->Add(result.image);
      return output_.string();
    }
    const fs::path file = folder_ ? output_ / FileOf(camera) : output_;
    // What no view saw is black with alpha 0, unless it was filled.
    const bool opaque = filled || LowerExtension(file) != ".png";
    images_.Add({file, std::move(result.image), opaque ? Mask() : std::move(result.coverage)});
    return file.string();
  }
  void Finish(const Progress& progress) {
    if (video_) video_->Finish(progress);
    images_.Finish();
    if (folder_) folder_->Finish();
  }

 private:
  struct Image {
    fs::path file;
    ImageRgb8 pixels;
    Mask alpha;  ///< empty: opaque
  };

  static std::string FileOf(const NovelFrame& frame) { return frame.name + ".png"; }
  static double BytesOfLargest(const std::vector<NovelFrame>& frames) {
    double bytes = 1;
    for (const NovelFrame& frame : frames) {
      bytes = std::max(bytes, 4.0 * frame.camera.width_px() * frame.camera.height_px());
    }
    return bytes;
  }
  static void Write(const Image& image) {
    if (image.alpha.empty()) {
      io::WriteImage(image.file, image.pixels, io::kDefaultJpegQuality, io::Mark::kRendered);
    } else {
      io::WriteImageWithAlpha(image.file, image.pixels, image.alpha, io::Mark::kRendered);
    }
  }

  fs::path output_;
  std::optional<OutputFolder> folder_;
  std::optional<io::VideoWriter> video_;
  Batches<Image> images_;
};

void RequireOneOutput(const RenderRequest& request) {
  if (!request.several()) return;
  if (!request.depth_out.empty() || !request.coverage_out.empty()) {
    throw UsageError("`depth_out`, `coverage_out`: expected one camera with them, found several");
  }
  const fs::path& output = request.output;
  if (output.extension() != ".mp4" && !fs::is_directory(output) &&
      (!output.extension().empty() || fs::exists(output))) {
    throw UsageError(
        fmt::format("`output` {}: several frames need a folder or an .mp4 file", output.string()));
  }
}

void WritePlanes(const RenderRequest& request, const RenderResult& result) {
  const io::Mark mark = io::Mark::kRendered;
  if (!request.depth_out.empty()) {
    io::WriteExr(request.depth_out, result.depth.grid(), false, mark);
  }
  if (!request.coverage_out.empty()) io::WriteMask(request.coverage_out, result.coverage, mark);
}

// When playing, one camera sees every frame of the set.
std::vector<NovelFrame> CamerasOf(const RenderRequest& request, const DtrSet& set,
                                  Progress& progress) {
  std::vector<std::string> notes;
  NovelCameraRequest wanted = request.cameras;
  if (!wanted.load_depth) wanted.load_depth = DepthLoaderOf(request.set);
  std::vector<NovelFrame> cameras =
      NovelFrames(AtFrame(set, request.frame.value_or(0)), wanted, &notes);
  for (const std::string& note : notes) progress.Note(note);
  if (!request.play) return cameras;
  if (cameras.size() != 1 || request.frame) {
    throw UsageError("`play`: expected `like` or `camera` with it, and no `frame`");
  }
  std::vector<NovelFrame> all(set.frames.size(), cameras.front());
  for (size_t i = 0; i < all.size(); ++i) all[i].name = fmt::format("{:06}", i);
  return all;
}

// Before anything is allocated: files of cameras say what they like.
void RequireMemoryForFrames(const RenderRequest& request, const std::vector<NovelFrame>& frames) {
  const NovelCameraRequest& from = request.cameras;
  const fs::path& file = from.camera_file.empty() ? from.path_file : from.camera_file;
  const bool video = request.output.extension() == ".mp4";
  for (const NovelFrame& frame : frames) {
    CheckNovelCamera(frame.camera, frame.cam_from_world);
    RequireFrameMemory(frame.camera, video, request.memory_gb,
                       (file.empty() ? "" : file.string() + ": ") + frame.name);
  }
}

// What the largest frame leaves of the memory to views.
double BytesLeftForViews(const RenderRequest& request, const std::vector<NovelFrame>& frames) {
  double bytes = request.memory_gb * kBytesPerGigabyte;
  for (const NovelFrame& frame : frames) {
    bytes = std::min(bytes, BytesForViews(frame.camera, request.memory_gb));
  }
  return bytes;
}

// The frame of the set that rendered frame `i` shows; paths run through time.
size_t FrameShown(const RenderRequest& request, const DtrSet& set, size_t i, size_t count) {
  return request.frame ? *request.frame : TimeStepOfImage(i, count, set.frames.size());
}

RenderedFile Facts(double ms, size_t frame, const RenderScene& scene, const RenderResult& result) {
  RenderedFile facts{{}, ms, frame, {}, result.coverage_share};
  for (const int index : result.views_used) {
    facts.views_used.push_back(scene.views[static_cast<size_t>(index)]->name);
  }
  return facts;
}

}  // namespace

RenderReport Render(const RenderRequest& request,
                    const std::function<eval::RenderFunction()>& make_renderer,
                    Progress& progress) {
  return Render(request, io::ReadSet(request.set), make_renderer, progress);
}

RenderReport Render(const RenderRequest& request, const DtrSet& described,
                    const std::function<eval::RenderFunction()>& make_renderer,
                    Progress& progress) {
  const auto cameras = CamerasOf(request, described, progress);
  RequireOneOutput(request);
  RequireMemoryForFrames(request, cameras);
  const eval::RenderFunction draw = make_renderer();
  RenderOptions render = request.render;
  DynamicScene moving(
      request.set, described, request.exclude,
      {request.memory_gb, request.measured_only, BytesLeftForViews(request, cameras)}, progress);
  const auto shown = [&](size_t i) { return FrameShown(request, described, i, cameras.size()); };
  moving.At(shown(0));  // names are checked here

  RenderReport report;
  FrameSink sink(request, cameras);
  progress.Stage("rendering", static_cast<int>(cameras.size()));
  for (size_t i = 0; i < cameras.size(); ++i) {
    progress.ThrowIfInterrupted();
    const NovelFrame& novel = cameras[i];
    ViewStream& stream = moving.At(shown(i));
    const RenderScene scene =
        stream.SceneFor(novel.cam_from_world, render, ViewStream::Wait::kForAll);
    if (i + 1 < cameras.size() && shown(i + 1) == shown(i)) {
      stream.Prefetch(cameras[i + 1].cam_from_world, render);
    }
    const auto start = std::chrono::steady_clock::now();
    RenderResult result = draw(scene, novel.camera, novel.cam_from_world, render);
    const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start;
    if (result.views_used.empty()) {
      progress.Note(fmt::format("WARNING: {}: no view is valid for this camera: the image is empty",
                                novel.name));
    }
    WritePlanes(request, result);
    report.frames.push_back(Facts(ms.count(), shown(i), scene, result));
    report.frames.back().file = sink.Add(novel, std::move(result), render.fill_holes);
    progress.Update(static_cast<int>(i) + 1);
  }
  sink.Finish(progress);
  for (const ViewStream::Lost& lost : moving.lost()) {
    report.skipped.emplace_back(lost.name, lost.reason);
  }
  return report;
}

}  // namespace dtr::pipeline
