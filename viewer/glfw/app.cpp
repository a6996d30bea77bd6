#include "viewer/glfw/app.h"

// epoxy's header must come before any other GL header.
#include <epoxy/gl.h>
// clang-format keeps this group apart.
#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <exception>
#include <memory>
#include <utility>

#include "dtr/base/error.h"
#include "dtr/base/machine.h"
#include "dtr/gl/glfw/window.h"
#include "dtr/io/video.h"
#include "viewer/glfw/error_text.h"
#include "viewer/glfw/file_saver.h"
#include "viewer/glfw/panel.h"
#include "viewer/glfw/path_tools.h"
#include "viewer/glfw/run_figures.h"
#include "viewer/glfw/session.h"
#include "viewer/glfw/user_interface.h"
#include "viewer/glfw/writing.h"
#include "viewer/time_player.h"

namespace dtr::viewer {
namespace {

constexpr double kIdleSeconds = 0.25, kReadingSeconds = 0.02;  // between looks when nothing happens
constexpr double kWatchSeconds = 0.5;  // between looks whether the set on the disk is another
constexpr int kSettlingFrames = 3;     // ImGui needs some to show what a click changed
constexpr char kOutside[] = "most of this was not photographed; Home leads back";

class App {
 public:
  App(const AppSettings& settings, const Host& host)
      : settings_(settings),
        host_(host),
        window_({settings.width_px, settings.height_px, settings.title, true}),
        interface_(window_.handle()),
        saver_(settings.output, settings.output_stem),
        paths_(host, saver_, [this](const std::string& line) { Tell(line); }),
        path_dialog_(settings.output),
        stamp_(host.stamp ? host.stamp() : ""),
        session_(OpenSession()),
        options_(settings.render),
        panel_(settings.panel) {
    glfwSwapInterval(1);
    FitToWindow();
    Inspection& inspection = session_->inspector.inspection();
    inspection.cameras = settings.cameras;
    if (settings.photo) inspection.compared = Compared::kPhoto;
    if (settings.start) controller().StartAt(*settings.start);
    session_->ShowTimeStep(settings.time_step);
    if (settings.play_time) PlayOrStop();
    if (!settings.warning.empty()) message_ = settings.warning;
  }

  AppReport Run() {
    Stopwatch since_last;
    while (!window_.CloseRequested() && !quit_ && !StopRequested()) {
      const Stopwatch frame;
      const double cpu_ms = ProcessCpuMilliseconds();
      const double passed = since_last.seconds();
      since_last.Restart();
      WatchSet();
      HandleInput();
      FitToWindow();
      Fly(passed);
      session_->ShowTimeStep(time_.Advance(passed, session_->clock(), session_->time_step()));
      const bool drew_moving = session_->schedule.Make(Order(), Pace());
      if (time_.playing()) ReadNextTimeStep();
      const Stopwatch of_window;
      Film();
      DrawInterface();
      KeepWhatWasAskedFor();
      window_.Present();
      window_ms_ = 1e3 * of_window.seconds();
      if (drew_moving) CountMoving(1e3 * frame.seconds(), ProcessCpuMilliseconds() - cpu_ms);
      FinishFrame();
    }
    if (StopRequested() && paths_.recording()) paths_.Abort("interrupted");
    AppReport report = figures_.report();
    report.last = State();
    report.view_bytes = session_->opened().stream->decoded_bytes();
    report.view_bytes_held = session_->opened().stream->bytes();
    return report;
  }

 private:
  Controller& controller() { return session_->controller; }

  bool StopRequested() const { return host_.stop_requested && host_.stop_requested(); }

  void Tell(const std::string& line) {
    message_ = line;
    if (host_.say) host_.say(line);
  }

  std::unique_ptr<Session> OpenSession() {
    return std::make_unique<Session>(
        settings_, host_, [this](const std::string& line) { Tell(line); }, settings_.width_px,
        settings_.height_px);
  }

