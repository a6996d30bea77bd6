#include "pipeline/boards/rig_photos.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <map>
#include <optional>
#include <set>

#include "calib/boards/repeats.h"
#include "capture/ingest.h"
#include "capture/video/frames.h"
#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/image_io.h"
#include "pipeline/boards/detail/sensor_grid.h"
#include "pipeline/core/photos/board_given.h"
#include "pipeline/core/photos/rig_layout.h"
#include "pipeline/core/photos/rig_names.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr size_t kFramesAtOnce = 16;  // of a video, in memory

// One photo, or one frame of a video, and what was found in it.
struct Shot : RigShot {
  int width_px = 0, height_px = 0;
  calib::Detection found;
};

struct Layout {
  explicit Layout(RigLayout layout)
      : cameras(std::move(layout.cameras)),
        frames(std::move(layout.frames)),
        left_out(std::move(layout.left_out)) {
    for (RigShot& shot : layout.shots) shots.push_back({std::move(shot), 0, 0, {}});
  }
  std::vector<std::string> cameras;
  std::vector<Shot> shots;
  std::vector<std::string> frames;       // in order of time
  std::vector<calib::LeftOut> left_out;  // what the folder holds and nothing is made of
};

void Look(const ImageRgb8& image, const calib::Board& board, const calib::DetectOptions& options,
          Shot& shot) {
  shot.found = calib::DetectBoard(calib::GreyOf(image), board, options);
  shot.width_px = image.width();
  shot.height_px = image.height();
}

// Frames of one video to look at before all of all cameras: videos are read from the start.
std::vector<ImageRgb8> SomeFrames(const fs::path& video, size_t shots) {
  constexpr size_t kFrames = 8;
  std::vector<ImageRgb8> frames;
  capture::ForEachFrame(video, [&](int number, const ImageRgb8& image) {
    const size_t next = frames.size() * shots / kFrames;
    if (static_cast<size_t>(number) >= next) frames.push_back(image);
    return frames.size() < kFrames;
  });
  return frames;
}

void RequireGivenBoardIn(const Layout& layout, const std::string& folder,
                         const calib::Board& board) {
  if (layout.shots.empty()) return;
  const Shot& first = layout.shots.front();
  if (first.number < 0) {
    RequireGivenBoard(folder, board, layout.shots.size(),
                      [&](size_t i) { return io::ReadImage(layout.shots[i].file); });
    return;
  }
  const size_t shots = layout.shots.size() / layout.cameras.size();
  const auto frames = SomeFrames(first.file, shots);
  RequireGivenBoard(first.file.string(), board, frames.size(), [&](size_t i) { return frames[i]; });
}

// Looks for the board in every shot: photos side by side, videos a few frames at a time.
void LookAtAll(const calib::Board& board, const calib::DetectOptions& options, Progress& progress,
               Layout& layout) {
  progress.Stage("looking for the board", static_cast<int>(layout.shots.size()));
  std::atomic<int> done = 0;
  const auto step = [&] {
    progress.ThrowIfInterrupted();
    progress.Update(++done);
  };
  std::vector<size_t> photos;
  std::map<fs::path, std::map<int, size_t>> videos;
  for (size_t i = 0; i < layout.shots.size(); ++i) {
    const Shot& shot = layout.shots[i];
    if (shot.number < 0) {
      photos.push_back(i);
    } else {
      videos[shot.file][shot.number] = i;
    }
  }
  ParallelFor(0, static_cast<int>(photos.size()), [&](int k) {
    Shot& shot = layout.shots[photos[static_cast<size_t>(k)]];
    try {
      Look(io::ReadImage(shot.file), board, options, shot);
    } catch (const Error& error) {
      shot.found.reason = error.what();
    }
    step();
  });
  for (const auto& entry : videos) {
    const auto& video = entry.first;  // Clang 14 captures no structured binding
    const auto& wanted = entry.second;
    std::vector<std::pair<size_t, ImageRgb8>> pending;
    const auto flush = [&] {
      ParallelFor(0, static_cast<int>(pending.size()), [&](int k) {
        auto& [index, image] = pending[static_cast<size_t>(k)];
        Look(image, board, options, layout.shots[index]);
        step();
      });
      pending.clear();
    };
    capture::ForEachFrame(video, [&](int number, const ImageRgb8& image) {
      const auto at = wanted.find(number);
      if (at != wanted.end()) pending.emplace_back(at->second, image);
      if (pending.size() >= kFramesAtOnce) flush();
      return true;
    });
    flush();
  }
}

