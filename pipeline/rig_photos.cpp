#include "pipeline/rig_photos.h"

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
#include "pipeline/detail/boards/board_given.h"
#include "pipeline/detail/boards/rig_names.h"
#include "pipeline/detail/boards/rig_timestamps.h"
#include "pipeline/detail/boards/sensor_grid.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr size_t kFramesAtOnce = 16;  // of a video, in memory

// One photo, or one frame of a video, and what was found in it.
struct Shot {
  fs::path file;      // of a photo; of a video where number >= 0
  int number = -1;    // frame of a video
  std::string name;   // to list it by
  std::string frame;  // time step
  size_t camera = 0;
  int width_px = 0, height_px = 0;
  calib::Detection found;
};

struct Layout {
  std::vector<std::string> cameras;
  std::vector<Shot> shots;
  std::vector<std::string> frames;       // in order of time
  std::vector<calib::LeftOut> left_out;  // what the folder holds and nothing is made of
};

std::vector<fs::path> Sorted(const fs::path& folder,
                             const std::function<bool(const fs::path&)>& take) {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!entry.path().filename().string().starts_with('.') && take(entry.path())) {
      paths.push_back(entry.path());
    }
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

bool IsPhoto(const fs::path& path) {
  return fs::is_regular_file(path) && capture::IsImageExtension(path.extension().string());
}

// Numbers in names are compared as such: 2 comes before 10.
bool EarlierName(const std::string& a, const std::string& b) {
  const std::string x = DigitsAtEnd(a), y = DigitsAtEnd(b);
  const std::string p = a.substr(0, a.size() - x.size()), q = b.substr(0, b.size() - y.size());
  if (p != q) return p < q;
  const auto bare = [](const std::string& digits) {
    const size_t at = digits.find_first_not_of('0');
    return at == std::string::npos ? std::string() : digits.substr(at);
  };
  const std::string m = bare(x), n = bare(y);
  if (m.size() != n.size()) return m.size() < n.size();
  return m != n ? m < n : a < b;
}

void OrderFrames(Layout& layout) {
  for (const Shot& shot : layout.shots) layout.frames.push_back(shot.frame);
  std::sort(layout.frames.begin(), layout.frames.end(), EarlierName);
  layout.frames.erase(std::unique(layout.frames.begin(), layout.frames.end()), layout.frames.end());
}

Layout FromSubfolders(const std::vector<fs::path>& folders) {
  Layout layout;
  for (const fs::path& folder : folders) {
    for (const fs::path& photo : Sorted(folder, IsPhoto)) {
      Shot shot;
      shot.file = photo;
      shot.name = folder.filename().string() + "/" + photo.filename().string();
      shot.frame = RigNameOf(shot.name)->frame;
      shot.camera = layout.cameras.size();
      layout.shots.push_back(std::move(shot));
    }
    layout.cameras.push_back(folder.filename().string());
  }
  OrderFrames(layout);
  return layout;
}

Layout FromNames(const std::vector<fs::path>& photos) {
  Layout layout;
  std::map<std::string, size_t> cameras;
  for (const fs::path& photo : photos) {
    if (const auto named = RigNameOf(photo.filename().string())) cameras.emplace(named->camera, 0);
  }
  for (auto& [name, index] : cameras) {
    index = layout.cameras.size();
    layout.cameras.push_back(name);
  }
  for (const fs::path& photo : photos) {
    const auto named = RigNameOf(photo.filename().string());
    if (!named) continue;
    Shot shot;
    shot.file = photo;
    shot.name = photo.filename().string();
    shot.frame = named->frame;
    shot.camera = cameras.at(named->camera);
    layout.shots.push_back(std::move(shot));
  }
  OrderFrames(layout);
  return layout;
}

// Of one camera: which frame of its video belongs to which time step. A table that has as many rows
// as the video has frames is a table of them in order, though it may count them from another start:
// recorders number from when a camera began.
std::map<int, int> TimeStepsOf(const RigTimestamps& timestamps, int camera, int frames) {
  std::map<int, int> own;
  for (const auto& [key, time_step] : timestamps.time_steps) {
    if (key.first == camera) own.emplace(key.second, time_step);
  }
  if (static_cast<int>(own.size()) != frames) return own;
  std::map<int, int> in_order;
  for (const auto& [number, time_step] : own) {
    in_order.emplace(static_cast<int>(in_order.size()), time_step);
  }
  return in_order;
}