  /// Another set on the disk takes the place of this one; a broken or vanished one does not.
  void WatchSet() {
    if (!host_.stamp || since_watch_.seconds() < kWatchSeconds) return;
    since_watch_.Restart();
    session_->RetryLostViews();
    if (std::exchange(stamp_, host_.stamp()) == stamp_) return;
    try {
      std::unique_ptr<Session> next = OpenSession();
      FitToWindow(*next);
      paths_.flight().MoveWorld(next->ContinueFrom(*session_));
      if (paths_.recording()) paths_.Abort("the set on the disk changed");
      session_ = std::move(next);
      ++reloads_;
      Tell("the set on the disk changed and was read again");
    } catch (const std::exception& error) {
      Tell(Said(error) + " (the window goes on with what it has read)");
    }
    settling_ = kSettlingFrames;
  }

  void FitToWindow() { FitToWindow(*session_); }
  void FitToWindow(Session& session) {
    int width_px = 0, height_px = 0;
    glfwGetFramebufferSize(window_.handle(), &width_px, &height_px);
    if (width_px <= 0 || height_px <= 0) return;  // minimised
    const PinholeCamera& lens = session.controller.camera().camera;
    if (lens.width_px() != width_px || lens.height_px() != height_px) {
      session.controller.Resize(width_px, height_px);
    }
  }

  void HandleInput() {
    if (interface_.TakeAnyInput()) settling_ = kSettlingFrames;
    for (const UserInput& input : interface_.Take()) {
      if (const auto* key = std::get_if<ActionInput>(&input)) {
        if (key->action == Action::kMark) {
          session_->inspector.MarkAt(key->cursor_px);
        } else {
          Do(key->action);
        }
      } else if (const auto* dropped = std::get_if<FileInput>(&input)) {
        paths_.Load(dropped->file, session_->opened().set);
      } else {
        const auto& event = std::get<InputEvent>(input);
        const bool by_hand = std::holds_alternative<ButtonEvent>(event) ||
                             std::holds_alternative<ScrollEvent>(event) ||
                             std::holds_alternative<FlyEvent>(event);
        if (by_hand) paths_.flight().Stop();
        controller().Handle(event);
      }
    }
  }

  void Do(Action action) {
    Inspection& inspection = session_->inspector.inspection();
    switch (action) {
      case Action::kNextView:
        return controller().StepViews(1);
      case Action::kPreviousView:
        return controller().StepViews(-1);
      case Action::kNearestView:
        return controller().GoToNearestView();
      case Action::kShowAll:
        return ShowAll();
      case Action::kHome:
        return controller().GoTo(controller().home());
      case Action::kHelp:
        help_ = !help_;
        return;
      case Action::kPanel:
        panel_ = !panel_;
        return;
      case Action::kSaveImage:
        save_picture_ = true;
        return;
      case Action::kSaveWindow:
        save_window_ = true;
        return;
      case Action::kCopyCommand:
        copy_command_ = true;
        return;
      case Action::kCameras:
        inspection.cameras = !inspection.cameras;
        return;
      case Action::kMagnifier:
        inspection.magnifier = !inspection.magnifier;
        return;
      case Action::kCompare: {
        const auto next = static_cast<size_t>(inspection.compared) + 1;
        inspection.compared = kAllCompared[next % kAllCompared.size()];
        return;
      }
      case Action::kHideView:
        if (const auto nearest = controller().nearest_source()) {
          inspection.Toggle(*controller().surroundings().views[*nearest]);
        }
        return;
      case Action::kMark:
        return session_->inspector.MarkAt(interface_.cursor_px());
      case Action::kAddKey:
        return paths_.AddKey(controller().camera(), session_->opened().set);
      case Action::kOpenPath:
        return path_dialog_.Open();
      case Action::kFlyPath:
        if (paths_.flight().keys().empty() && session_->clock().frames() > 1) return PlayOrStop();
        return paths_.flight().StartOrStop(controller().camera().camera);
      case Action::kRecord:
        return paths_.StartOrStopRecording(controller().camera().camera, session_->opened().set);
      case Action::kNextTimeStep:
        return StepTimeStep(1);
      case Action::kPreviousTimeStep:
        return StepTimeStep(-1);
      case Action::kPlayTime:
        return PlayOrStop();
      case Action::kSlower:
        return SetSpeed(time_.speed / 2);
      case Action::kFaster:
        return SetSpeed(time_.speed * 2);
      case Action::kNextShown:
        return StepShown(1);
      case Action::kPreviousShown:
        return StepShown(-1);
      case Action::kQuit:
        quit_ = true;
        return;
    }
  }

