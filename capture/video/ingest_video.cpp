#include "capture/video/ingest_video.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "capture/ingest.h"
#include "capture/screening.h"
#include "capture/video/frame_chooser.h"
#include "capture/video/frames.h"
#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/utf8.h"
#include "dtr/io/image_io.h"

namespace dtr::capture {
namespace fs = std::filesystem;
namespace {

constexpr int kSmallSidePx = 320;       // motion is looked at in such images
constexpr int kJpegQuality = 98;        // the video lost more before
constexpr double kSameRate = 1e-3;      // relative
constexpr double kSameTimeStep = 0.75;  // of the time between two frames
constexpr int kSaidEvery = 10;          // frames between two words of progress

using Videos = std::vector<fs::path>;

// Videos whose frames are taken together: one, or those of a rig.
class Together {
 public:
  Together(const Videos& files, double memory_gb) : files_(files) {
    for (const fs::path& file : files) {
      readers_.push_back(std::make_unique<VideoReader>(file, memory_gb));
    }
  }

  // To the next time step that all have; false once one of the videos has no more.
  bool Next() {
    bool all = true;
    for (const auto& reader : readers_) all = reader->Next() && all;
    all = all && Align();
    if (all) CompareTimes();
    return all;
  }
  int number() const { return readers_.front()->number(); }
  double time_s() const { return readers_.front()->time_s(); }
  const std::vector<std::unique_ptr<VideoReader>>& readers() const { return readers_; }

  /// One line where frames of one number are not shown at one time; else empty.
  const std::string& drift() const { return drift_; }

  void RequireOneRate() const {
    const double first = readers_.front()->frames_per_second();
    for (size_t i = 1; i < readers_.size(); ++i) {
      const double rate = readers_[i]->frames_per_second();
      if (std::abs(rate - first) <= kSameRate * first) continue;
      throw Error(
          fmt::format("{}: expected {:.3f} frames per second as in {}, found {:.3f}; synchronised "
                      "videos run at one rate",
                      files_[i].string(), first, files_.front().string(), rate));
    }
  }

 private:
  // A frame that is damaged in one of the videos is left out of all.
  bool Align() {
    int latest = 0;
    for (bool aligned = false; !aligned;) {
      aligned = true;
      for (const auto& reader : readers_) latest = std::max(latest, reader->number());
      for (const auto& reader : readers_) {
        while (reader->number() < latest) {
          if (!reader->Next()) return false;
        }
        aligned = aligned && reader->number() == latest;
      }
    }
    return true;
  }

  // A camera that drops frames, or one of variable rate, shows another moment from there on.
  void CompareTimes() {
    const double rate = readers_.front()->frames_per_second();
    if (!drift_.empty() || rate <= 0) return;
    for (size_t i = 1; i < readers_.size(); ++i) {
      const double apart_s = readers_[i]->time_s() - readers_.front()->time_s();
      if (std::abs(apart_s) * rate < kSameTimeStep) continue;
      drift_ = fmt::format(
          "frame {} is shown at {:.3f} s, that of {} at {:.3f} s: from there on the same number is "
          "another moment; are frames missing in one of them?",
          number(), time_s(), files_[i].filename().string(), readers_[i]->time_s());
      return;
    }
  }

