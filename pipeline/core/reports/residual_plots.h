// pipeline/core/reports/residual_plots.h -- residuals and maps over an image, as the reports draw
// them.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "calib/validation/projection.h"
#include "calib/validation/reprojection.h"
#include "dtr/report/html.h"
#include "dtr/types/grid.h"

namespace dtr::pipeline {

/// What is drawn on.
struct PlotSize {
  int width_px = 0, height_px = 0;  ///< of the image
};

/// An SVG document of the image's shape; `body` in its pixels.
std::string ImagePlot(const PlotSize& size, const std::string& body);

/// Residuals as lines (red) from where something was seen (blue), `gain` times as long as they are.
std::string Arrows(const PlotSize& size, const std::vector<calib::ResidualArrow>& arrows,
                   double gain);
/// How many times as long they are drawn, so that 95 % are no longer than is good to look at.
double ArrowGain(const PlotSize& size, const calib::ResidualStats& stats);

/// A photo behind what is drawn, pale; it may be smaller than the image.
std::string PhotoBehind(const PlotSize& size, const ImageRgb8& photo);

/// A map as coloured cells, with its smallest, largest and median value, in `unit`, in the caption;
/// one that spans much is coloured by the logarithm, and cells without a value are blank, which the
/// caption says. Nothing is added for a map without a finite value.
void AddMap(report::HtmlReport& page, const std::string& what, const std::string& unit,
            const PlotSize& size, const calib::ImageMap& map);

/// RMS and count of kRegionsPerAxis^2 regions, as a table; `what` is counted.
void AddRegionTable(report::HtmlReport& page, std::span<const calib::ResidualStats> regions,
                    const std::string& what);

/// "0.123", or "-" where there is no number.
std::string FixedPx(double value);

}  // namespace dtr::pipeline