  void ShowAll() {
    try {
      controller().GoTo(session_->Overview(Order()));
    } catch (const std::exception& error) {
      Tell(Said(error));
    }
  }

  void StepShown(int by) {
    const auto count = static_cast<int>(kAllShown.size());
    const auto at = std::find(kAllShown.begin(), kAllShown.end(), shown_) - kAllShown.begin();
    shown_ = kAllShown[static_cast<size_t>((static_cast<int>(at) + by + count) % count)];
  }

  void StepTimeStep(int by) {
    const auto count = static_cast<int>(session_->clock().frames());
    time_.Stop();
    session_->ShowTimeStep(
        static_cast<size_t>((static_cast<int>(session_->time_step()) + by + count) % count));
  }

  void PlayOrStop() {
    if (session_->clock().frames() > 1) return time_.StartOrStop();
    Tell(
        "only dynamic sets can be played: this one has a single time step (dtr join makes moving "
        "sets)");
  }

  void SetSpeed(double speed) {
    time_.speed = std::clamp(speed, TimePlayer::kMinSpeed, TimePlayer::kMaxSpeed);
    Tell(fmt::format("time runs {} times as fast", time_.speed));
  }

  /// In the background, so that it is there when its turn comes.
  void ReadNextTimeStep() {
    FrameRequest next = Order();
    next.time_step = (next.time_step + 1) % session_->clock().frames();
    next.hidden = session_->HiddenAt(next.time_step);
    session_->maker.ReadAhead(next);
  }

  /// Where the camera is this frame, unless a hand moves it.
  void Fly(double passed_s) {
    if (playing()) {
      controller().JumpTo(settings_.play[played_++ % settings_.play.size()]);
    } else if (const NovelCamera* wanted = paths_.Wanted()) {
      controller().JumpTo(*wanted);
      time_.Stop();
      session_->ShowTimeStep(paths_.WantedFrame(session_->clock().frames()));
    } else if (const auto flown = paths_.flight().Advance(passed_s, io::kVideoFramesPerSecond)) {
      controller().JumpTo(*flown);
    }
    controller().Advance(passed_s);
  }

  bool playing() const {
    return played_ < settings_.play.size() * static_cast<size_t>(settings_.laps);
  }

  FrameSchedule::Pace Pace() const {
    if (paths_.Wanted()) return FrameSchedule::Pace::kWhole;
    // A hand that holds still in the middle of a drag will go on.
    const bool moves = CameraMoves() || session_->controller.dragging() || time_.playing();
    return moves ? FrameSchedule::Pace::kMoving : FrameSchedule::Pace::kResting;
  }

  /// By itself: there is another image with the next frame.
  bool CameraMoves() const {
    return playing() || paths_.Wanted() || paths_.flight().flying() ||
           session_->controller.moving();
  }

  FrameRequest Order() const {
    const NovelCamera* wanted = paths_.Wanted();  // of its own size, whatever the window's is now
    return {wanted ? *wanted : session_->controller.camera(),
            options_,
            shown_,
            session_->time_step(),
            session_->inspector.inspection().hidden,
            session_->inspector.inspection().LooksAtPixels()};
  }

