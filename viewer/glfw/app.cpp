#include "viewer/glfw/app.h"

// epoxy's header must come before any other GL header.
#include <epoxy/gl.h>
// clang-format keeps this group apart.
#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <map>
#include <utility>

#include "dtr/base/error.h"
#include "dtr/base/machine.h"
#include "dtr/gl/glfw/window.h"
#include "viewer/glfw/inspection.h"
#include "viewer/glfw/keeper.h"
#include "viewer/glfw/panel.h"
#include "viewer/glfw/picture_maker.h"
#include "viewer/glfw/user_interface.h"
#include "viewer/governor.h"

namespace dtr::viewer {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kMovingTargetMs = 60;  // with the window's own work about 15 frames per second
constexpr double kStillAfterSeconds = 0.15;
constexpr double kIdleSeconds = 0.25, kReadingSeconds = 0.02;  // between looks when nothing happens
constexpr int kSettlingFrames = 3;  // ImGui needs some to show what a click changed

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

bool SameOrder(const PictureOrder& a, const PictureOrder& b) {
  const Pose &p = a.camera.cam_from_world, &q = b.camera.cam_from_world;
  return a.camera.camera == b.camera.camera && p.translation == q.translation &&
         p.rotation.coeffs() == q.rotation.coeffs() && a.options == b.options &&
         a.shown == b.shown && a.hidden == b.hidden;
}

/// All but what only changes what pixels mean: it can wait for the whole picture.
bool SamePlace(const PictureOrder& a, PictureOrder b) {
  b.shown = a.shown;
  b.hidden = a.hidden;
  return SameOrder(a, b);
}

class App {
 public:
  App(const AppSettings& settings, const Host& host)
      : settings_(settings),
        host_(host),
        opened_(host.open([this](const std::string& line) { Tell(line); })),
        window_({settings.width_px, settings.height_px, settings.title, true}),
        interface_(window_.handle()),
        maker_(*opened_->stream, MakerSettings(),
               [this](const View& view) { return SigmaOfView(view); }),
        controller_(SurroundingsOf(opened_->set), settings.width_px, settings.height_px,
                    [this](const Eigen::Vector2d& pixel) { return DepthAt(pixel); }),
        keeper_(settings.output, settings.output_stem),
        options_(settings.render),
        panel_(settings.panel) {
    glfwSwapInterval(1);
    FitToWindow();
    inspection_.cameras = settings.cameras;
    if (settings.photo) inspection_.compared = Compared::kPhoto;
    inspection_.unit = opened_->set.unit == LengthUnit::kMetre ? "m" : "units";
    if (settings.start) controller_.JumpTo(*settings.start);
  }

  AppReport Run() {
    Clock::time_point last = Clock::now();
    while (!window_.CloseRequested() && !quit_) {
      const Clock::time_point start = Clock::now();
      const double cpu_ms = ProcessCpuMilliseconds();
      HandleInput();
      FitToWindow();
      Play();
      controller_.Advance(std::chrono::duration<double>(start - last).count());
      last = start;
      const bool drew_moving = MakePicture();
      const Clock::time_point before_window = Clock::now();
      DrawInterface();
      KeepWhatWasAskedFor();
      window_.Present();
      window_ms_ = 1e3 * SecondsSince(before_window);
      if (drew_moving) CountMoving(1e3 * SecondsSince(start), ProcessCpuMilliseconds() - cpu_ms);
      FinishFrame();
    }
    report_.last = State();
    report_.view_bytes = opened_->stream->bytes();
    return report_;
  }

 private:
  void Tell(const std::string& line) {
    message_ = line;
    if (host_.say) host_.say(line);
  }

  gl::RendererSettings MakerSettings() {
    gl::RendererSettings settings;
    settings.shader_folder = settings_.shader_folder;
    settings.gpu_bytes = settings_.gpu_bytes;
    settings.warn = [this](const std::string& line) { Tell(line); };
    return settings;
  }

  /// Read when first asked for and kept.
  const Grid<float>* SigmaOfView(const View& view) {
    const auto known = sigmas_.find(&view);
    if (known != sigmas_.end()) return &known->second;
    return &(sigmas_[&view] = host_.load_sigma(view));
  }

  void FitToWindow() {
    int width_px = 0, height_px = 0;
    glfwGetFramebufferSize(window_.handle(), &width_px, &height_px);
    if (width_px <= 0 || height_px <= 0) return;  // minimised
    const PinholeCamera& lens = controller_.camera().camera;
    if (lens.width_px() != width_px || lens.height_px() != height_px) {
      controller_.Resize(width_px, height_px);
    }
  }

