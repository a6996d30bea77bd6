// viewer/glfw/app.h -- the window of `dtr view`; no GL, GLFW or ImGui header is needed to use it.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtr/render/camera_path.h"
#include "dtr/render/options.h"
#include "dtr/render/view_stream.h"
#include "dtr/types/dtr_set.h"

namespace dtr::viewer {

/// A set with what reads its pixels. Stays where it is: the stream points into the set.
struct OpenedSet {
  DtrSet set;
  std::unique_ptr<ViewStream> stream;
};

struct AppSettings {
  std::string title;
  int width_px = 1280, height_px = 800;
  RenderOptions render;
  size_t gpu_bytes = size_t{4} << 30;
  std::string shader_folder;                          ///< as gl::RendererSettings
  std::filesystem::path output = ".";                 ///< folder for what the user saves
  std::string output_stem = "view";                   ///< first part of those files' names
  bool panel = true, cameras = false, photo = false;  ///< shown from the start; photo: compared
  /// Cameras to fly along at once, one a frame, as while moving; empty: none.
  std::vector<NovelCamera> play;
  std::optional<NovelCamera> start;  ///< none: the first input camera
  int frames = 0;                    ///< close after so many, once the picture is whole; 0: never
  std::filesystem::path screenshot;  ///< of the window, written at the end; empty: none
};

/// What validation says of a view's calibration.
struct ViewVerdict {
  bool good = false;
  std::string text;  ///< one line
};

/// What the window shows just now.
struct AppState {
  int frames = 0;      ///< drawn so far
  bool still = false;  ///< the picture is whole, in full resolution and of all its views
  NovelCamera camera;
  std::string at_view;  ///< name of the input camera it is at; empty: none
  std::string shown;    ///< what the pixels mean: "colour", "depth", ...
  int divisor = 1;      ///< of the picture's sides
  std::vector<std::string> views_used;
  double coverage = 0;   ///< share of pixels that some view saw; of still pictures
  double fly_speed = 0;  ///< scene units per second
  bool help = false, panel = true, cameras = false, magnifier = false;
  std::string compared;                   ///< with what: "nothing", "nearest photo", ...
  std::vector<std::string> hidden;        ///< views left out
  std::vector<std::string> under_cursor;  ///< views that the magnifier names, largest share first
  std::string distance;                   ///< between two marks; empty: none
  std::string message;                    ///< the last one in the window
  RenderOptions render;
};

/// What the viewer leaves to the program around it.
struct Host {
  /// Reads the set anew. `note` is told of what is left out, on the thread that draws.
  std::function<std::unique_ptr<OpenedSet>(const std::function<void(const std::string&)>& note)>
      open;
  /// Sigmas of a view's inverse depth from the disk; empty where it has none.
  std::function<Grid<float>(const View&)> load_sigma;
  /// The command that draws the picture of the one camera in a file (cameras.json) without some
  /// views, by name.
  std::function<std::string(const std::filesystem::path& camera_file, const RenderOptions&,
                            const std::vector<std::string>& hidden)>
      command_line;
  /// What validation says of each view, by its name. Called on a thread of its own.
  std::function<std::map<std::string, ViewVerdict>()> verdicts;
  /// A line for whoever started the program.
  std::function<void(const std::string&)> say;
  /// Told whenever the window has a whole picture; null: nobody asks.
  std::function<void(const AppState&)> state_changed;
};

/// What a run of the viewer measured.
struct AppReport {
  AppState last;
  double first_picture_ms = 0;  ///< from the call of RunViewer to the first whole picture shown
  int moving_frames = 0;
  double moving_ms = 0, moving_cpu_ms = 0;  ///< of all moving frames together
  int largest_divisor = 1;
  size_t view_bytes = 0;  ///< decoded pixels in memory at the end
};

/// Shows the set until the window is closed. Throws dtr::Error where no window can be opened, the
/// display has no OpenGL 4.3 or the set cannot be opened at the start; later trouble is told in
/// the window. To be called on the program's first thread.
AppReport RunViewer(const AppSettings& settings, const Host& host);

}  // namespace dtr::viewer