  const Videos& files_;
  std::vector<std::unique_ptr<VideoReader>> readers_;
  std::string drift_;
};

Grid<std::uint8_t> SmallGrey(const ImageRgb8& picture) {
  const Grid<std::uint16_t> luma = SmallLuma(picture, kSmallSidePx);
  Grid<std::uint8_t> grey(luma.width(), luma.height());
  std::transform(luma.data().begin(), luma.data().end(), grey.data().begin(),
                 [](std::uint16_t value) { return static_cast<std::uint8_t>(value / 256); });
  return grey;
}

double MeanSharpness(const std::vector<ImageRgb8>& pictures) {
  double product = 1;
  for (const ImageRgb8& picture : pictures) product *= Sharpness(picture);
  return std::pow(product, 1.0 / static_cast<double>(pictures.size()));
}

std::vector<ImageRgb8> ImagesOf(const Together& videos) {
  std::vector<ImageRgb8> pictures;
  for (const auto& reader : videos.readers()) pictures.push_back(reader->Picture());
  return pictures;
}

// Videos that hold less than they promise, or more than is taken of them; and what was remarked.
void ListLosses(const Videos& files, const Together& videos, int seen, Capture& capture) {
  for (size_t i = 0; i < files.size(); ++i) {
    const VideoReader& reader = *videos.readers()[i];
    const std::string name = files[i].filename().string();
    for (const std::string& remark : reader.remarks()) capture.remarks.push_back({name, remark});
    std::string why = reader.WhyIncomplete();
    const int promised = reader.frames_promised();
    if (files.size() > 1 && reader.PromisesMoreThan(seen)) {
      why = fmt::format(
          "frames from {} on: the file says it has {}; it or another of the synchronised videos "
          "ends there",
          seen, promised);
    }
    if (!why.empty()) capture.skipped.push_back({name, why});
  }
  if (!videos.drift().empty()) {
    capture.remarks.push_back({files.front().filename().string(), videos.drift()});
  }
}

struct Choice {
  std::vector<ChosenFrame> frames;
  int seen = 0;  // frames that could be decoded of all videos
};

Choice ChooseFrames(const Videos& files, const VideoOptions& options, Capture& reported,
                    Progress& progress) {
  Together videos(files, options.memory_gb);
  videos.RequireOneRate();
  progress.Stage("choosing frames", videos.readers().front()->frames_promised());
  Choice choice;
  FrameChooser chooser(options.motion);
  int due = 0;  // the next one of every so many, or the first one after it that is whole
  while (videos.Next()) {
    progress.ThrowIfInterrupted();
    const int number = videos.number();
    choice.seen = number + 1;
    if (choice.seen % kSaidEvery == 0) progress.Update(choice.seen);
    if (options.every > 0) {
      if (number < due) continue;
      due = (number / options.every + 1) * options.every;
      const double sharpness = options.most > 0 ? MeanSharpness(ImagesOf(videos)) : 0;
      choice.frames.push_back({number, videos.time_s(), 0, sharpness});
      continue;
    }
    const std::vector<ImageRgb8> pictures = ImagesOf(videos);
    TimeStep time_step{number, videos.time_s(), {}, [&] { return MeanSharpness(pictures); }};
    for (const ImageRgb8& picture : pictures) time_step.greys.push_back(SmallGrey(picture));
    chooser.Add(std::move(time_step));
  }
  progress.Update(choice.seen);
  if (choice.seen == 0) {
    throw Error(fmt::format("{}: expected frames, found none; is the video whole?",
                            files.front().string()));
  }
  if (options.every == 0) choice.frames = chooser.Finish();
  if (choice.frames.empty()) {
    throw Error(fmt::format("{}: expected frames with texture, found none among {}; give `every`",
                            files.front().string(), choice.seen));
  }
  choice.frames = Thinned(choice.frames, options.most);
  ListLosses(files, videos, choice.seen, reported);
  return choice;
}

// Writes the chosen frames and notes under its name what each is.
void WriteFrames(const Videos& files, const std::vector<fs::path>& folders,
                 const std::vector<ChosenFrame>& frames, const fs::path& top,
                 std::map<std::string, VideoFrame>& origins, Progress& progress) {
  progress.Stage("writing frames", static_cast<int>(frames.size()));
  for (const fs::path& folder : folders) fs::create_directories(top / folder);
  Together videos(files, 0);  // they were decoded before, within the memory
  for (size_t next = 0; next < frames.size();) {
    if (!videos.Next()) {
      throw Error(fmt::format(
          "{}: expected frame {} again, found the end after {} frames; is the file being written?",
          files.front().string(), frames[next].number, videos.number() + 1));
    }
    if (videos.number() != frames[next].number) continue;
    progress.ThrowIfInterrupted();
    const std::vector<ImageRgb8> pictures = ImagesOf(videos);
    ParallelFor(0, static_cast<int>(pictures.size()), [&](int i) {
      const fs::path name =
          folders[static_cast<size_t>(i)] / fmt::format("frame_{:06}.jpg", frames[next].number);
      io::WriteImage(top / name, pictures[static_cast<size_t>(i)], kJpegQuality);
    });
    for (size_t i = 0; i < files.size(); ++i) {
      const fs::path name = folders[i] / fmt::format("frame_{:06}.jpg", frames[next].number);
      origins[name.generic_string()] = {files[i].filename().string(), frames[next].number,
                                        frames[next].time_s};
    }
    progress.Update(static_cast<int>(++next));
  }
}

// Where a video's frames go: nowhere special where it is alone; by the name without its extension
// where no other folder could be called so, and photos are looked for in folders of such a name.
fs::path FolderFor(const fs::path& video, const Videos& videos) {
  if (videos.size() == 1) return {};
  const fs::path stem = video.stem();
  const bool taken = std::any_of(videos.begin(), videos.end(), [&](const fs::path& other) {
    return other != video && (other.stem() == stem || other.filename() == stem);
  });
  return taken || stem.extension() == ".dtr" || stem.extension() == ".partial" ? video.filename()
                                                                               : stem;
}

void RequireOptions(const VideoOptions& options) {
  if (options.every < 0) throw UsageError("`every`: expected a number of frames above 0");
  if (options.most < 0) throw UsageError("`max_frames`: expected a number of frames above 0");
  if (!(options.motion > 0 && options.motion <= 1)) {
    throw UsageError(fmt::format(
        "`motion`: expected a share of the image above 0 and up to 1, found {}", options.motion));
  }
}

}  // namespace

Videos VideosOf(const fs::path& source) {
  std::error_code error;
  if (fs::is_regular_file(source, error)) {
    return IsVideoExtension(source.extension().string()) ? Videos{source} : Videos{};
  }
  Videos videos, proxies;
  fs::directory_iterator entries(source, error);
  for (; !error && entries != fs::directory_iterator(); entries.increment(error)) {
    const fs::path& path = entries->path();
    if (path.filename().string().front() == '.') continue;
    std::error_code ignored;
    if (entries->is_directory(ignored)) {
      if (!IsOwnFolder(path)) return {};  // photos may lie below
      continue;
    }
    if (IsImageExtension(path.extension().string())) return {};
    const std::string extension = path.extension().string();
    if (IsVideoExtension(extension)) {
      (IsProxyVideoExtension(extension) ? proxies : videos).push_back(path);
    }
  }
  if (videos.empty()) videos = std::move(proxies);
  std::sort(videos.begin(), videos.end());
  return videos;
}

Capture IngestVideos(const Videos& videos, const VideoOptions& options, const fs::path& folder,
                     Progress& progress) {
  RequireOptions(options);
  for (const fs::path& video : videos) {
    const std::string name = video.filename().string();
    if (IsUtf8(name) && WhyUnsafeName(name).empty()) continue;
    throw Error(video.string() + ": expected a video whose name is printable UTF-8; rename it");
  }
  std::vector<Videos> groups;
  if (options.synchronised) {
    groups.push_back(videos);
  } else {
    for (const fs::path& video : videos) groups.push_back({video});
  }
  std::map<std::string, VideoFrame> origins;
  Capture reported;  // of the files: what is missing, what was remarked
  for (const Videos& group : groups) {
    std::vector<fs::path> folders;
    for (const fs::path& video : group) folders.push_back(FolderFor(video, videos));
    const Choice choice = ChooseFrames(group, options, reported, progress);
    WriteFrames(group, folders, choice.frames, folder, origins, progress);
  }
  // Frames are photos, whatever a video is called: "normal.mp4" is one speed of several.
  Capture capture = IngestPhotos(folder, {.sort = false, .memory_gb = options.memory_gb}, progress);
  std::map<std::string, std::string> projections;
  for (const fs::path& video : videos) {
    projections[video.filename().string()] = VideoReader(video).Projection();
  }
  for (Photo& photo : capture.photos) {
    photo.video_frame = origins.at(photo.name);
    const std::string& projection = projections.at(photo.video_frame->video);
    if (!projection.empty()) photo.panorama.emplace().projection = projection;
    photo.camera_group =
        fmt::format("video {}|{}x{}", photo.video_frame->video, photo.width_px, photo.height_px);
  }
  capture.skipped.insert(capture.skipped.end(), reported.skipped.begin(), reported.skipped.end());
  capture.remarks.insert(capture.remarks.end(), reported.remarks.begin(), reported.remarks.end());
  ScreenPhotos(capture.photos);
  return capture;
}

}  // namespace dtr::capture
