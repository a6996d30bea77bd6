#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "calib/validation/conclusion.h"
#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"
#include "dtr/io/set_io.h"
#include "dtr/report/contact_sheet.h"
#include "dtr/report/html.h"
#include "dtr/report/set_report.h"
#include "pipeline/core/reports/residual_plots.h"
#include "pipeline/validate/validate.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr size_t kWorstShownViews = 4;
constexpr size_t kMaxDrawn = 1500, kMaxOfView = 500;  // arrows of a plot; more is a blot
constexpr int kCoverageColumns = 24;                  // of a map that counts
constexpr int kPlacedColumns = 12;                    // of a map with some 40 points per view
constexpr int kPhotoSidePx = 720;

// Views of one size of image, as indices.
using Sizes = std::map<std::pair<int, int>, std::vector<size_t>>;

Sizes SizesOf(const std::vector<View>& views) {
  Sizes sizes;
  for (size_t i = 0; i < views.size(); ++i) {
    sizes[{views[i].camera.width_px(), views[i].camera.height_px()}].push_back(i);
  }
  return sizes;
}

void AddViewTable(report::HtmlReport& page, const std::vector<View>& views,
                  const calib::ValidationReport& report) {
  std::vector<std::vector<report::Cell>> rows;
  for (size_t i = 0; i < views.size(); ++i) {
    const calib::CameraValidation& camera = report.cameras[i];
    const calib::ResidualStats& held_out = camera.held_out;
    rows.push_back({camera.name, std::string(NameOf(views[i].role)), std::to_string(held_out.count),
                    FixedPx(held_out.rms_px), FixedPx(held_out.median_px), FixedPx(held_out.p95_px),
                    FixedPx(held_out.worst_px), FixedPx(camera.stored.rms_px),
                    FixedPx(camera.stored.mean_px.norm()),
                    std::to_string(camera.short_tracks + camera.weak_geometry),
                    std::to_string(camera.impossible)});
  }
  page.Section("Residuals of the views, px");
  page.Paragraph(
      "Every observation is predicted from a point that the other cameras alone placed; stored: "
      "against the points as the set keeps them. Not tested: points of fewer than 3 views, and "
      "points that the others do not fix. Impossible: no point in front of the cameras explains "
      "the observation.");
  page.Table({"View", "Role", "Tested", "RMS", "Median", "95 %", "Worst", "Stored RMS",
              "Stored mean", "Not tested", "Impossible"},
             rows);
  if (!report.kept_apart.empty()) {
    page.Paragraph(fmt::format(
        "Held out without observations, so not tested here; dtr evaluate measures the set by them: "
        "{}.",
        fmt::join(report.kept_apart, ", ")));
  }
}

calib::ImageMap EmptyMapOf(const PlotSize& size, int columns) {
  calib::ImageMap map;
  map.columns = columns;
  map.rows = std::max(1, static_cast<int>(std::lround(static_cast<double>(columns) *
                                                      size.height_px / size.width_px)));
  map.values.assign(static_cast<size_t>(map.columns * map.rows),
                    std::numeric_limits<double>::quiet_NaN());
  return map;
}

size_t CellAt(const calib::ImageMap& map, const PlotSize& size, const Eigen::Vector2d& pixel) {
  return static_cast<size_t>(calib::CellOf(pixel.y(), size.height_px, map.rows) * map.columns +
                             calib::CellOf(pixel.x(), size.width_px, map.columns));
}

// How many of the tested observations lie in each cell. Of a view with more arrows than are kept,
// each stands for several.
calib::ImageMap Coverage(const PlotSize& size, const calib::ValidationReport& report,
                         const std::vector<size_t>& views) {
  calib::ImageMap map = EmptyMapOf(size, kCoverageColumns);
  std::fill(map.values.begin(), map.values.end(), 0);
  for (const size_t v : views) {
    const calib::CameraValidation& camera = report.cameras[v];
    for (const calib::ResidualArrow& arrow : camera.arrows) {
      map.values[CellAt(map, size, arrow.pixel)] +=
          static_cast<double>(camera.held_out.count) / static_cast<double>(camera.arrows.size());
    }
  }
  return map;
}

// Median over the cell's points of how uncertain they are where two other views place them.
calib::ImageMap PlacedMap(const PlotSize& size, const calib::ValidationReport& report,
                          const std::vector<size_t>& views) {
  calib::ImageMap map = EmptyMapOf(size, kPlacedColumns);
  std::vector<std::vector<double>> cells(map.values.size());
  for (const size_t v : views) {
    for (const calib::PlacedPixel& point : report.cameras[v].placed) {
      cells[CellAt(map, size, point.pixel)].push_back(point.sigma_px);
    }
  }
  for (size_t i = 0; i < cells.size(); ++i) {
    if (!cells[i].empty()) map.values[i] = UpperMedian(cells[i]);
  }
  return map;
}

