// dtr/report/plot.h -- scatter plots on logarithmic axes, as SVG.
#pragma once
#include <string>
#include <vector>

namespace dtr::report {

struct PlotPoint {
  double x = 0, y = 0;           ///< > 0
  double x_low = 0, x_high = 0;  ///< ends of a bar through the point; equal: no bar
  size_t group = 0;              ///< index into Plot::groups: colour and shape
  std::string tip;               ///< shown while the pointer rests on the point; may have lines
  std::string label;             ///< written beside it; empty: none
  bool ringed = false;           ///< marked out from the others
};

/// Why not gnuplot: its SVG shows what a point is by a script alone, which a page that runs none
/// cannot have.
struct Plot {
  std::string x_label, y_label;
  std::vector<std::string> groups;  ///< names in the legend; at most 8
  std::vector<PlotPoint> points;
  std::vector<size_t> front;  ///< points joined by a staircase, by rising x
};

/// An SVG document of 860 x 520 units that needs nothing else: no script, no font, no style of the
/// page it is in. The same plot gives the same bytes. Points near each other keep their places;
/// labels move out of each other's way where there is room.
/// Throws std::invalid_argument for coordinates that are not positive and finite, more groups than
/// there are colours, or indices that are out of range.
std::string ScatterSvg(const Plot& plot);

/// Where a logarithmic axis over [low, high] has its numbers: decades, or 1-2-5 in them, or even
/// steps, whichever are the first to be at least four.
std::vector<double> LogTicks(double low, double high);

}  // namespace dtr::report
