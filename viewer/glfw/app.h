// viewer/glfw/app.h -- the window of `dtr view`; no GL, GLFW or ImGui header is needed to use it.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtr/gl/fitting_renderer.h"
#include "dtr/render/camera_path.h"
#include "dtr/render/options.h"
#include "dtr/render/view_stream.h"
#include "dtr/types/dtr_set.h"

namespace dtr::viewer {

/// A set with what reads the pixels of all its frames. Stays where it is: the stream points into
/// the set.
struct OpenedSet {
  DtrSet set;
  RenderOptions defaults;  ///< what `dtr render` takes where nothing is said: the set's own
  std::unique_ptr<ViewStream> stream;
};

struct AppSettings {
  std::string title;
  std::string warning;  ///< the first message in the window; empty: none
  int width_px = 1280, height_px = 800;
  RenderOptions render;
  size_t gpu_bytes = 4'000'000'000;
  std::string shader_folder;  ///< as gl::RendererSettings
  gl::Drawer drawer = gl::Drawer::kFitting;
  std::filesystem::path output = ".";                 ///< folder for what the user saves
  std::string output_stem = "view";                   ///< first part of those files' names
  bool panel = true, cameras = false, photo = false;  ///< shown from the start; photo: compared
  std::vector<std::string> hidden;  ///< names of views that are left out from the start
  /// Cameras to fly along at once, one a frame, as while moving; empty: none.
  std::vector<NovelCamera> play;
  int laps = 1;                      ///< so many times
  std::optional<NovelCamera> start;  ///< none: OpeningView
  size_t time_step = 0;              ///< of a dynamic set: the frame shown first
  bool play_time = false;            ///< of a dynamic set: from there on
  int frames = 0;                    ///< close after so many, once the image is whole; 0: never
  int largest_divisor = 4;           ///< of the sides of images while moving
  std::filesystem::path screenshot;  ///< of the window, written at the end; empty: none
};

/// What validation says of a view's calibration.
struct ViewValidation {
  bool good = false;
  std::string text;  ///< one line
};

/// A control of the panel, or an entry of a list that is open: "blend", "blend=cosine". Pixels of
/// the window; what can be worked, without the words beside it.
struct ControlPlace {
  std::string name;
  float x = 0, y = 0, width = 0, height = 0;
  bool visible = false;  ///< not scrolled out of the panel
};

/// What the window shows just now.
struct AppState {
  int frames = 0;      ///< drawn so far
  bool still = false;  ///< the image is whole, in full resolution and of all its views
  NovelCamera camera;
  std::string at_view;       ///< name of the input camera it is at; empty: none
  bool at_held_out = false;  ///< that camera's photo is held out
  std::string photo;         ///< name of the view whose photo is beside the image; empty: none
  int thumbnails = 0;        ///< input cameras that are shown with their photo
  std::string shown;         ///< what the pixels mean: "colour", "depth", ...
  int divisor = 1;           ///< of the image's sides
  std::vector<std::string> views_used;
  double coverage = 0;   ///< share of pixels that some view saw; of still images
  double fly_speed = 0;  ///< scene units per second
  bool help = false, panel = true, cameras = false, magnifier = false;
  std::string compared;                   ///< with what: "nothing", "nearest photo", ...
  std::vector<std::string> hidden;        ///< views left out
  std::vector<std::string> under_cursor;  ///< views that the magnifier names, largest share first
  std::string distance;                   ///< between two marks; empty: none
  int path_keys = 0;                      ///< cameras of the path
  int frames_per_key = 0;                 ///< from one to the next
  int reloads = 0;                        ///< how often the set was read again
  size_t time_step = 0, time_steps = 1;   ///< of a dynamic set: the frame shown, of how many
  bool playing_time = false;              ///< one time step after the other
  double time_speed = 1;                  ///< seconds of a dynamic set that are played in a second
  bool loops_time = true;                 ///< played again after its last time step
  bool recording = false;
  bool asks_for_path = false;          ///< a window asks for a file
  std::vector<ControlPlace> controls;  ///< of the panel, from top to bottom
  std::string message;                 ///< the last one in the window
  RenderOptions render;
};

/// What a command line is to draw.
struct ToDraw {
  std::filesystem::path camera_file;  ///< cameras.json of one camera
  RenderOptions options;
  std::vector<const View*> hidden;  ///< views not to draw from
  std::optional<size_t> time_step;  ///< of a dynamic set: its frame
  /// Beside the colours: the depth, what was seen.
  bool depth = false, coverage = false;
};

/// What the viewer leaves to the program around it.
struct Host {
  /// Reads the set again; throws dtr::Error where it cannot.
  std::function<std::unique_ptr<OpenedSet>()> open;
  /// Differs whenever another set lies on the disk, or none: then it is read again. Cheap. Null:
  /// nothing is watched.
  std::function<std::string()> stamp;
  /// The cameras of a path file, in the set's stored world. Throws dtr::Error.
  std::function<std::vector<NovelCamera>(const DtrSet&, const std::filesystem::path&)> read_path;
  /// Sigmas of a view's inverse depth from the disk; empty where it has none.
  std::function<Grid<float>(const View&)> load_sigma;
  /// The photo of a view, source or held out. Called on a thread of its own; throws where it
  /// cannot.
  std::function<ImageRgb8(const View&)> load_photo;
  /// The command that draws an image.
  std::function<std::string(const OpenedSet&, const ToDraw&)> command_line;
  /// Differs whenever other files of a view lie on the disk; empty while one is missing. Cheap.
  /// Null: views that could not be read are never tried again.
  std::function<std::string(const View&)> view_stamp;
  /// What validation says of each view, by its name. Called on a thread of its own.
  std::function<std::map<std::string, ViewValidation>()> validations;
  /// A line for whoever started the program.
  std::function<void(const std::string&)> say;
  /// True once the window is to close at once, as its user would close it: a signal asks for that.
  /// Null: never.
  std::function<bool()> stop_requested;
  /// Told before a file is begun that must not be left half-written, and once it is whole or gone;
  /// null: nobody asks.
  std::function<void(bool)> writing;
  /// Told whenever the window has a whole image and shows what the last input did; null: nobody
  /// asks.
  std::function<void(const AppState&)> state_changed;
};

/// Moving frames together: time on the wall and of the processor, in milliseconds.
struct FrameTimes {
  int frames = 0;
  double ms = 0, cpu_ms = 0;
};

/// What a run of the viewer measured.
struct AppReport {
  AppState last;
  /// From the call of RunViewer to the first image shown that has something of the set, of
  /// whatever size, and to the first whole one: the first after a flight where it begins with one.
  double first_frame_ms = 0, first_frame_cpu_ms = 0;
  double first_whole_frame_ms = 0, first_whole_frame_cpu_ms = 0;
  FrameTimes moving;
  std::map<int, FrameTimes> moving_by_divisor;  ///< of the image's sides
  /// Physical memory held, sampled every so many frames: what grows shows.
  static constexpr int kFramesPerSample = 500;
  std::vector<size_t> memory_bytes;
  size_t view_bytes = 0;       ///< decoded pixels of the views drawn from at the end
  size_t view_bytes_held = 0;  ///< those of them that are in memory: the renderer may have its own
};

/// Shows the set until the window is closed, or the host asks for that: a video that is being
/// recorded then leaves nothing behind. Throws dtr::Error where no window can be opened, the
/// display has no OpenGL 4.3 or the set cannot be opened at the start; later errors are shown in
/// the window. To be called on the program's first thread.
AppReport RunViewer(const AppSettings& settings, const Host& host);

}  // namespace dtr::viewer
