#include "pipeline/core/photos/rig_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include "capture/ingest.h"
#include "capture/video/frames.h"
#include "dtr/base/error.h"
#include "pipeline/core/photos/rig_names.h"
#include "pipeline/core/photos/rig_timestamps.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

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

void OrderFrames(RigLayout& layout) {
  for (const RigShot& shot : layout.shots) layout.frames.push_back(shot.frame);
  std::sort(layout.frames.begin(), layout.frames.end(), EarlierName);
  layout.frames.erase(std::unique(layout.frames.begin(), layout.frames.end()), layout.frames.end());
}

RigLayout FromSubfolders(const std::vector<fs::path>& folders) {
  RigLayout layout;
  for (const fs::path& folder : folders) {
    for (const fs::path& photo : Sorted(folder, IsPhoto)) {
      RigShot shot;
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

RigLayout FromNames(const std::vector<fs::path>& photos) {
  RigLayout layout;
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
    RigShot shot;
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
                  const std::set<int>& numbers, const std::string& name, RigLayout& layout) {
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

RigLayout FromVideos(const fs::path& folder, const std::vector<fs::path>& videos,
                     Progress& progress) {
  RigLayout layout;
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
      RigShot shot;
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
void RequireOneShotPerFrame(const RigLayout& layout) {
  std::map<std::pair<size_t, std::string>, const RigShot*> seen;
  for (const RigShot& shot : layout.shots) {
    const auto [earlier, fresh] = seen.emplace(std::pair(shot.camera, shot.frame), &shot);
    if (fresh) continue;
    throw Error(fmt::format(
        "{}: frame {} of camera {}: expected one image of every camera in a frame, found also {}; "
        "remove one of them",
        shot.name, shot.frame, layout.cameras[shot.camera], earlier->second->name));
  }
}

}  // namespace

RigLayout RigLayoutOf(const fs::path& folder, Progress& progress) {
  if (!fs::is_directory(folder)) {
    throw UsageError(fmt::format("{}: expected a folder of what the cameras of a rig saw, found {}",
                                 folder.string(),
                                 fs::exists(folder) ? "something else" : "nothing"));
  }
  const auto folders = Sorted(folder, [](const fs::path& path) {
    return fs::is_directory(path) && !Sorted(path, IsPhoto).empty();
  });
  RigLayout layout;
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

}  // namespace dtr::pipeline
