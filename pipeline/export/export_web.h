// pipeline/export/export_web.h -- a set as a page that shows it in a browser (docs/EXPORT.md).
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "dtr/base/progress.h"
#include "dtr/eval/held_out.h"
#include "dtr/render/options.h"

namespace dtr::pipeline {

struct WebPageRequest {
  std::filesystem::path set;
  std::filesystem::path output;  ///< the file to write, or the folder
  bool force = false;            ///< replaces a file, never a folder
  /// A folder of files for a web server, which gives views one by one, instead of one HTML file.
  bool as_site = false;
  /// At most so many MB (10^6 bytes): photos and depth are coded more coarsely, and less is taken
  /// of the set, until the page fits.
  std::optional<double> max_mb;
  /// Of photos, 1...100; without it 85, and photos that the set stores as JPEG go in as they are.
  std::optional<int> jpeg_quality;
  double depth_error_px = 0.15;  ///< largest error of depth by rounding, pixels of disparity
  /// For the figures of held-out photos that the page shows, as Evaluate draws them; not called
  /// where the set has none, or several time steps. Empty: no such figures.
  std::function<eval::RenderFunction()> make_renderer;
  /// With make_renderer: writes `output`, the set without what images lose at most this for
  /// (PruneSet). For max_mb, where coarser coding alone would cost more; not of sets of several
  /// time steps. Empty: nothing is left out.
  std::function<void(double loss_db, const std::filesystem::path& output)> prune;
  RenderOptions render;
};

struct WebPageReport {
  size_t views = 0;
  std::uint64_t bytes = 0;
  int jpeg_quality = 0;       ///< of photos; 0: all are JPEGs that the set stores
  double pruned_db = 0;       ///< loss that leaving out was allowed; 0: nothing is left out
  double depth_error_px = 0;  ///< largest error by rounding, pixels of disparity
  std::string warning;  ///< a failed validation in a line, which the page shows, too; or empty
};

/// Writes the page, or the site, of the set's source views. Nothing of it exists until it is whole.
/// Throws UsageError where the output exists, Error for a set without depth, a broken one, and
/// where max_mb cannot be met: then it says the least that can.
WebPageReport ExportWebPage(const WebPageRequest& request, Progress& progress);

}  // namespace dtr::pipeline
