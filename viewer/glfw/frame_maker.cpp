#include "viewer/glfw/frame_maker.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "dtr/base/error.h"
#include "dtr/gl/frame_timer.h"
#include "dtr/render/finish_image.h"
#include "dtr/report/contact_sheet.h"

namespace dtr::viewer {
namespace {

/// Milliseconds since it was made or asked last.
class Laps {
 public:
  double Lap() {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::duration<double, std::milli> ms = now - last_;
    last_ = now;
    return ms.count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// False colours and those who inspect read the views' own pixels.
ViewStream::Pixels PixelsFor(const FrameRequest& order) {
  const bool needed = order.inspected || order.shown != Shown::kColour;
  return needed ? ViewStream::Pixels::kInMemory : ViewStream::Pixels::kOrReleased;
}

PinholeCamera Smaller(const PinholeCamera& camera, int divisor) {
  return camera.Resized(std::max(1, camera.width_px() / divisor),
                        std::max(1, camera.height_px() / divisor));
}

}  // namespace

FrameMaker::FrameMaker(ViewStream& stream, ViewColours colours,
                       const gl::RendererSettings& settings, gl::Drawer drawer, SigmaOf sigma_of)
    : stream_(stream),
      colours_(std::move(colours)),
      renderer_(settings, drawer),
      sigma_of_(std::move(sigma_of)) {}

FalseColours FrameMaker::InFalseColour() {
  const Drawn drawn{Result(), picture_.scene, picture_.camera, picture_.options, colours_};
  if (picture_.shown == Shown::kWireframe) return {wireframe_.Draw(drawn), {}};
  return FalseColour(picture_.shown, drawn, sigma_of_);
}

ImageRgb8 FrameMaker::Image() {
  return picture_.shown == Shown::kColour ? Result().image : InFalseColour().image;
}

void FrameMaker::MakeMoving(const FrameRequest& order, int divisor) {
  Make(order, divisor, ViewStream::Wait::kForNone);
  picture_.whole = false;
}

void FrameMaker::MakeStill(const FrameRequest& order) {
  stream_.ShowFrame(order.time_step);
  stream_.Hide(order.hidden);
  stream_.Prefetch(order.camera.cam_from_world, order.options, PixelsFor(order));
  // Once nothing is on its way it is the image that dtr render makes.
  const bool whole = stream_.reading() == 0;
  Make(order, 1, whole ? ViewStream::Wait::kForAll : ViewStream::Wait::kForNone);
  picture_.whole = whole;
}

void FrameMaker::ReadAhead(const FrameRequest& order) {
  stream_.ShowFrame(order.time_step);
  stream_.Hide(order.hidden);
  stream_.Prefetch(order.camera.cam_from_world, order.options, PixelsFor(order));
  stream_.ShowFrame(picture_.time_step);
  stream_.Hide(hidden_);
}

RenderScene FrameMaker::SceneFor(const FrameRequest& order, const PinholeCamera& camera,
                                 ViewStream::Wait wait) {
  const Pose& pose = order.camera.cam_from_world;
  RenderScene scene = stream_.SceneFor(pose, order.options, wait, PixelsFor(order));
  if (renderer_.CanDraw(scene, camera, pose, order.options)) return scene;
  // Other options than what was made of the released pixels is for.
  return stream_.SceneFor(pose, order.options, wait);
}

void FrameMaker::Make(const FrameRequest& order, int divisor, ViewStream::Wait wait) {
  Laps laps;
  result_.reset();
  // What is thrown from here on leaves no figures of another scene behind.
  picture_.views_used.clear();
  picture_.whole = false;
  // Of another time step nothing is there yet that could be shown meanwhile.
  if (std::exchange(picture_.time_step, order.time_step) != order.time_step) {
    wait = ViewStream::Wait::kForAll;
  }
  stream_.ShowFrame(order.time_step);
  hidden_ = order.hidden;
  stream_.Hide(hidden_);
  const Pose& pose = order.camera.cam_from_world;
  picture_.camera = {Smaller(order.camera.camera, divisor), pose};
  picture_.scene = SceneFor(order, picture_.camera.camera, wait);
  picture_.divisor = divisor;
  picture_.shown = order.shown;
  picture_.options = order.options;
  picture_.ms.views = laps.Lap();
  const gl::DrawnFrame drawn =
      renderer_.Draw(picture_.scene, picture_.camera.camera, pose, order.options);
  gl::WaitForGpu();
  picture_.views_used = drawn.views_used;
  picture_.ms.draw = laps.Lap();
  Show(order, drawn, divisor == 1);
  if (drawn.views_held && PixelsFor(order) == ViewStream::Pixels::kOrReleased) ReleasePixels();
  picture_.ms.inspect = laps.Lap();
}

void FrameMaker::ReleasePixels() {
  for (const int index : picture_.views_used) {
    const View& view = *picture_.scene.views[static_cast<size_t>(index)];
    if (view.image.empty()) continue;
    ThumbnailOf(view);
    stream_.Release(view);
  }
}

const ImageRgb8* FrameMaker::ThumbnailOf(const View& view) {
  const auto found = thumbnails_.find(&view);
  if (found != thumbnails_.end()) return &found->second;
  if (view.image.empty()) return nullptr;
  return &(thumbnails_[&view] = report::Shrink(view.image, kThumbnailPx));
}

void FrameMaker::BringPixels() {
  const auto there = [this](int index) {
    return !picture_.scene.views[static_cast<size_t>(index)]->image.empty();
  };
  const std::vector<int>& used = picture_.views_used;
  if (std::all_of(used.begin(), used.end(), there)) return;
  const RenderScene scene =
      stream_.SceneFor(picture_.camera.cam_from_world, picture_.options, ViewStream::Wait::kForAll);
  if (scene.views != picture_.scene.views) {
    throw Error(
        "image: expected its views to be there still, found one that cannot be read any "
        "more; is the set's disk there?");
  }
}

void FrameMaker::Show(const FrameRequest& order, const gl::DrawnFrame& drawn, bool still) {
  picture_.scale.reset();
  if (order.shown != Shown::kColour) {
    const FalseColours colours = InFalseColour();
    picture_.texture.Upload(colours.image);
    picture_.scale = colours.scale;
  } else if (NeedsFinishing(order.options)) {
    Result();
    FinishImage(picture_.scene, picture_.camera.camera, picture_.camera.cam_from_world,
                order.options, *result_);
    picture_.texture.Upload(result_->image);
  } else {
    picture_.texture.Take(drawn);
  }
  if (still) picture_.coverage = Result().coverage_share;
}

double FrameMaker::CoverageOf(const FrameRequest& order) {
  constexpr int kLongSidePx = 160;
  if (!picture_.texture.empty()) Result();  // before the renderer forgets it
  const PinholeCamera& window = order.camera.camera;
  const int side_px = std::max(window.width_px(), window.height_px());
  const PinholeCamera camera = Smaller(window, std::max(1, side_px / kLongSidePx));
  stream_.ShowFrame(order.time_step);
  stream_.Hide(order.hidden);
  const RenderScene scene = SceneFor(order, camera, ViewStream::Wait::kForAll);
  return renderer_.Render(scene, camera, order.camera.cam_from_world, order.options).coverage_share;
}

void FrameMaker::MakeOther(const RenderOptions& options) {
  Result();  // before the renderer forgets it
  BringPixels();
  const NovelCamera& camera = picture_.camera;
  const RenderScene scene =
      stream_.SceneFor(camera.cam_from_world, options, ViewStream::Wait::kForAll);
  if (!NeedsFinishing(options)) {
    other_.Take(renderer_.Draw(scene, camera.camera, camera.cam_from_world, options));
    return;
  }
  other_.Upload(renderer_.Render(scene, camera.camera, camera.cam_from_world, options).image);
}

const RenderResult& FrameMaker::Result() {
  if (!result_) result_ = renderer_.ReadBack();
  return *result_;
}

}  // namespace dtr::viewer
