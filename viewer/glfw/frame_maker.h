// viewer/glfw/frame_maker.h -- the images the window shows, drawn with the current context.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "dtr/gl/fitting_renderer.h"
#include "dtr/render/camera_path.h"
#include "dtr/render/view_stream.h"
#include "viewer/glfw/frame_texture.h"
#include "viewer/shown.h"
#include "viewer/wireframe.h"

namespace dtr::viewer {

inline constexpr int kThumbnailPx = 128;  ///< long side

/// What is asked for.
struct FrameRequest {
  NovelCamera camera;
  RenderOptions options;
  Shown shown = Shown::kColour;
  size_t time_step = 0;             ///< of a dynamic set: its frame
  std::vector<const View*> hidden;  ///< views of that time step not to draw from
  /// Something will look at the views' own pixels: they stay in memory. Else they go where the
  /// renderer holds what it made of them.
  bool inspected = false;
};

/// Milliseconds that each stage of an image took.
struct StageTimes {
  double views = 0;    ///< choosing and waiting for views
  double draw = 0;     ///< dtr/gl, until the GPU was done
  double inspect = 0;  ///< reading back, filling, false colours
};

/// An image with all that is known of it.
struct MadeFrame {
  FrameTexture texture;
  NovelCamera camera;  ///< as drawn: smaller than asked for by `divisor`
  int divisor = 1;
  bool whole = false;  ///< in full resolution, of all views that it needs
  Shown shown = Shown::kColour;
  size_t time_step = 0;
  RenderOptions options;
  RenderScene scene;
  std::vector<int> views_used;
  double coverage = 0;         ///< where the result was read back
  std::optional<Scale> scale;  ///< of false colours
  StageTimes ms;
};

class FrameMaker {
 public:
  /// The stream must outlive it.
  FrameMaker(ViewStream& stream, ViewColours colours, const gl::RendererSettings& settings,
             gl::Drawer drawer, SigmaOf sigma_of);

  const ViewColours& colours() const { return colours_; }

  /// Quickly: each side divided by `divisor`, of the views that are in memory.
  void MakeMoving(const FrameRequest& order, int divisor);
  /// In full, of the views that are there; whole once no view is being read any more.
  void MakeStill(const FrameRequest& order);

  /// Begins to read what the same image of another time step needs, as far as there is room.
  void ReadAhead(const FrameRequest& order);

  /// Share of the image's pixels that some view saw, of a small one.
  double CoverageOf(const FrameRequest& order);

  /// Another image of the same camera beside the whole one, with other options.
  void MakeOther(const RenderOptions& options);
  const FrameTexture& other() const { return other_; }

  const MadeFrame& picture() const { return picture_; }
  /// Brings the pixels of a whole image's views back into memory, for those who look at them.
  /// Throws dtr::Error where one cannot be read any more.
  void BringPixels();
  /// A small image of the view's photo; null until it was drawn from.
  const ImageRgb8* ThumbnailOf(const View& view);

  /// The image's pixels as they are kept: colours as `dtr render` writes them, else as shown.
  ImageRgb8 Image();
  /// Of the last image; the first call after it reads it back from the GPU.
  const RenderResult& Result();

 private:
  void Make(const FrameRequest& order, int divisor, ViewStream::Wait wait);
  RenderScene SceneFor(const FrameRequest& order, const PinholeCamera& camera,
                       ViewStream::Wait wait);
  void ReleasePixels();
  FalseColours InFalseColour();
  void Show(const FrameRequest& order, const gl::DrawnFrame& drawn, bool still);

  ViewStream& stream_;
  const ViewColours colours_;
  gl::FittingRenderer renderer_;
  const SigmaOf sigma_of_;
  Wireframe wireframe_;
  MadeFrame picture_;
  FrameTexture other_;
  std::optional<RenderResult> result_;
  std::vector<const View*> hidden_;  ///< from the image
  std::map<const View*, ImageRgb8> thumbnails_;
};

}  // namespace dtr::viewer
