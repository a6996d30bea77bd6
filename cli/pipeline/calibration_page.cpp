#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/pipeline/judge_calibration.h"
#include "dtr/base/error.h"
#include "dtr/io/image_io.h"
#include "dtr/report/encode.h"
#include "dtr/report/false_color.h"
#include "dtr/report/html.h"
#include "dtr/report/set_report.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr double kDrawnWidth = 720;   // px of a plot
constexpr double kLongestArrow = 40;  // px of a plot, the 95 % residual
constexpr size_t kWorstViews = 4;

std::string Fixed(double value) {
  return std::isfinite(value) ? fmt::format("{:.3f}", value) : "-";
}

// A plot of the image's shape; `body` in its pixels.
std::string Plot(const calib::LensCamera& lens, const std::string& body) {
  const double scale = kDrawnWidth / lens.width_px;
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{:.0f}\" height=\"{:.0f}\" viewBox=\"0 0 "
      "{} {}\"><rect width=\"100%\" height=\"100%\" fill=\"#f4f6f9\"/>{}</svg>",
      kDrawnWidth, scale * lens.height_px, lens.width_px, lens.height_px, body);
}

// Residuals as lines from where a corner was seen, `gain` times as long as they are.
std::string Arrows(const calib::LensCamera& lens, const std::vector<calib::ResidualArrow>& arrows,
                   double gain) {
  const double unit = lens.width_px / kDrawnWidth;
  std::string body;
  for (const calib::ResidualArrow& arrow : arrows) {
    const Eigen::Vector2d end = arrow.pixel + gain * arrow.residual_px;
    body += fmt::format(
        "<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\" stroke=\"#b3261e\" "
        "stroke-width=\"{:.2f}\"/><circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" "
        "fill=\"#2f5fb3\"/>",
        arrow.pixel.x(), arrow.pixel.y(), end.x(), end.y(), unit, arrow.pixel.x(), arrow.pixel.y(),
        1.3 * unit);
  }
  return body;
}

double GainOf(const calib::LensCamera& lens, const calib::ResidualStats& stats) {
  if (!(stats.p95_px > 0)) return 1;
  return kLongestArrow * lens.width_px / kDrawnWidth / stats.p95_px;
}

// A map as coloured cells, with the largest and smallest value in the caption.
void AddMap(report::HtmlReport& page, const std::string& what, const calib::LensCamera& lens,
            const calib::ImageMap& map) {
  const double largest = map.Largest();
  if (!std::isfinite(largest)) return;
  std::string body;
  double least = largest;
  for (const double v : map.values) {
    if (std::isfinite(v)) least = std::min(least, v);
  }
  const double w = static_cast<double>(lens.width_px) / map.columns;
  const double h = static_cast<double>(lens.height_px) / map.rows;
  for (int row = 0; row < map.rows; ++row) {
    for (int column = 0; column < map.columns; ++column) {
      const double v = map.values[static_cast<size_t>(row * map.columns + column)];
      if (!std::isfinite(v)) continue;
      const auto color =
          report::PaletteColor(report::Palette::kColor, largest > 0 ? v / largest : 0);
      body += fmt::format(
          "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
          "fill=\"#{:02x}{:02x}{:02x}\"/>",
          column * w, row * h, w + 0.5, h + 0.5, color[0], color[1], color[2]);
    }
  }
  page.Svg(fmt::format("{}: {:.3g} px (dark) to {:.3g} px (bright), median {:.3g} px", what, least,
                       largest, map.Median()),
           Plot(lens, body));
}

void AddCameraTable(report::HtmlReport& page, const calib::JudgeReport& judged) {
  std::vector<std::vector<report::Cell>> rows;
  for (const calib::JudgedCamera& camera : judged.cameras) {
    for (const auto& [what, stats] :
         {std::pair{judged.unseen ? "unseen, boards refitted" : "kept, boards refitted",
                    &camera.stored},
          std::pair{"kept, held out", &camera.held_out}}) {
      if (stats->count == 0) continue;
      rows.push_back({camera.name, std::string(what), std::to_string(stats->count),
                      Fixed(stats->rms_px), Fixed(stats->median_px), Fixed(stats->p95_px),
                      Fixed(stats->worst_px), Fixed(camera.noise_px)});
    }
  }
  page.Section("Residuals, px");
  page.Paragraph("Noise: what the noise of the pixels alone makes of a corner's coordinate.");
  page.Table({"Camera", "Corners", "Count", "RMS", "Median", "95 %", "Worst", "Noise"}, rows);
}