  bool whole() const { return session_->schedule.WholeFor(Order()); }

  /// Less than half as much was photographed as of the best image so far.
  bool IsOutside() const {
    return whole() && session_->maker.picture().coverage < 0.5 * best_coverage_;
  }

  /// Gives the video its image once that is whole.
  void Film() {
    paths_.Tend();
    if (!paths_.Wanted()) return;
    if (const auto& rejection = session_->schedule.rejection()) return paths_.Abort(*rejection);
    if (whole()) paths_.Filmed(session_->maker.Image());
  }

  void DrawInterface() {
    if (whole()) best_coverage_ = std::max(best_coverage_, session_->maker.picture().coverage);
    session_->inspector.Look(whole(), options_, interface_.cursor_px());
    interface_.BeginFrame();
    const MadeFrame& picture = session_->maker.picture();
    if (!picture.texture.empty()) {
      const auto id = static_cast<std::intptr_t>(picture.texture.name());
      ImGui::GetBackgroundDrawList()->AddImage(reinterpret_cast<ImTextureID>(id), {0, 0},
                                               ImGui::GetIO().DisplaySize);
    }
    session_->inspector.Draw(options_);
    std::vector<Action> pressed;
    controls_.clear();
    if (panel_) {
      const size_t time_step = session_->time_step();
      PanelModel model{picture,
                       controller(),
                       options_,
                       session_->opened().defaults,
                       shown_,
                       session_->inspector.inspection(),
                       session_->maker.colours(),
                       paths_.flight(),
                       {static_cast<int>(session_->clock().frames()), static_cast<int>(time_step),
                        session_->clock().StartOf(time_step), time_},
                       paths_.Progress(),
                       message_,
                       window_ms_,
                       moving_fps_,
                       {},
                       {}};
      DrawPanel(interface_, model);
      pressed = std::move(model.pressed);
      controls_ = std::move(model.controls);
      session_->ShowTimeStep(static_cast<size_t>(model.time.time_step));
    }
    if (picture.scale) {
      DrawScale(interface_, *picture.scale, session_->inspector.inspection().unit);
    }
    if (help_) DrawHelp(interface_, help_);
    if (path_dialog_.open()) {
      if (const auto file = path_dialog_.Draw(interface_)) {
        paths_.Load(*file, session_->opened().set);
      }
    }
    const std::string progress = paths_.Progress();
    std::string foot = progress.empty() ? message_ : progress;
    if (IsOutside()) foot += (foot.empty() ? "" : "\n") + std::string(kOutside);
    if (!foot.empty()) DrawMessage(interface_, foot);
    interface_.EndFrame();
    for (const Action action : pressed) Do(action);
  }

  /// What is kept is of whole images: it waits for one.
  void KeepWhatWasAskedFor() {
    const bool last_frame = ReachedFrames();
    if (!whole()) return;
    const Writing writing(host_);
    try {
      if (std::exchange(copy_command_, false)) CopyCommand();
      if (std::exchange(save_picture_, false)) {
        Tell("saved " + saver_.SaveImage(session_->maker).string());
      }
      if (std::exchange(save_window_, false)) {
        Tell("saved " + saver_.SaveWindow(window_.handle()).string());
      }
      if (last_frame && !settings_.screenshot.empty()) {
        SaveWindowAs(settings_.screenshot, window_.handle());
      }
    } catch (const std::exception& error) {
      Tell(Said(error));
      if (last_frame) throw;  // a script asked for it
    }
  }

  void CopyCommand() {
    const Inspection& inspection = session_->inspector.inspection();
    const FrameRequest order = Order();
    ToDraw wanted{saver_.SaveCamera(order.camera, session_->opened().set),
                  order.options,
                  order.hidden,
                  {},
                  shown_ == Shown::kDepth,
                  shown_ == Shown::kCoverage};
    if (session_->clock().frames() > 1) wanted.time_step = session_->time_step();
    const std::string command = host_.command_line(session_->opened(), wanted);
    glfwSetClipboardString(window_.handle(), command.c_str());
    Tell(command + WhatACommandLeavesOut(shown_, inspection.compared));
  }

