#include "pipeline/boards/board_photos.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <atomic>

#include "calib/boards/repeats.h"
#include "capture/ingest.h"
#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/image_io.h"
#include "pipeline/boards/detail/sensor_grid.h"
#include "pipeline/core/photos/board_given.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> MatchingNames(const fs::path& folder, const std::string& pattern) {
  if (!fs::is_directory(folder)) {
    throw UsageError(fmt::format("{}: expected a folder of photos of a board, found {}",
                                 folder.string(),
                                 fs::exists(folder) ? "something else" : "nothing"));
  }
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with('.') && entry.is_regular_file() &&
        capture::IsImageExtension(entry.path().extension().string()) &&
        fnmatch(pattern.c_str(), name.c_str(), 0) == 0) {
      names.push_back(name);
    }
  }
  if (names.empty()) {
    throw UsageError(
        fmt::format("{}: expected photos matching '{}', found none", folder.string(), pattern));
  }
  std::sort(names.begin(), names.end());
  return names;
}

// Every image is looked at for the board, whatever else it may be.
capture::FolderContents ContentsOfBoardFolder(const fs::path& folder, size_t matching) {
  capture::FolderContents contents = capture::ContentsOfFiles(folder, false);
  const int others = contents.photos - static_cast<int>(matching);
  if (others > 0) contents.Ignore("unmatched_photos", "images", "not of that name", "", others);
  contents.photos = static_cast<int>(matching);
  contents.cameras = 1;
  return contents;
}

struct Looked {
  int width_px = 0, height_px = 0;  // 0: no image
  calib::Detection found;
};

Looked LookAt(const fs::path& file, const calib::Board& board,
              const calib::DetectOptions& options) {
  Looked looked;
  try {
    const ImageRgb8 image = io::ReadImage(file);
    looked.found = calib::DetectBoard(calib::GreyOf(image), board, options);
    looked.width_px = image.width();
    looked.height_px = image.height();
  } catch (const Error& error) {
    looked.found.reason = error.what();
  }
  return looked;
}

}  // namespace

BoardPhotos ReadBoardPhotos(const fs::path& folder, const std::string& pattern,
                            const calib::Board& board, const calib::DetectOptions& options,
                            Progress& progress, const std::optional<calib::LensCamera>& known) {
  const std::vector<std::string> names = MatchingNames(folder, pattern);
  BoardPhotos photos;
  photos.contents = ContentsOfBoardFolder(folder, names.size());
  progress.Note(capture::LineOf(photos.contents));
  RequireGivenBoard(folder.string(), board, names.size(),
                    [&](size_t i) { return io::ReadImage(folder / names[i]); });
  std::vector<Looked> all(names.size());
  progress.Stage("looking for the board", static_cast<int>(names.size()));
  std::atomic<int> done = 0;
  ParallelFor(0, static_cast<int>(names.size()), [&](int i) {
    progress.ThrowIfInterrupted();
    const auto at = static_cast<size_t>(i);
    all[at] = LookAt(folder / names[at], board, options);
    progress.Update(++done);
  });
  std::vector<StoredView> stored;
  for (size_t i = 0; i < names.size(); ++i) {
    if (all[i].found.corners.empty()) {
      photos.left_out.push_back({names[i], all[i].found.reason});
    } else {
      stored.push_back({{names[i], all[i].found.corners, all[i].found.noise_px},
                        all[i].width_px,
                        all[i].height_px});
    }
  }
  if (stored.empty()) {
    throw Error(fmt::format(
        "{}: expected photos of a {}, found it in none of {}; the first says: {}", folder.string(),
        calib::TextOf(board), names.size(), photos.left_out.front().reason));
  }
  ViewsOnGrid on_grid = OnOneGrid(board, std::move(stored), folder.string(), known, progress);
  photos.width_px = on_grid.width_px;
  photos.height_px = on_grid.height_px;
  photos.views = std::move(on_grid.views);
  photos.left_out.insert(photos.left_out.end(), on_grid.left_out.begin(), on_grid.left_out.end());
  if (photos.views.empty()) {
    throw Error(fmt::format("{}: none of the photos that show the board can be used; {}: {}",
                            folder.string(), on_grid.left_out.front().name,
                            on_grid.left_out.front().reason));
  }
  auto repeats =
      calib::TakeOutRepeats(calib::NearestViewsPx(photos.width_px, photos.height_px), photos.views);
  photos.left_out.insert(photos.left_out.end(), repeats.begin(), repeats.end());
  return photos;
}

}  // namespace dtr::pipeline