void AddRegions(report::HtmlReport& page, const calib::JudgedCamera& camera) {
  std::vector<std::vector<report::Cell>> rows;
  for (int row = 0; row < calib::kRegionsPerAxis; ++row) {
    rows.emplace_back();
    for (int column = 0; column < calib::kRegionsPerAxis; ++column) {
      const auto& region =
          camera.regions[static_cast<size_t>(row * calib::kRegionsPerAxis + column)];
      rows.back().push_back(region.count == 0
                                ? std::string("nothing seen")
                                : fmt::format("{:.3f} ({} corners)", region.rms_px, region.count));
    }
  }
  page.Table({"RMS, left", "middle", "right"}, rows);
}

void AddWorstViews(report::HtmlReport& page, const calib::LensCamera& lens,
                   const calib::JudgedCamera& camera, const std::optional<fs::path>& images) {
  const double gain = GainOf(lens, camera.stored);
  for (size_t i = 0; i < std::min(kWorstViews, camera.views.size()); ++i) {
    const calib::JudgedView& view = camera.views[i];
    std::string behind;
    if (images && fs::is_regular_file(*images / view.name)) {
      try {
        const ImageRgb8 photo = io::ReadImage(*images / view.name);
        behind = fmt::format(
            "<image width=\"{}\" height=\"{}\" opacity=\"0.6\" "
            "href=\"data:image/jpeg;base64,{}\"/>",
            lens.width_px, lens.height_px, report::Base64(report::EncodeJpeg(photo, 70)));
      } catch (const Error&) {
        behind.clear();  // drawn without its photo
      }
    }
    page.Svg(fmt::format("{}: RMS {:.3f} px, worst {:.3f} px, {} corners, {} outliers; residuals "
                         "{:.0f} times as long",
                         view.name, view.rms_px, view.worst_px, view.corners, view.outliers, gain),
             Plot(lens, behind + Arrows(lens, view.arrows, gain)));
  }
}

}  // namespace

std::string CalibrationPage(const calib::Calibration& calibration, const calib::JudgeReport& judged,
                            const std::string& title, const std::optional<fs::path>& images) {
  report::HtmlReport page(title);
  page.Verdict(judged.passed(), judged.passed() ? "The calibration passed its tests"
                                                : "The calibration broke at least one test");
  page.Section("Can the calibration be trusted?");
  report::AddChecks(page, judged.tests);
  AddCameraTable(page, judged);
  for (size_t c = 0; c < judged.cameras.size(); ++c) {
    const calib::JudgedCamera& camera = judged.cameras[c];
    const calib::LensCamera& lens = calibration.cameras[c].camera;
    page.Section("Camera " + camera.name);
    std::vector<calib::ResidualArrow> all;
    for (const calib::JudgedView& view : camera.views) {
      all.insert(all.end(), view.arrows.begin(), view.arrows.end());
    }
    const double gain = GainOf(lens, camera.stored);
    page.Svg(fmt::format("Every corner that was seen (blue) and its residual, {:.0f} times as long "
                         "(red). Arrows that point alike are no noise; blank regions are not "
                         "tested",
                         gain),
             Plot(lens, Arrows(lens, all, gain)));
    AddRegions(page, camera);
    AddMap(page, "Standard deviation of a projection at the boards' distance", lens,
           camera.near_uncertainty);
    AddMap(page, "The same at infinity", lens, camera.far_uncertainty);
    AddMap(page, "Stored less fresh solve", lens, camera.difference);
    page.Paragraph("The worst views:");
    AddWorstViews(page, lens, camera, images);
  }
  return page.Finish();
}

}  // namespace dtr::pipeline
