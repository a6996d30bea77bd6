#include "dtr/report/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "dtr/report/encode.h"

namespace dtr::report {
namespace {

constexpr double kWidth = 860, kHeight = 520;
constexpr double kLeft = 74, kRight = 24, kTop = 44, kBottom = 60;

// Okabe and Ito's colours, told apart by every kind of eye; shapes repeat what they say.
constexpr std::array<const char*, 8> kColors{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                             "#8a6d00", "#56b4e9", "#e69f00", "#444444"};

struct Axis {
  double low = 1, high = 10;  // of the data
  double from = 0, to = 1;    // on the image
  double At(double value) const {
    return from + (to - from) * std::log(value / low) / std::log(high / low);
  }
};

/// The data's range with a margin at both ends.
Axis Spanning(double low, double high, double from, double to) {
  constexpr double kMargin = 0.06, kMinRatio = 1.05;
  const double ratio = std::max(high / low, kMinRatio);
  const double middle = std::sqrt(low * high), half = std::pow(ratio, 0.5 + kMargin);
  return {middle / half, middle * half, from, to};
}

std::string Shape(size_t group, double x, double y, double size) {
  const auto polygon = [&](std::initializer_list<std::pair<double, double>> corners) {
    std::string text = "<polygon points=\"";
    for (const auto& [dx, dy] : corners) {
      text += fmt::format("{:.1f},{:.1f} ", x + size * dx, y + size * dy);
    }
    text.back() = '"';
    return text + "/>";
  };
  switch (group % 4) {
    case 0:
      return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\"/>", x, y, size);
    case 1:
      return polygon({{-0.9, -0.9}, {0.9, -0.9}, {0.9, 0.9}, {-0.9, 0.9}});
    case 2:
      return polygon({{0, -1.2}, {1.1, 0.8}, {-1.1, 0.8}});
    default:
      return polygon({{0, -1.3}, {1.3, 0}, {0, 1.3}, {-1.3, 0}});
  }
}

void RequireDrawable(const Plot& plot) {
  const auto positive = [](double value) { return value > 0 && std::isfinite(value); };
  if (plot.points.empty() || plot.groups.size() > kColors.size()) {
    throw std::invalid_argument("ScatterSvg: expected points, in at most eight groups");
  }
  for (const PlotPoint& point : plot.points) {
    if (!positive(point.x) || !positive(point.y) || point.group >= plot.groups.size() ||
        (point.x_low != point.x_high && !(positive(point.x_low) && positive(point.x_high)))) {
      throw std::invalid_argument("ScatterSvg: expected positive coordinates and a known group");
    }
  }
  for (const size_t i : plot.front) {
    if (i >= plot.points.size()) throw std::invalid_argument("ScatterSvg: no such point");
  }
}

std::string Text(double x, double y, const char* anchor, const std::string& text,
                 const char* more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y,
                     anchor, more, EscapeHtml(text));
}

std::string Grid(const Axis& x, const Axis& y) {
  std::string svg = "<g stroke=\"#e3e6ea\">\n";
  for (const double tick : LogTicks(x.low, x.high)) {
    svg += fmt::format("<path d=\"M{:.1f},{:.1f}V{:.1f}\"/>\n", x.At(tick), y.from, y.to);
  }
  for (const double tick : LogTicks(y.low, y.high)) {
    svg += fmt::format("<path d=\"M{:.1f},{:.1f}H{:.1f}\"/>\n", x.from, y.At(tick), x.to);
  }
  svg += "</g>\n<g fill=\"#4a5260\" font-size=\"13\">\n";
  for (const double tick : LogTicks(x.low, x.high)) {
    svg += Text(x.At(tick), y.from + 19, "middle", fmt::format("{:.4g}", tick));
  }
  for (const double tick : LogTicks(y.low, y.high)) {
    svg += Text(x.from - 8, y.At(tick) + 4.5, "end", fmt::format("{:.4g}", tick));
  }
  return svg + fmt::format(
                   "</g>\n<path d=\"M{:.1f},{:.1f}V{:.1f}H{:.1f}\" fill=\"none\" "
                   "stroke=\"#4a5260\"/>\n",
                   x.from, y.to, y.from, x.to);
}