// Leaves out frames that show every camera what an earlier frame showed it.
void TakeOutRepeatedFrames(RigPhotos& photos) {
  std::map<size_t, std::vector<const calib::RigView*>> by_frame;
  for (const calib::RigView& view : photos.views) by_frame[view.frame].push_back(&view);
  std::vector<size_t> kept;
  std::map<size_t, size_t> repeats;  // frame -> the earlier one
  for (const auto& entry : by_frame) {
    const size_t frame = entry.first;
    const auto& views = entry.second;  // as above
    const auto repeated = std::find_if(kept.begin(), kept.end(), [&](size_t earlier) {
      return std::all_of(views.begin(), views.end(), [&](const calib::RigView* view) {
        const auto& camera = photos.cameras[view->camera];
        const double nearest = calib::NearestViewsPx(camera.width_px, camera.height_px);
        const auto& others = by_frame[earlier];
        return std::any_of(others.begin(), others.end(), [&](const calib::RigView* other) {
          return other->camera == view->camera &&
                 calib::MeanDistancePx(view->seen, other->seen) < nearest;
        });
      });
    });
    if (repeated == kept.end()) {
      kept.push_back(frame);
    } else {
      repeats[frame] = *repeated;
    }
  }
  for (const auto& [frame, earlier] : repeats) {
    photos.left_out.push_back({"frame " + photos.frames[frame],
                               fmt::format("adds nothing: the board is where frame {} shows it",
                                           photos.frames[earlier])});
  }
  std::erase_if(photos.views,
                [&](const calib::RigView& view) { return repeats.contains(view.frame); });
}

// What the folder holds besides the images of the cameras.
capture::FolderContents ContentsOfRig(const fs::path& folder, const Layout& layout) {
  capture::FolderContents contents = capture::ContentsOfFiles(folder, true);
  const bool videos = layout.shots.empty() || layout.shots.front().number >= 0;
  const int used = videos ? 0 : static_cast<int>(layout.shots.size());
  if (videos) {
    for (const char* kind : {"videos", "live_photo_videos", "other_files"}) contents.Use(kind);
    std::set<fs::path> files;
    for (const Shot& shot : layout.shots) files.insert(shot.file);
    contents.videos = static_cast<int>(files.size());
  }
  if (contents.photos > used) {
    contents.Ignore("unused_photos", "images", "of no camera of the rig", "",
                    contents.photos - used);
  }
  contents.photos = used;
  contents.cameras = static_cast<int>(layout.cameras.size());
  return contents;
}

// The views of one camera, and what of it is left out.
void AddViewsOf(size_t camera, const fs::path& folder, const calib::Board& board, Layout& layout,
                const std::map<std::string, size_t>& frames,
                const std::optional<calib::LensCamera>& known, Progress& progress,
                RigPhotos& photos) {
  std::vector<StoredView> stored;
  std::map<std::string, size_t> frame_of;  // by name, which is a camera's once
  for (Shot& shot : layout.shots) {
    if (shot.camera != camera) continue;
    if (shot.found.corners.empty()) {
      photos.left_out.push_back({shot.name, shot.found.reason});
      continue;
    }
    frame_of[shot.name] = frames.at(shot.frame);
    stored.push_back({{shot.name, std::move(shot.found.corners), shot.found.noise_px},
                      shot.width_px,
                      shot.height_px});
  }
  if (stored.empty()) {
    throw Error(fmt::format("{}: camera {}: expected photos of a {}, found it in none",
                            folder.string(), layout.cameras[camera], calib::TextOf(board)));
  }
  ViewsOnGrid on_grid =
      OnOneGrid(board, std::move(stored), "camera " + layout.cameras[camera], known, progress);
  photos.cameras.push_back({layout.cameras[camera], on_grid.width_px, on_grid.height_px});
  for (calib::BoardView& view : on_grid.views) {
    const size_t frame = frame_of.at(view.name);
    photos.views.push_back({camera, frame, std::move(view), {}});
  }
  photos.left_out.insert(photos.left_out.end(), on_grid.left_out.begin(), on_grid.left_out.end());
}

}  // namespace

RigPhotos ReadRigPhotos(const fs::path& folder, const calib::Board& board,
                        const calib::DetectOptions& options, Progress& progress,
                        const std::map<std::string, calib::LensCamera>& known) {
  Layout layout(RigLayoutOf(folder, progress));
  RigPhotos photos;
  photos.contents = ContentsOfRig(folder, layout);
  progress.Note(capture::LineOf(photos.contents));
  RequireGivenBoardIn(layout, folder.string(), board);
  LookAtAll(board, options, progress, layout);
  photos.left_out = layout.left_out;
  std::map<std::string, size_t> frames;
  const std::vector<size_t> times = FrameTimes(layout.frames);
  photos.frames.resize(times.empty() ? 0 : times.back() + 1);
  for (size_t i = 0; i < times.size(); ++i) {
    frames[layout.frames[i]] = times[i];
    photos.frames[times[i]] = layout.frames[i];
  }
  for (size_t c = 0; c < layout.cameras.size(); ++c) {
    const auto lens = known.find(layout.cameras[c]);
    AddViewsOf(c, folder, board, layout, frames,
               lens == known.end() ? std::nullopt : std::optional(lens->second), progress, photos);
  }
  std::stable_sort(photos.views.begin(), photos.views.end(), [](const auto& a, const auto& b) {
    return std::pair(a.frame, a.camera) < std::pair(b.frame, b.camera);
  });
  TakeOutRepeatedFrames(photos);
  return photos;
}

}  // namespace dtr::pipeline
