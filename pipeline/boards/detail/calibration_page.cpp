#include <fmt/format.h>

#include <algorithm>

#include "calib/validation/conclusion.h"
#include "dtr/base/error.h"
#include "dtr/io/image_io.h"
#include "dtr/report/html.h"
#include "dtr/report/set_report.h"
#include "pipeline/boards/validate_calibration.h"
#include "pipeline/core/reports/residual_plots.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr size_t kWorstViews = 4;
constexpr double kSamePx = 1e-3;  // a map of less than that shows rounding

PlotSize SizeOf(const calib::LensCamera& lens) { return {lens.width_px, lens.height_px}; }

void AddCameraTable(report::HtmlReport& page, const calib::BoardValidation& judged) {
  std::vector<std::vector<report::Cell>> rows;
  for (const calib::ValidatedCamera& camera : judged.cameras) {
    for (const auto& [what, stats] :
         {std::pair{judged.test_views ? "held out, boards refitted" : "stored, boards refitted",
                    &camera.stored},
          std::pair{"stored, held out", &camera.held_out}}) {
      if (stats->count == 0) continue;
      rows.push_back({camera.name, std::string(what), std::to_string(stats->count),
                      FixedPx(stats->rms_px), FixedPx(stats->median_px), FixedPx(stats->p95_px),
                      FixedPx(stats->worst_px), FixedPx(camera.noise_px)});
    }
  }
  page.Section("Residuals, px");
  page.Paragraph("Noise: what the noise of the pixels alone makes of a corner's coordinate.");
  page.Table({"Camera", "Corners", "Count", "RMS", "Median", "95 %", "Worst", "Noise"}, rows);
}

void AddDifference(report::HtmlReport& page, const PlotSize& size,
                   const calib::ImageMap& difference) {
  if (difference.Largest() < kSamePx) {
    page.Paragraph(fmt::format(
        "What is stored and what a fresh solve makes of it differ by less than {} px everywhere.",
        kSamePx));
    return;
  }
  AddMap(page, "Stored less fresh solve", " px", size, difference);
}

// The EXIF orientation that brings a rotated photo back onto the sensor's grid.
int PutsBack(calib::PhotoRotation rotation) {
  if (rotation == calib::PhotoRotation::kNone) return 1;
  return rotation == calib::PhotoRotation::kClockwise ? 8 : 6;
}

void AddWorstViews(report::HtmlReport& page, const calib::LensCamera& lens,
                   const calib::ValidatedCamera& camera, const std::optional<fs::path>& images) {
  const PlotSize size = SizeOf(lens);
  const double gain = ArrowGain(size, camera.stored);
  for (size_t i = 0; i < std::min(kWorstViews, camera.views.size()); ++i) {
    const calib::ValidatedView& view = camera.views[i];
    std::string behind;
    if (images && fs::is_regular_file(*images / view.name)) {
      try {
        const ImageRgb8 photo = io::ReadImage(*images / view.name);
        behind = PhotoBehind(size, io::ApplyExifOrientation(photo, PutsBack(view.rotation)));
      } catch (const Error&) {
        behind.clear();  // drawn without its photo
      }
    }
    page.Svg(fmt::format("{}: RMS {:.3f} px, worst {:.3f} px, {} corners, {} outlier{}; residuals "
                         "{:.0f} times as long",
                         view.name, view.rms_px, view.worst_px, view.corners, view.outliers,
                         view.outliers == 1 ? "" : "s", gain),
             ImagePlot(size, behind + Arrows(size, view.arrows, gain)));
  }
}

}  // namespace

std::string CalibrationPage(const calib::Calibration& calibration,
                            const calib::BoardValidation& judged, const std::string& title,
                            const std::optional<fs::path>& images) {
  report::HtmlReport page(title);
  page.Result(judged.passed(), calib::Conclusion(judged.tests, calib::Validated::kBoards));
  page.Section("Validation of the calibration");
  report::AddChecks(page, judged.tests);
  AddCameraTable(page, judged);
  for (size_t c = 0; c < judged.cameras.size(); ++c) {
    const calib::ValidatedCamera& camera = judged.cameras[c];
    const calib::LensCamera& lens = calibration.cameras[c].camera;
    page.Section("Camera " + camera.name);
    std::vector<calib::ResidualArrow> all;
    for (const calib::ValidatedView& view : camera.views) {
      all.insert(all.end(), view.arrows.begin(), view.arrows.end());
    }
    const PlotSize size = SizeOf(lens);
    const double gain = ArrowGain(size, camera.stored);
    page.Svg(fmt::format("Every corner that was seen (blue) and its residual, {:.0f} times as long "
                         "(red). Arrows that point alike are no noise; blank regions are not "
                         "tested",
                         gain),
             ImagePlot(size, Arrows(size, all, gain)));
    AddRegionTable(page, camera.regions, "corners");
    AddMap(page, "Standard deviation of a projection at the boards' distance", " px", size,
           camera.near_uncertainty);
    for (const calib::UncertaintyAt& at : camera.uncertainty_at) {
      AddMap(page,
             fmt::format("The same at {:g}{}", at.distance,
                         calibration.board.metric ? " m" : " of the squares' unit"),
             " px", size, at.map);
    }
    AddMap(page, "The same at infinity", " px", size, camera.far_uncertainty);
    AddDifference(page, size, camera.difference);
    page.Paragraph("The worst views:");
    AddWorstViews(page, lens, camera, images);
  }
  return page.Finish();
}

}  // namespace dtr::pipeline
