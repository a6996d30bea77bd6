#include "cli/pipeline/scale_board.h"

#include <fmt/format.h>

#include <atomic>
#include <utility>

#include "calib/boards/detect.h"
#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/set_io.h"

namespace dtr::pipeline {
namespace {

constexpr size_t kFewestViews = 3;

}  // namespace

BoardInSet FindBoard(const std::filesystem::path& folder, const DtrSet& set,
                     const calib::Board& board, int threads, Progress& progress) {
  std::vector<const View*> views;
  for (const View& view : set.frames.front().views) {
    if (view.role == ViewRole::kSource) views.push_back(&view);
  }
  progress.Stage("looking for the board", static_cast<int>(views.size()));
  std::vector<calib::Detection> found(views.size());
  std::atomic<int> done = 0;
  ParallelFor(0, static_cast<int>(views.size()), threads, [&](int i) {
    progress.ThrowIfInterrupted();
    View view = *views[static_cast<size_t>(i)];
    io::LoadOptions load;
    load.depth = false;
    load.threads = 1;
    io::LoadPixels(folder, view, load);
    found[static_cast<size_t>(i)] = calib::DetectBoard(calib::GreyOf(view.image), board);
    progress.Update(++done);
  });
  BoardInSet in_set;
  for (size_t i = 0; i < views.size(); ++i) {
    const View& view = *views[i];
    if (found[i].corners.empty()) {
      in_set.without.push_back({view.name, found[i].reason});
      continue;
    }
    in_set.sights.push_back({view.camera,
                             view.cam_from_world,
                             {view.name, std::move(found[i].corners), found[i].noise_px}});
  }
  if (in_set.sights.size() >= kFewestViews) return in_set;
  throw Error(fmt::format(
      "--board {}: expected it in {} views of {} or more, found it in {} of {}{}",
      calib::TextOf(board), kFewestViews, folder.string(), in_set.sights.size(), views.size(),
      in_set.without.empty() ? ""
                             : fmt::format("; {} says: {}", in_set.without.front().name,
                                           in_set.without.front().reason)));
}

}  // namespace dtr::pipeline
