#include "viewer/glfw/path_tools.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <exception>
#include <system_error>
#include <utility>

#include "dtr/base/delete.h"
#include "dtr/render/time_steps.h"
#include "viewer/glfw/error_text.h"

namespace dtr::viewer {

namespace fs = std::filesystem;

PathTools::~PathTools() {
  if (recording_) DropRecording();
}

void PathTools::AddKey(const NovelCamera& camera, const DtrSet& set) {
  const Writing writing(host_);
  try {
    flight_.AddKey(camera);
    tell_("added to " + saver_.SavePath(flight_.keys(), set).string());
  } catch (const std::exception& error) {
    tell_(Said(error));
  }
}

void PathTools::Load(const fs::path& file, const DtrSet& set) {
  try {
    flight_.Replace(host_.read_path(set, file));
    saver_.BeginNewPath();
    tell_(fmt::format("{}: {} cameras", file.string(), flight_.keys().size()));
  } catch (const std::exception& error) {
    tell_(Said(error));
  }
}

void PathTools::StartOrStopRecording(const PinholeCamera& like, const DtrSet& set) {
  if (recording_) return Abort("stopped by hand");
  try {
    std::vector<NovelCamera> frames = flight_.Frames(like);
    if (frames.empty()) {
      return tell_("a video needs a path: K adds cameras to it, O loads one from a file");
    }
    writing_.emplace(host_);
    const fs::path video = saver_.NameVideo(frames, set);
    flight_.Stop();
    recording_ = std::make_unique<Recording>(video, std::move(frames));
  } catch (const std::exception& error) {
    writing_.reset();
    tell_(Said(error));
  }
}

std::string PathTools::Progress() const {
  if (!recording_) return "";
  if (!recording_->Wanted()) return "encoding " + recording_->target().filename().string();
  return fmt::format("recording {} of {}", recording_->drawn() + 1, recording_->frames());
}

size_t PathTools::WantedFrame(size_t frames) const {
  return TimeStepOfImage(recording_->drawn(), recording_->frames(), frames);
}

void PathTools::Filmed(const ImageRgb8& picture) {
  try {
    recording_->Add(picture);
  } catch (const std::exception& error) {
    Abort(Said(error));
  }
}

void PathTools::Tend() {
  if (!recording_) return;
  try {
    if (!recording_->Done()) return;
    tell_(fmt::format("saved {} ({} frames)", recording_->target().string(), recording_->frames()));
    recording_.reset();
    writing_.reset();
  } catch (const std::exception& error) {
    Abort(Said(error));
  }
}

fs::path PathTools::DropRecording() {
  const fs::path target = recording_->target();
  recording_.reset();
  TryRemoveFile(target);  // its name was free when it was chosen; it may be finished by now
  TryRemoveFile(fs::path(target).replace_extension(".json"));
  writing_.reset();
  return target;
}

void PathTools::Abort(const std::string& why) {
  const fs::path target = DropRecording();
  tell_(target.string() + ": not recorded: " + why);
}

void PathDialog::Open() {
  open_ = focus_ = true;
  files_.clear();
  std::fill(text_.begin(), text_.end(), char{0});
  std::error_code error;
  for (fs::directory_iterator it(folder_, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    const bool path =
        name.find("-path-") != std::string::npos || name.find("-video-") != std::string::npos;
    if (path && it->path().extension() == ".json") files_.push_back(it->path());
  }
  std::sort(files_.begin(), files_.end());
}

std::optional<fs::path> PathDialog::Draw(UserInterface& interface) {
  std::optional<fs::path> chosen;
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({0.5F * display.x, 0.3F * display.y}, ImGuiCond_Always, {0.5F, 0});
  constexpr auto kFlags = ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_AlwaysAutoResize |
                          ImGuiWindowFlags_NoCollapse;
  if (ImGui::Begin("Load a path", &open_, kFlags)) {
    if (std::exchange(focus_, false)) ImGui::SetKeyboardFocusHere();
    constexpr float kFieldWidth = 420;
    ImGui::SetNextItemWidth(kFieldWidth);
    const bool entered =
        ImGui::InputText("file", text_.data(), text_.size(), ImGuiInputTextFlags_EnterReturnsTrue);
    if ((entered || ImGui::Button("load")) && text_.front() != 0) chosen = text_.data();
    for (const fs::path& file : files_) {
      if (ImGui::Selectable(file.filename().string().c_str())) chosen = file;
    }
    if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape))) open_ = false;
  }
  interface.ThisPanelIsOurs();
  ImGui::End();
  if (chosen) open_ = false;
  return chosen;
}

}  // namespace dtr::viewer