  /// What the shown picture shows there, as plane z of the present camera.
  std::optional<double> DepthAt(const Eigen::Vector2d& pixel) {
    if (!made_ || refused_) return std::nullopt;
    const NovelCamera& shown = maker_.picture().camera;
    const PinholeCamera& now = controller_.camera().camera;
    const auto x = static_cast<int>(pixel.x() * shown.camera.width_px() / now.width_px());
    const auto y = static_cast<int>(pixel.y() * shown.camera.height_px() / now.height_px());
    const DepthImage& depth = maker_.Result().depth;
    if (!depth.Contains(x, y) || DepthImage::IsHole(depth(x, y))) return std::nullopt;
    const Eigen::Vector3d p_in_world = WorldPoint(shown, {x + 0.5, y + 0.5}, depth(x, y));
    const double z = (controller_.camera().cam_from_world * p_in_world).z();
    return z > 0 ? std::optional(z) : std::nullopt;
  }

  void HandleInput() {
    if (interface_.TakeAnyInput()) settling_ = kSettlingFrames;
    for (const UserInput& input : interface_.Take()) {
      if (const auto* key = std::get_if<ActionInput>(&input)) {
        if (key->action == Action::kMark) {
          to_mark_.push_back(key->cursor_px);
        } else {
          Do(key->action);
        }
      } else {
        controller_.Handle(std::get<InputEvent>(input));
      }
    }
  }

  void Do(Action action) {
    switch (action) {
      case Action::kNextView:
        return controller_.StepViews(1);
      case Action::kPreviousView:
        return controller_.StepViews(-1);
      case Action::kNearestView:
        return controller_.GoToNearestView();
      case Action::kShowAll:
        return controller_.ShowAll();
      case Action::kHelp:
        help_ = !help_;
        return;
      case Action::kPanel:
        panel_ = !panel_;
        return;
      case Action::kSavePicture:
        save_picture_ = true;
        return;
      case Action::kSaveWindow:
        save_window_ = true;
        return;
      case Action::kCopyCommand:
        copy_command_ = true;
        return;
      case Action::kCameras:
        inspection_.cameras = !inspection_.cameras;
        return;
      case Action::kMagnifier:
        inspection_.magnifier = !inspection_.magnifier;
        return;
      case Action::kCompare: {
        const auto next = static_cast<size_t>(inspection_.compared) + 1;
        inspection_.compared = kAllCompared[next % kAllCompared.size()];
        return;
      }
      case Action::kHideView:
        if (const auto nearest = controller_.nearest_view()) {
          inspection_.Toggle(*controller_.surroundings().views[*nearest]);
        }
        return;
      case Action::kMark:
        to_mark_.push_back(interface_.cursor_px());
        return;
      case Action::kAddKey:
        return AddKey();
      case Action::kNextShown:
        return StepShown(1);
      case Action::kPreviousShown:
        return StepShown(-1);
      case Action::kQuit:
        quit_ = true;
        return;
    }
  }

  void StepShown(int by) {
    const auto count = static_cast<int>(kAllShown.size());
    const auto at = std::find(kAllShown.begin(), kAllShown.end(), shown_) - kAllShown.begin();
    shown_ = kAllShown[static_cast<size_t>((static_cast<int>(at) + by + count) % count)];
  }

  void Play() {
    if (played_ >= settings_.play.size()) return;
    controller_.JumpTo(settings_.play[played_++]);
  }

  bool playing() const { return played_ < settings_.play.size(); }

  PictureOrder Order() const {
    return {controller_.camera(), options_, shown_, inspection_.hidden};
  }

  /// Returns true when it drew a moving picture.
  bool MakePicture() {
    const PictureOrder order = Order();
    const bool changed = !made_ || !SameOrder(order, *made_);
    if (made_ && !SamePlace(order, *made_)) last_change_ = Clock::now();
    const bool moving = playing() || controller_.moving() || (changed && made_) ||
                        SecondsSince(last_change_) < kStillAfterSeconds;
    try {
      // The very first picture need not wait for stillness.
      if (moving && made_) {
        if (!changed) return false;
        maker_.MakeMoving(order, governors_[static_cast<size_t>(shown_)].divisor());
        made_ = order;
        other_made_.reset();
        return true;
      }
      if (!changed && (maker_.picture().whole || refused_)) return false;
      maker_.MakeStill(order);
      refused_ = false;
      other_made_.reset();
      probed_.reset();
    } catch (const Error& error) {
      refused_ = true;
      refusal_ = error.what();
      Tell(refusal_);
    }
    made_ = order;
    return false;
  }

