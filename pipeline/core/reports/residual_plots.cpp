#include "pipeline/core/reports/residual_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "dtr/report/encode.h"
#include "dtr/report/false_color.h"

namespace dtr::pipeline {
namespace {

constexpr double kDrawnWidth = 720;   // px of a plot
constexpr double kLongestArrow = 40;  // px of a plot, the 95 % residual
constexpr int kPhotoQuality = 70;
// A map that spans more than this is coloured by its logarithm: else all but its worst corner is
// one colour. What is less than a thousandth of the largest value is as dark as that.
constexpr double kWideSpan = 20, kWidestSpan = 1000;

// Finite values from the least to the largest as 0 to 1.
class Shade {
 public:
  explicit Shade(const calib::ImageMap& map) : least_(map.Largest()), largest_(map.Largest()) {
    for (const double v : map.values) {
      if (std::isfinite(v)) least_ = std::min(least_, v);
    }
    by_logarithm_ = least_ > 0 && largest_ > kWideSpan * least_;
  }
  double least() const { return least_; }
  /// What is drawn darkest, with all that is less.
  double darkest() const { return by_logarithm_ ? std::max(least_, largest_ / kWidestSpan) : 0; }
  double largest() const { return largest_; }
  bool by_logarithm() const { return by_logarithm_; }
  double Of(double value) const {
    if (by_logarithm_) {
      return std::max(0.0, std::log(value / darkest()) / std::log(largest_ / darkest()));
    }
    return largest_ > 0 ? value / largest_ : 0;
  }

 private:
  double least_, largest_;
  bool by_logarithm_ = false;
};

}  // namespace

std::string FixedPx(double value) {
  return std::isfinite(value) ? fmt::format("{:.3f}", value) : "-";
}

std::string ImagePlot(const PlotSize& size, const std::string& body) {
  const double scale = kDrawnWidth / size.width_px;
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{:.0f}\" height=\"{:.0f}\" viewBox=\"0 0 "
      "{} {}\"><rect width=\"100%\" height=\"100%\" fill=\"#f4f6f9\"/>{}</svg>",
      kDrawnWidth, scale * size.height_px, size.width_px, size.height_px, body);
}

std::string Arrows(const PlotSize& size, const std::vector<calib::ResidualArrow>& arrows,
                   double gain) {
  const double unit = size.width_px / kDrawnWidth;
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

double ArrowGain(const PlotSize& size, const calib::ResidualStats& stats) {
  if (!(stats.p95_px > 0)) return 1;
  return kLongestArrow * size.width_px / kDrawnWidth / stats.p95_px;
}

std::string PhotoBehind(const PlotSize& size, const ImageRgb8& photo) {
  return fmt::format(
      "<image width=\"{}\" height=\"{}\" opacity=\"0.6\" preserveAspectRatio=\"none\" "
      "href=\"data:image/jpeg;base64,{}\"/>",
      size.width_px, size.height_px, report::Base64(report::EncodeJpeg(photo, kPhotoQuality)));
}

void AddMap(report::HtmlReport& page, const std::string& what, const std::string& unit,
            const PlotSize& size, const calib::ImageMap& map) {
  if (!std::isfinite(map.Largest())) return;
  const Shade shade(map);
  std::string body;
  bool blank = false;
  const double w = static_cast<double>(size.width_px) / map.columns;
  const double h = static_cast<double>(size.height_px) / map.rows;
  for (int row = 0; row < map.rows; ++row) {
    for (int column = 0; column < map.columns; ++column) {
      const double v = map.values[static_cast<size_t>(row * map.columns + column)];
      if (!std::isfinite(v)) {
        blank = true;
        continue;
      }
      const auto color = report::PaletteColor(report::Palette::kColor, shade.Of(v));
      body += fmt::format(
          "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
          "fill=\"#{:02x}{:02x}{:02x}\"/>",
          column * w, row * h, w + 0.5, h + 0.5, color[0], color[1], color[2]);
    }
  }
  const std::string least =
      shade.darkest() == shade.least()
          ? ""
          : fmt::format("{}; the smallest is {:.3g}{}",
                        shade.darkest() > shade.least() ? " with all below" : "", shade.least(),
                        unit);
  page.Svg(fmt::format("{}: {:.3g}{} (dark{}) to {:.3g}{} (bright){}, median {:.3g}{}{}", what,
                       shade.darkest(), unit, least, shade.largest(), unit,
                       shade.by_logarithm() ? ", by the logarithm" : "", map.Median(), unit,
                       blank ? "; blank: unknown" : ""),
           ImagePlot(size, body));
}

void AddRegionTable(report::HtmlReport& page, std::span<const calib::ResidualStats> regions,
                    const std::string& what) {
  std::vector<std::vector<report::Cell>> rows;
  for (int row = 0; row < calib::kRegionsPerAxis; ++row) {
    rows.emplace_back();
    for (int column = 0; column < calib::kRegionsPerAxis; ++column) {
      const auto& region = regions[static_cast<size_t>(row * calib::kRegionsPerAxis + column)];
      rows.back().push_back(region.count == 0
                                ? std::string("nothing seen")
                                : fmt::format("{:.3f} ({} {})", region.rms_px, region.count, what));
    }
  }
  page.Table({"RMS, left", "middle", "right"}, rows);
}

}  // namespace dtr::pipeline
