#include "pipeline/metres/detail/scale_board.h"

#include <fmt/format.h>

#include <atomic>
#include <utility>
#include <vector>

#include "calib/boards/detect.h"
#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/set_io.h"
#include "pipeline/core/photos/board_given.h"

namespace dtr::pipeline {
namespace {

constexpr size_t kMinViews = 3;

ImageRgb8 ImageOf(const std::filesystem::path& folder, View view) {
  io::LoadOptions load;
  load.depth = false;
  io::LoadPixels(folder, view, load);
  return std::move(view.image);
}

// Photos of a scene need not show the board: where some seem to, these alone are asked.
void RequireGivenBoardIn(const std::filesystem::path& folder, std::vector<const View*> views,
                         const std::vector<calib::Detection>& found, const calib::Board& board) {
  std::vector<const View*> seeing;
  for (size_t i = 0; i < views.size(); ++i) {
    if (!found[i].corners.empty()) seeing.push_back(views[i]);
  }
  if (!seeing.empty()) views = std::move(seeing);
  RequireGivenBoard(folder.string(), board, views.size(),
                    [&](size_t i) { return ImageOf(folder, *views[i]); });
}

}  // namespace

BoardInSet FindBoard(const std::filesystem::path& folder, const DtrSet& set,
                     const calib::Board& board, Progress& progress) {
  std::vector<const View*> views;
  for (const View& view : set.frames.front().views) {
    if (view.role == ViewRole::kSource) views.push_back(&view);
  }
  progress.Stage("looking for the board", static_cast<int>(views.size()));
  std::vector<calib::Detection> found(views.size());
  std::atomic<int> done = 0;
  ParallelFor(0, static_cast<int>(views.size()), [&](int i) {
    progress.ThrowIfInterrupted();
    const auto at = static_cast<size_t>(i);
    found[at] = calib::DetectBoard(calib::GreyOf(ImageOf(folder, *views[at])), board);
    progress.Update(++done);
  });
  RequireGivenBoardIn(folder, views, found, board);
  BoardInSet in_set;
  for (size_t i = 0; i < views.size(); ++i) {
    const View& view = *views[i];
    if (found[i].corners.empty()) {
      in_set.without.push_back({view.name, found[i].reason});
      continue;
    }
    in_set.observations.push_back({view.camera,
                                   view.cam_from_world,
                                   {view.name, std::move(found[i].corners), found[i].noise_px}});
  }
  if (in_set.observations.size() >= kMinViews) return in_set;
  throw Error(fmt::format(
      "`board` {}: expected it in {} views of {} or more, found it in {} of {}{}",
      calib::TextOf(board), kMinViews, folder.string(), in_set.observations.size(), views.size(),
      in_set.without.empty() ? ""
                             : fmt::format("; {} says: {}", in_set.without.front().name,
                                           in_set.without.front().reason)));
}

}  // namespace dtr::pipeline