  /// What is shown beside and over the whole picture.
  void Inspect() {
    if (!whole()) {
      inspection_.under_cursor.reset();
      probed_.reset();
      return;
    }
    try {
      const auto other = OptionsOf(inspection_.compared, options_);
      if (other && !(other_made_ && *other_made_ == *other)) {
        maker_.MakeOther(*other);
        other_made_ = *other;
      }
      const Eigen::Vector2d cursor = interface_.cursor_px();
      if (cursor != last_cursor_) {
        last_cursor_ = cursor;
        cursor_rests_since_ = Clock::now();
      }
      const bool rests = SecondsSince(cursor_rests_since_) >= kStillAfterSeconds;
      if (inspection_.magnifier && rests && probed_ != cursor) {
        inspection_.under_cursor = ProbeAt(cursor);
        probed_ = cursor;
      }
      for (const Eigen::Vector2d& pixel : std::exchange(to_mark_, {})) {
        if (const auto probe = ProbeAt(pixel)) inspection_.Mark(*probe);
      }
    } catch (const Error& error) {
      inspection_.compared = Compared::kNothing;
      Tell(error.what());
    }
  }

  std::optional<Probe> ProbeAt(const Eigen::Vector2d& pixel) {
    const int x = static_cast<int>(std::floor(pixel.x()));
    const int y = static_cast<int>(std::floor(pixel.y()));
    const MadePicture& picture = maker_.picture();
    const DepthImage& depth = maker_.Result().depth;
    if (!depth.Contains(x, y) || DepthImage::IsHole(depth(x, y))) return std::nullopt;
    return ProbePixel(picture.scene, picture.camera, picture.options, x, y, depth(x, y),
                      [this](const View& view) { return SigmaOfView(view); });
  }

  void AskForVerdicts() {
    if (!inspection_.cameras || !host_.verdicts) return;
    if (!verdicts_coming_.valid() && !verdicts_asked_) {
      verdicts_asked_ = true;
      verdicts_coming_ = std::async(std::launch::async, host_.verdicts);
    }
    if (verdicts_coming_.valid() &&
        verdicts_coming_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
      try {
        verdicts_ = verdicts_coming_.get();
      } catch (const std::exception& error) {
        Tell(error.what());
      }
    }
  }

  void DrawOverlay() {
    AskForVerdicts();
    const auto nearest = controller_.nearest_view();
    if (inspection_.compared == Compared::kPhoto && nearest) {
      overlay_.DrawPhoto(inspection_, *controller_.surroundings().views[*nearest],
                         controller_.camera());
    } else if (other_made_ && inspection_.compared != Compared::kNothing) {
      overlay_.DrawCompared(inspection_, maker_.other());
    }
    if (inspection_.cameras) overlay_.DrawCameras(controller_, inspection_, verdicts_);
    overlay_.DrawMarks(inspection_, controller_.camera());
    if (inspection_.magnifier) overlay_.DrawMagnifier(inspection_, maker_.picture().texture);
  }

  void DrawInterface() {
    Inspect();
    interface_.BeginFrame();
    const MadePicture& picture = maker_.picture();
    if (!picture.texture.empty()) {
      const auto id = static_cast<std::intptr_t>(picture.texture.name());
      ImGui::GetBackgroundDrawList()->AddImage(reinterpret_cast<ImTextureID>(id), {0, 0},
                                               ImGui::GetIO().DisplaySize);
    }
    DrawOverlay();
    if (panel_) {
      PanelModel model{picture,  controller_, options_,    shown_, inspection_,
                       message_, window_ms_,  moving_fps_, {}};
      DrawPanel(interface_, model);
      for (const Action action : model.pressed) Do(action);
    }
    if (help_) DrawHelp(interface_, help_);
    if (!message_.empty()) DrawMessage(interface_, message_);
    interface_.EndFrame();
  }

  bool whole() const {
    return made_ && !refused_ && maker_.picture().whole && SameOrder(*made_, Order());
  }

  /// What is kept is of whole pictures: it waits for one.
  void KeepWhatWasAskedFor() {
    const bool last_frame = ReachedFrames();
    if (!whole()) return;
    try {
      if (std::exchange(copy_command_, false)) CopyCommand();
      if (std::exchange(save_picture_, false)) {
        Tell("saved " + keeper_.SavePicture(maker_).string());
      }
      if (std::exchange(save_window_, false)) {
        Tell("saved " + keeper_.SaveWindow(window_.handle()).string());
      }
      if (last_frame && !settings_.screenshot.empty()) {
        SaveWindowAs(settings_.screenshot, window_.handle());
      }
    } catch (const Error& error) {
      Tell(error.what());
      if (last_frame) throw;  // a script asked for it
    }
  }

  void AddKey() {
    try {
      const auto file = keeper_.AddToPath(controller_.camera(), opened_->set);
      Tell("added to " + file.string());
    } catch (const Error& error) {
      Tell(error.what());
    }
  }

  void CopyCommand() {
    const auto file = keeper_.SaveCamera(made_->camera, opened_->set);
    const std::string command = host_.command_line(file, options_, HiddenNames());
    glfwSetClipboardString(window_.handle(), command.c_str());
    Tell(command);
  }

