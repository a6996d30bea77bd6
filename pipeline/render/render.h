// pipeline/render/render.h -- new views of a set, to files.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/eval/held_out.h"
#include "dtr/render/free_space.h"
#include "dtr/render/options.h"

namespace dtr::pipeline {

/// Where to look from: exactly one of the first four.
struct NovelCameraRequest {
  std::string like;                   ///< a view of the set
  std::filesystem::path camera_file;  ///< cameras.json with one camera
  std::filesystem::path path_file;    ///< cameras.json with several
  int fly_through_frames = 0;         ///< a path along the set's own cameras
  DepthLoader load_depth;             ///< for fly-throughs: depth of views not in memory
  std::string size;                   ///< "WxH"; 0 for either keeps the camera's proportions

  bool several() const { return !path_file.empty() || fly_through_frames > 0; }
};

struct RenderRequest {
  std::filesystem::path set;
  NovelCameraRequest cameras;
  std::string exclude;  ///< views not to render from: names, separated by commas
  std::optional<size_t>
      frame;          ///< of a dynamic set: the time step to show; a path runs through all
  bool play = false;  ///< of a dynamic set: every time step in turn, from one position
  std::filesystem::path output;        ///< one frame: an image; several: a folder or an .mp4 file
  std::filesystem::path depth_out;     ///< one frame: its depth as float EXR; empty: none
  std::filesystem::path coverage_out;  ///< one frame: what some view saw as PNG; empty: none
  RenderOptions render;
  bool force = false;          ///< images of several frames may replace files
  bool measured_only = false;  ///< drawn without completed depth
  double memory_gb = 4;        ///< for an image and views' pixels; others are read again

  bool several() const { return play || cameras.several(); }
};

struct RenderedFile {
  std::string file;
  double render_ms = 0;                 ///< wall clock
  size_t frame = 0;                     ///< the time step that it shows
  std::vector<std::string> views_used;  ///< names, nearest first
  double coverage = 0;                  ///< share of pixels that some view saw
};

struct RenderReport {
  std::vector<RenderedFile> frames;
  std::vector<std::pair<std::string, std::string>> skipped;  ///< views that could not be read, why
};

/// Renders the frames one after the other and writes each; pixels of views are read as they are
/// needed. What no view saw is transparent in a PNG unless it is filled. `make_renderer` gives any
/// renderer, as cpu::Render; it is called once, before anything is loaded. Throws UsageError for a
/// request that asks for what cannot be had together, Error for a broken set. A video that is
/// interrupted is not left behind; images are, as far as they go.
RenderReport Render(const RenderRequest& request,
                    const std::function<eval::RenderFunction()>& make_renderer, Progress& progress);
/// The same of a set that was read, `described`.
RenderReport Render(const RenderRequest& request, const DtrSet& described,
                    const std::function<eval::RenderFunction()>& make_renderer, Progress& progress);

}  // namespace dtr::pipeline