std::string Legend(const Plot& plot) {
  std::string svg = "<g fill=\"#1d2430\" font-size=\"13\">\n";
  double x = kLeft;
  constexpr double kLetter = 7.2;  // about the width of one at 13 px
  for (size_t group = 0; group < plot.groups.size(); ++group) {
    svg += fmt::format("<g fill=\"{}\">{}</g>\n", kColors[group], Shape(group, x + 6, 20, 5));
    svg += Text(x + 17, 24.5, "start", plot.groups[group]);
    x += 36 + kLetter * static_cast<double>(plot.groups[group].size());
  }
  if (!plot.front.empty()) {
    svg += fmt::format(
        "<path d=\"M{:.1f},20h22\" stroke=\"#1d2430\" stroke-dasharray=\"5 3\" fill=\"none\"/>\n",
        x);
    svg += Text(x + 28, 24.5, "start", "Pareto front");
  }
  return svg + "</g>\n";
}

std::string Staircase(const Plot& plot, const Axis& x, const Axis& y) {
  if (plot.front.size() < 2) return "";
  std::string path;
  for (const size_t i : plot.front) {
    const PlotPoint& point = plot.points[i];
    path += path.empty() ? fmt::format("M{:.1f},{:.1f}", x.At(point.x), y.At(point.y))
                         : fmt::format("H{:.1f}V{:.1f}", x.At(point.x), y.At(point.y));
  }
  return "<path d=\"" + path +
         "\" fill=\"none\" stroke=\"#1d2430\" stroke-width=\"1.2\" stroke-dasharray=\"5 3\"/>\n";
}

std::string Marker(const PlotPoint& point, const Axis& x, const Axis& y) {
  const double px = x.At(point.x), py = y.At(point.y);
  std::string svg = fmt::format("<g fill=\"{0}\" stroke=\"{0}\">\n<title>{1}</title>\n",
                                kColors[point.group], EscapeHtml(point.tip));
  if (point.x_low < point.x_high) {
    // Bars may end beyond the axes, where the image ends, too.
    const double from = std::clamp(x.At(point.x_low), x.from, x.to);
    const double to = std::clamp(x.At(point.x_high), x.from, x.to);
    svg +=
        fmt::format("<path d=\"M{:.1f},{:.1f}H{:.1f}\" stroke-opacity=\"0.45\"/>\n", from, py, to);
  }
  // Around the marker, so that it is easily pointed at.
  svg += fmt::format(
      "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"11\" fill-opacity=\"0\" stroke=\"none\"/>\n", px,
      py);
  if (point.ringed) {
    svg += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"10\" fill=\"none\" stroke=\"#1d2430\" "
        "stroke-width=\"1.6\"/>\n",
        px, py);
  }
  return svg + "<g stroke=\"#ffffff\" stroke-width=\"0.8\">" + Shape(point.group, px, py, 5) +
         "</g>\n</g>\n";
}

struct Box {
  double left, top, right, bottom;
  bool Meets(const Box& other) const {
    return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
  }
};