// Of a video, as headers count a few frames that are not there.
struct VideoFrames {
  std::set<int> numbers;  // of those that can be decoded
  int count = 0;          // damaged ones included
};

VideoFrames FramesIn(const fs::path& video, Progress& progress) {
  capture::VideoReader reader(video);
  progress.Stage("counting frames of " + video.filename().string(), reader.frames_promised());
  VideoFrames frames;
  while (reader.Next()) {
    frames.numbers.insert(reader.number());
    progress.Update(reader.number() + 1);
    progress.ThrowIfInterrupted();
  }
  const auto note = [&](const std::string& line) {
    progress.Note(fmt::format("{}: {}", video.filename().string(), line));
  };
  for (const std::string& remark : reader.remarks()) note(remark);
  if (const std::string why = reader.WhyIncomplete(); !frames.numbers.empty() && !why.empty()) {
    note(why);
  }
  frames.count = reader.frames_so_far();
  if (!frames.numbers.empty()) return frames;
  throw Error(video.string() + ": expected frames, found none; is the video whole?");
}

// Where table and video differ in length, what has no partner is listed.
void ListUnpaired(const RigTimestamps& timestamps, const std::map<int, int>& own,
                  const std::set<int>& numbers, const std::string& name, Layout& layout) {
  const int frames = static_cast<int>(numbers.size());
  const int paired = static_cast<int>(std::count_if(
      own.begin(), own.end(), [&](const auto& row) { return numbers.contains(row.first); }));
  const int rows = static_cast<int>(own.size());
  if (paired == frames && rows == paired) return;
  layout.left_out.push_back(
      {name, fmt::format("{} of {} frames have no row in timestamps.csv and {} of its {} rows have "
                         "no frame in the video{}",
                         frames - paired, frames, rows - paired, rows,
                         timestamps.counted ? "; it has no column frame_index, so row k, in order "
                                              "of time, is taken as frame k: if frames are missing "
                                              "before the end, add that column"
                                            : "")});
}

Layout FromVideos(const fs::path& folder, const std::vector<fs::path>& videos, Progress& progress) {
  Layout layout;
  RigTimestamps timestamps;
  const bool timed = fs::exists(folder / "timestamps.csv");
  if (timed) timestamps = ReadRigTimestamps(folder / "timestamps.csv");
  for (const fs::path& video : videos) {
    const std::string name = video.stem().string();
    const auto id = WholeNumber(DigitsAtEnd(name));
    if (timed && !id) {
      throw Error(
          fmt::format("{}: expected a number at the end of the name, the cam_id of "
                      "timestamps.csv",
                      video.string()));
    }
    const VideoFrames frames = FramesIn(video, progress);
    std::map<int, int> own;
    if (timed) {
      own = TimeStepsOf(timestamps, *id, frames.count);
      if (own.empty()) {
        throw Error(
            fmt::format("{}: timestamps.csv has no row of cam_id {}, the number at the end of the "
                        "video's name; "
                        "rename the video after its camera, or move it out of the folder",
                        video.string(), *id));
      }
      ListUnpaired(timestamps, own, frames.numbers, name, layout);
    }
    for (const int number : frames.numbers) {
      Shot shot;
      shot.file = video;
      shot.number = number;
      shot.name = fmt::format("{}/{}", name, number);
      shot.camera = layout.cameras.size();
      shot.frame = fmt::format("{}", number);
      if (timed) {
        const auto at = own.find(number);
        if (at == own.end()) continue;  // a frame without a time step says nothing of the rig
        shot.frame = fmt::format("{}", at->second);
      }
      layout.shots.push_back(std::move(shot));
    }
    layout.cameras.push_back(name);
  }
  OrderFrames(layout);
  return layout;
}

