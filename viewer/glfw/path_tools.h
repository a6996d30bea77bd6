// viewer/glfw/path_tools.h -- recording, loading, flying along and filming paths in the window.
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/flight.h"
#include "viewer/glfw/app.h"
#include "viewer/glfw/file_saver.h"
#include "viewer/glfw/recording.h"
#include "viewer/glfw/user_interface.h"
#include "viewer/glfw/writing.h"

namespace dtr::viewer {

/// The path and what is done with it. Trouble is told, not thrown.
class PathTools {
 public:
  PathTools(const Host& host, FileSaver& saver, std::function<void(const std::string&)> tell)
      : host_(host), saver_(saver), tell_(std::move(tell)) {}

  /// Leaves nothing behind of a recording that is not finished.
  ~PathTools();
  PathTools(const PathTools&) = delete;
  PathTools& operator=(const PathTools&) = delete;

  Flight& flight() { return flight_; }
  const Flight& flight() const { return flight_; }

  void AddKey(const NovelCamera& camera, const DtrSet& set);
  void Load(const std::filesystem::path& file, const DtrSet& set);
  /// Begins to film the path with images of the lens's size, or stops and keeps nothing.
  void StartOrStopRecording(const PinholeCamera& like, const DtrSet& set);
  bool recording() const { return recording_ != nullptr; }
  /// "recording 12 of 48"; empty while nothing is recorded.
  std::string Progress() const;

  /// The camera whose whole image is wanted for the video; null: none.
  const NovelCamera* Wanted() const { return recording_ ? recording_->Wanted() : nullptr; }
  /// Of a dynamic set with so many frames: the one that image shows; videos run through time.
  size_t WantedFrame(size_t frames) const;
  void Filmed(const ImageRgb8& picture);
  /// To be called every frame: ends a recording whose video is there.
  void Tend();
  /// Gives up a recording whose images cannot be made.
  void Abort(const std::string& why);

 private:
  std::filesystem::path DropRecording();

  const Host& host_;
  FileSaver& saver_;
  const std::function<void(const std::string&)> tell_;
  Flight flight_;
  std::optional<Writing> writing_;  ///< while there is a recording
  std::unique_ptr<Recording> recording_;
};

/// The window that asks for a path file; its folder's path files are one click away.
class PathDialog {
 public:
  explicit PathDialog(std::filesystem::path folder) : folder_(std::move(folder)) {}
  void Open();
  bool open() const { return open_; }
  /// Draws it with ImGui inside its own window; the file once one is chosen.
  std::optional<std::filesystem::path> Draw(UserInterface& interface);

 private:
  const std::filesystem::path folder_;
  std::vector<std::filesystem::path> files_;
  std::vector<char> text_ = std::vector<char>(4096);
  bool open_ = false, focus_ = false;
};

}  // namespace dtr::viewer