/// Labels where they meet the fewest points and labels before them: right, left, above, below.
std::string Labels(const Plot& plot, const Axis& x, const Axis& y) {
  constexpr double kLetter = 6.6, kHalfHeight = 8, kMarker = 6;
  std::vector<Box> taken;
  for (const PlotPoint& point : plot.points) {
    const double px = x.At(point.x), py = y.At(point.y);
    taken.push_back({px - kMarker, py - kMarker, px + kMarker, py + kMarker});
  }
  // A white rim keeps words readable where lines pass behind them.
  std::string svg =
      "<g fill=\"#1d2430\" font-size=\"12\" stroke=\"#ffffff\" stroke-width=\"3\" "
      "paint-order=\"stroke\">\n";
  for (const PlotPoint& point : plot.points) {
    if (point.label.empty()) continue;
    const double px = x.At(point.x), py = y.At(point.y);
    const double width = kLetter * static_cast<double>(point.label.size());
    const std::array<std::pair<double, double>, 6> middles{{{px + 13 + width / 2, py},
                                                            {px - 13 - width / 2, py},
                                                            {px, py - 19},
                                                            {px, py + 19},
                                                            {px + 13 + width / 2, py - 15},
                                                            {px + 13 + width / 2, py + 15}}};
    std::pair<double, double> best = middles[0];
    long fewest = std::numeric_limits<long>::max();
    for (const auto& [mx, my] : middles) {
      const Box box{mx - width / 2, my - kHalfHeight, mx + width / 2, my + kHalfHeight};
      long meets = std::count_if(taken.begin(), taken.end(),
                                 [&](const Box& other) { return box.Meets(other); });
      if (box.left < x.from || box.right > x.to || box.top < y.to || box.bottom > y.from) {
        meets += 100;  // beyond the axes only where there is no other place
      }
      if (meets >= fewest) continue;
      fewest = meets;
      best = {mx, my};
    }
    const auto& [mx, my] = best;
    taken.push_back({mx - width / 2, my - kHalfHeight, mx + width / 2, my + kHalfHeight});
    svg += Text(mx, my + 4, "middle", point.label);
  }
  return svg + "</g>\n";
}

}  // namespace

std::vector<double> LogTicks(double low, double high) {
  constexpr size_t kEnough = 4;
  for (const std::vector<double>& steps : {std::vector<double>{1}, std::vector<double>{1, 2, 5}}) {
    std::vector<double> ticks;
    const int first = static_cast<int>(std::floor(std::log10(low)));
    const int last = static_cast<int>(std::ceil(std::log10(high)));
    for (int decade = first; decade <= last; ++decade) {
      for (const double step : steps) {
        const double tick = step * std::pow(10, decade);
        if (tick >= low && tick <= high) ticks.push_back(tick);
      }
    }
    if (ticks.size() >= kEnough) return ticks;
  }
  const double rough = (high - low) / kEnough;
  const double power = std::pow(10, std::floor(std::log10(rough)));
  double step = power;
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= rough) {
      step = factor * power;
      break;
    }
  }
  std::vector<double> ticks;
  for (double n = std::ceil(low / step); n * step <= high; ++n) ticks.push_back(n * step);
  return ticks;
}

std::string ScatterSvg(const Plot& plot) {
  RequireDrawable(plot);
  double x_low = HUGE_VAL, x_high = 0, y_low = HUGE_VAL, y_high = 0;
  for (const PlotPoint& point : plot.points) {
    x_low = std::min(x_low, point.x);
    x_high = std::max(x_high, point.x);
    y_low = std::min(y_low, point.y);
    y_high = std::max(y_high, point.y);
  }
  const Axis x = Spanning(x_low, x_high, kLeft, kWidth - kRight);
  const Axis y = Spanning(y_low, y_high, kHeight - kBottom, kTop);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" role=\"img\" "
      "font-family=\"system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
      kWidth, kHeight);
  svg += Grid(x, y) + Legend(plot);
  svg += "<g fill=\"#1d2430\" font-size=\"14\">\n";
  svg += Text((x.from + x.to) / 2, kHeight - 14, "middle", plot.x_label);
  const double middle = (y.from + y.to) / 2;
  svg += Text(18, middle, "middle", plot.y_label,
              fmt::format(" transform=\"rotate(-90 18 {:.1f})\"", middle).c_str());
  svg += "</g>\n" + Staircase(plot, x, y);
  for (const PlotPoint& point : plot.points) svg += Marker(point, x, y);
  return svg + Labels(plot, x, y) + "</svg>\n";
}

}  // namespace dtr::report
