// viewer/glfw/recording.h -- a path into a video, image by image while the window stays alive.
#pragma once
#include <atomic>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <vector>

#include "dtr/io/video.h"
#include "dtr/render/camera_path.h"

namespace dtr::viewer {

/// The window draws each camera whole and gives its image; then the video is encoded on a thread
/// of its own. Destroyed before its end it leaves nothing behind.
class Recording {
 public:
  /// `cameras`, at least one, have one size. Throws dtr::Error where no video can be made.
  Recording(const std::filesystem::path& target, std::vector<NovelCamera> cameras);
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  const std::filesystem::path& target() const { return target_; }
  size_t frames() const { return cameras_.size(); }
  size_t drawn() const { return drawn_; }
  /// The camera whose image is wanted; null once all are there.
  const NovelCamera* Wanted() const;
  /// Its image. Encoding begins with the last one.
  void Add(const ImageRgb8& picture);
  /// True once the video is there. Throws dtr::Error where encoding failed.
  bool Done();

 private:
  std::filesystem::path target_;
  std::vector<NovelCamera> cameras_;
  size_t drawn_ = 0;
  std::atomic<bool> stop_ = false;
  std::unique_ptr<io::VideoWriter> writer_;
  std::future<void> encoding_;
};

}  // namespace dtr::viewer