// Videos of low resolution that cameras write beside them are no cameras of their own.
std::vector<fs::path> VideosIn(const fs::path& folder) {
  const auto is_proxy = [](const fs::path& path) {
    return capture::IsProxyVideoExtension(path.extension().string());
  };
  auto videos = Sorted(folder, [](const fs::path& path) {
    return fs::is_regular_file(path) && capture::IsVideoExtension(path.extension().string());
  });
  if (!std::all_of(videos.begin(), videos.end(), is_proxy)) std::erase_if(videos, is_proxy);
  return videos;
}

// One camera sees a time step once.
void RequireOneShotPerFrame(const Layout& layout) {
  std::map<std::pair<size_t, std::string>, const Shot*> seen;
  for (const Shot& shot : layout.shots) {
    const auto [earlier, fresh] = seen.emplace(std::pair(shot.camera, shot.frame), &shot);
    if (fresh) continue;
    throw Error(fmt::format(
        "{}: frame {} of camera {}: expected one image of every camera in a frame, found also {}; "
        "remove one of them",
        shot.name, shot.frame, layout.cameras[shot.camera], earlier->second->name));
  }
}

Layout LayoutOf(const fs::path& folder, Progress& progress) {
  if (!fs::is_directory(folder)) {
    throw UsageError(fmt::format("{}: expected a folder of what the cameras of a rig saw, found {}",
                                 folder.string(),
                                 fs::exists(folder) ? "something else" : "nothing"));
  }
  const auto folders = Sorted(folder, [](const fs::path& path) {
    return fs::is_directory(path) && !Sorted(path, IsPhoto).empty();
  });
  Layout layout;
  if (folders.size() >= 2) {
    layout = FromSubfolders(folders);
  } else if (const auto videos = VideosIn(folder); videos.size() >= 2) {
    layout = FromVideos(folder, videos, progress);
  } else {
    layout = FromNames(Sorted(folder, IsPhoto));
  }
  if (layout.cameras.size() < 2) {
    throw UsageError(
        fmt::format("{}: expected at least 2 cameras: sub-folders with photos, photos "
                    "named CAMERA and a number, or videos; found {}",
                    folder.string(), layout.cameras.size()));
  }
  RequireOneShotPerFrame(layout);
  return layout;
}

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

void RequireGivenBoardIn(const Layout& layout, const std::string& folder, const calib::Board& board,
                         int threads) {
  if (layout.shots.empty()) return;
  const Shot& first = layout.shots.front();
  if (first.number < 0) {
    RequireGivenBoard(
        folder, board, layout.shots.size(),
        [&](size_t i) { return io::ReadImage(layout.shots[i].file); }, threads);
    return;
  }
  const size_t shots = layout.shots.size() / layout.cameras.size();
  const auto frames = SomeFrames(first.file, shots);
  RequireGivenBoard(
      first.file.string(), board, frames.size(), [&](size_t i) { return frames[i]; }, threads);
}

// Looks for the board in every shot: photos side by side, videos a few frames at a time.
void LookAtAll(const calib::Board& board, const calib::DetectOptions& options, int threads,
               Progress& progress, Layout& layout) {
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
  ParallelFor(0, static_cast<int>(photos.size()), threads, [&](int k) {
    Shot& shot = layout.shots[photos[static_cast<size_t>(k)]];
    try {
      Look(io::ReadImage(shot.file), board, options, shot);
    } catch (const Error& error) {
      shot.found.reason = error.what();
    }
    step();
  });
  for (const auto& [video, wanted] : videos) {
    std::vector<std::pair<size_t, ImageRgb8>> pending;
    const auto flush = [&] {
      ParallelFor(0, static_cast<int>(pending.size()), threads, [&](int k) {
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
  for (const auto& [frame, views] : by_frame) {
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
                        const calib::DetectOptions& options, int threads, Progress& progress,
                        const std::map<std::string, calib::LensCamera>& known) {
  Layout layout = LayoutOf(folder, progress);
  RigPhotos photos;
  photos.contents = ContentsOfRig(folder, layout);
  progress.Note(capture::LineOf(photos.contents));
  RequireGivenBoardIn(layout, folder.string(), board, threads);
  LookAtAll(board, options, threads, progress, layout);
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