// Evenly many of the arrows, at most so many.
std::vector<calib::ResidualArrow> Thinned(const std::vector<calib::ResidualArrow>& arrows,
                                          size_t most) {
  const size_t step = std::max<size_t>(1, (arrows.size() + most - 1) / most);
  std::vector<calib::ResidualArrow> thinned;
  for (size_t i = 0; i < arrows.size(); i += step) thinned.push_back(arrows[i]);
  return thinned;
}

void AddImager(report::HtmlReport& page, const PlotSize& size,
               const calib::ValidationReport& report, const std::vector<size_t>& views) {
  std::vector<calib::ResidualArrow> all;
  std::vector<Eigen::Vector2d> residuals;
  for (const size_t v : views) {
    for (const calib::ResidualArrow& arrow : report.cameras[v].arrows) {
      all.push_back(arrow);
      residuals.push_back(arrow.residual_px);
    }
  }
  const std::vector<calib::ResidualArrow> arrows = Thinned(all, kMaxDrawn);
  page.Section(fmt::format("All views of {} x {} px together ({})", size.width_px, size.height_px,
                           views.size()));
  if (arrows.empty()) {
    page.Paragraph("No observation could be tested.");
    return;
  }
  const double gain = ArrowGain(size, calib::Summarise(residuals));
  page.Svg(
      fmt::format("{} of the tested observations (blue) and their residuals, {:.3g} times as "
                  "long (red). Arrows of a region that point alike are no noise; blank regions "
                  "are not tested",
                  arrows.size(), gain),
      ImagePlot(size, Arrows(size, arrows, gain)));
  AddMap(page, "Coverage: tested observations per cell", "", size, Coverage(size, report, views));
  AddMap(
      page,
      "Uncertainty: standard deviation of where two other views position a view's points, for the "
      "calibration's sake alone",
      " px", size, PlacedMap(size, report, views));
}

void AddWorstViews(report::HtmlReport& page, const fs::path& folder, const std::vector<View>& views,
                   const calib::ValidationReport& report) {
  std::vector<size_t> order;
  for (size_t i = 0; i < views.size(); ++i) {
    if (report.cameras[i].held_out.count > 0) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return report.cameras[a].held_out.rms_px > report.cameras[b].held_out.rms_px;
  });
  order.resize(std::min(order.size(), kWorstShownViews));
  if (order.empty()) return;
  page.Section("The worst views");
  for (const size_t i : order) {
    const calib::CameraValidation& camera = report.cameras[i];
    const PlotSize size{views[i].camera.width_px(), views[i].camera.height_px()};
    const double gain = ArrowGain(size, camera.held_out);
    View view = views[i];
    io::LoadOptions load;
    load.depth = false;
    io::LoadPixels(folder, view, load);
    page.Svg(fmt::format("{}: RMS {:.3f} px, worst {:.3f} px, {} tested; residuals {:.3g} times as "
                         "long",
                         camera.name, camera.held_out.rms_px, camera.held_out.worst_px,
                         camera.held_out.count, gain),
             ImagePlot(size, PhotoBehind(size, report::Shrink(view.image, kPhotoSidePx)) +
                                 Arrows(size, Thinned(camera.arrows, kMaxOfView), gain)));
  }
}

}  // namespace

std::string ValidationPage(const fs::path& folder, const DtrSet& set, const SetValidation& report,
                           const std::string& title, const std::string& conclusion) {
  const std::vector<View>& views = set.frames.front().views;
  report::HtmlReport page(title);
  page.Result(report.passed(), conclusion);
  page.Section("Validation of the calibration");
  report::AddChecks(page, report.tests);
  if (!report.adjustment.not_validated.empty()) {
    page.Paragraph("Not validated by a fresh bundle adjustment: " +
                   report.adjustment.not_validated);
  }
  AddViewTable(page, views, report);
  page.Section("Residuals by region of the image, all views");
  AddRegionTable(page, report.regions, "observations");
  for (const auto& [size, indices] : SizesOf(views)) {
    AddImager(page, {size.first, size.second}, report, indices);
  }
  AddWorstViews(page, folder, views, report);
  return page.Finish();
}

}  // namespace dtr::pipeline