  std::vector<std::string> HiddenNames() const {
    std::vector<std::string> names;
    for (const View* view : inspection_.hidden) names.push_back(view->name);
    return names;
  }

  /// Throws Error where the last frame's picture could not be made: nobody is there to see why.
  bool ReachedFrames() const {
    const bool last =
        settings_.frames > 0 && report_.last.frames + 1 >= settings_.frames && !playing();
    if (last && refused_) throw Error(refusal_);
    return last && whole() && settling_ <= 0;
  }

  void CountMoving(double ms, double cpu_ms) {
    governors_[static_cast<size_t>(maker_.picture().shown)].Drawn(maker_.picture().divisor, ms);
    moving_fps_ = 1e3 / ms;
    ++report_.moving_frames;
    report_.moving_ms += ms;
    report_.moving_cpu_ms += cpu_ms;
    report_.largest_divisor = std::max(report_.largest_divisor, maker_.picture().divisor);
  }

  void FinishFrame() {
    if (ReachedFrames()) quit_ = true;
    ++report_.last.frames;
    --settling_;
    if (whole() && !(report_.first_picture_ms > 0)) {
      report_.first_picture_ms = 1e3 * SecondsSince(started_);
    }
    if (whole() && host_.state_changed) host_.state_changed(State());
    const bool moves =
        playing() || controller_.moving() || !made_ || settling_ > 0 || !SameOrder(*made_, Order());
    if (moves || quit_) return;
    moving_fps_ = 0;
    // A still picture is due soon, or when its views have been read.
    const bool due = !refused_ && !maker_.picture().whole;
    glfwWaitEventsTimeout(due ? kReadingSeconds : kIdleSeconds);
  }

  AppState State() const {
    AppState state;
    const MadePicture& picture = maker_.picture();
    state.frames = report_.last.frames;
    state.still = whole();
    state.camera = controller_.camera();
    if (const auto at = controller_.at_view()) {
      state.at_view = controller_.surroundings().views[*at]->name;
    }
    state.shown = NameOf(shown_);
    state.divisor = picture.divisor;
    for (const int index : picture.views_used) {
      state.views_used.push_back(picture.scene.views[static_cast<size_t>(index)]->name);
    }
    state.coverage = picture.coverage;
    state.fly_speed = controller_.fly_speed();
    state.help = help_;
    state.panel = panel_;
    state.cameras = inspection_.cameras;
    state.magnifier = inspection_.magnifier;
    state.compared = NameOf(inspection_.compared);
    state.hidden = HiddenNames();
    state.distance = inspection_.DistanceText();
    if (inspection_.magnifier && inspection_.under_cursor) {
      for (const ProbeView& view : inspection_.under_cursor->views) {
        state.under_cursor.push_back(view.name);
      }
    }
    state.message = message_;
    state.render = options_;
    return state;
  }

  const Clock::time_point started_ = Clock::now();
  const AppSettings& settings_;
  const Host& host_;
  std::string message_;
  std::unique_ptr<OpenedSet> opened_;
  std::map<const View*, Grid<float>> sigmas_;
  gl::Window window_;
  UserInterface interface_;
  PictureMaker maker_;
  Controller controller_;
  Keeper keeper_;
  /// One each: some pictures cost several times as much as others.
  std::vector<ResolutionGovernor> governors_{kAllShown.size(), ResolutionGovernor(kMovingTargetMs)};
  RenderOptions options_;
  Shown shown_ = Shown::kColour;
  std::optional<PictureOrder> made_;  ///< what the shown picture was made for
  bool refused_ = false;              ///< it could not be made
  std::string refusal_;               ///< why
  Clock::time_point last_change_ = Clock::now();
  bool panel_, help_ = false, quit_ = false;
  bool save_picture_ = false, save_window_ = false, copy_command_ = false;
  Inspection inspection_;
  InspectionOverlay overlay_;
  std::optional<RenderOptions> other_made_;  ///< options of the other picture beside this one
  Eigen::Vector2d last_cursor_{-1, -1};
  std::optional<Eigen::Vector2d> probed_;  ///< where the cursor rested
  Clock::time_point cursor_rests_since_ = Clock::now();
  std::future<std::map<std::string, ViewVerdict>> verdicts_coming_;
  std::map<std::string, ViewVerdict> verdicts_;
  bool verdicts_asked_ = false;
  std::vector<Eigen::Vector2d> to_mark_;  ///< waits for a whole picture
  size_t played_ = 0;
  int settling_ = kSettlingFrames;
  double window_ms_ = 0, moving_fps_ = 0;
  AppReport report_;
};

}  // namespace

AppReport RunViewer(const AppSettings& settings, const Host& host) {
  App app(settings, host);
  return app.Run();
}

}  // namespace dtr::viewer