  /// Throws Error where the last frame's image could not be made: nobody is there to see why.
  bool ReachedFrames() const {
    const bool last = LastFrame();
    if (last && session_->schedule.rejection()) throw Error(*session_->schedule.rejection());
    return last && whole() && settling_ <= 0 && !session_->inspector.reading();
  }

  /// As many frames as were asked for are drawn; a whole image may still be to come.
  bool LastFrame() const {
    return settings_.frames > 0 && figures_.frames() + 1 >= settings_.frames && !playing();
  }

  void CountMoving(double ms, double cpu_ms) {
    session_->schedule.MovingTook(ms);
    moving_fps_ = 1e3 / ms;
    figures_.Moved(session_->maker.picture().divisor, ms, cpu_ms);
  }

  void FinishFrame() {
    if (LastFrame()) time_.Stop();  // what is kept is of an image that stands still
    if (ReachedFrames()) quit_ = true;
    --settling_;
    const bool any =
        session_->schedule.has_picture() && !session_->maker.picture().views_used.empty();
    figures_.EndFrame(any, whole());
    // Told once what came of the last input shows: keys pressed at once are then taken again, of
    // which a dialog that has just closed would keep those that come before ImGui's next frame.
    if (whole() && settling_ <= 0 && host_.state_changed) {
      const Writing writing(host_);
      host_.state_changed(State());
    }
    if (quit_ || settling_ > 0 || CameraMoves() || !session_->schedule.MadeFor(Order())) return;
    if (!time_.playing()) moving_fps_ = 0;
    // A still image is due soon, or when its views have been read; a video is nearly there; so
    // is the next time step.
    const bool due = session_->schedule.Due() || paths_.recording() || time_.playing() ||
                     session_->inspector.reading();
    glfwWaitEventsTimeout(due ? kReadingSeconds : kIdleSeconds);
  }

  AppState State() const {
    AppState state;
    session_->Describe(state);
    state.frames = figures_.frames();
    state.still = whole();
    state.shown = NameOf(shown_);
    state.help = help_;
    state.panel = panel_;
    state.path_keys = static_cast<int>(paths_.flight().keys().size());
    state.frames_per_key = paths_.flight().frames_per_key;
    state.recording = paths_.recording();
    state.asks_for_path = path_dialog_.open();
    state.reloads = reloads_;
    state.controls = controls_;
    state.playing_time = time_.playing();
    state.time_speed = time_.speed;
    state.loops_time = time_.loop;
    state.message = message_;
    state.render = options_;
    return state;
  }

  RunFigures figures_;  // first: it times what follows, too
  const AppSettings& settings_;
  const Host& host_;
  std::string message_;
  gl::Window window_;
  UserInterface interface_;
  FileSaver saver_;
  PathTools paths_;
  PathDialog path_dialog_;
  std::string stamp_;  ///< of the set that was opened, or tried to be, last
  Stopwatch since_watch_;
  std::unique_ptr<Session> session_;
  int reloads_ = 0;
  RenderOptions options_;
  Shown shown_ = Shown::kColour;
  TimePlayer time_;
  std::vector<ControlPlace> controls_;
  bool panel_, help_ = false, quit_ = false;
  bool save_picture_ = false, save_window_ = false, copy_command_ = false;
  size_t played_ = 0;
  int settling_ = kSettlingFrames;
  double window_ms_ = 0, moving_fps_ = 0, best_coverage_ = 0;
};

}  // namespace

AppReport RunViewer(const AppSettings& settings, const Host& host) {
  App app(settings, host);
  return app.Run();
}

}  // namespace dtr::viewer
