#include "viewer/shown.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dtr/cpu/contributions.h"
#include "dtr/report/false_color.h"
#include "viewer/controller.h"
#include "viewer/navigation.h"

namespace dtr::viewer {
namespace {

constexpr Rgb kSeen{230, 230, 230};

Rgb ViewColour(int index) {
  // Hues a golden angle apart: no two of a handful are alike.
  constexpr double kGolden = 0.61803398874989485;
  const double hue = 6 * (index * kGolden - std::floor(index * kGolden));
  Rgb colour{};
  for (int c = 0; c < 3; ++c) {
    const double away = std::abs(std::fmod(hue + 6 - 2 * c, 6) - 3);
    colour[static_cast<size_t>(c)] =
        static_cast<std::uint8_t>(std::lround(60 + 180 * std::clamp(away - 1, 0.0, 1.0)));
  }
  return colour;
}

/// `colour_at` gives the colour of pixel index p, which some view saw.
template <typename ColourAt>
ImageRgb8 Painted(const RenderResult& result, const ColourAt& colour_at) {
  ImageRgb8 image(result.image.width(), result.image.height(), 3);
  for (size_t p = 0; p < result.coverage.data().size(); ++p) {
    const Rgb colour = result.coverage.data()[p] != 0 ? colour_at(p) : report::kHoleColor;
    std::copy(colour.begin(), colour.end(),
              image.data().begin() + static_cast<std::ptrdiff_t>(3 * p));
  }
  return image;
}

cpu::Contributions ContributionsOf(const Drawn& drawn) {
  return cpu::ContributionsTo(drawn.result.depth, drawn.scene, drawn.camera.camera,
                              drawn.camera.cam_from_world, drawn.options);
}

/// The views' colours, mixed by their shares.
ImageRgb8 WeightImage(const Drawn& drawn) {
  const cpu::Contributions found = ContributionsOf(drawn);
  return Painted(drawn.result, [&](size_t p) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < found.views.size(); ++i) {
      const Rgb colour = drawn.colours.Of(*drawn.scene.views[static_cast<size_t>(found.views[i])]);
      sum += found.shares[i].data()[p] * Eigen::Vector3d(colour[0], colour[1], colour[2]);
    }
    Rgb mixed{};
    for (int c = 0; c < 3; ++c) {
      mixed[static_cast<size_t>(c)] =
          static_cast<std::uint8_t>(std::lround(std::clamp(sum[c], 0.0, 255.0)));
    }
    return mixed;
  });
}

/// Standard deviation of depth over depth, by the views' shares; 0 where no view has one.
Grid<float> SigmaImage(const Drawn& drawn, const SigmaOf& sigma_of) {
  const cpu::Contributions found = ContributionsOf(drawn);
  const DepthImage& depth = drawn.result.depth;
  Grid<float> picture(depth.width(), depth.height());
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      double sum = 0, shares = 0;
      for (size_t i = 0; i < found.views.size(); ++i) {
        const double share = found.shares[i](x, y), w = found.inverse_depth[i](x, y);
        if (!(share > 0) || !(w > 0)) continue;
        const View& view = *drawn.scene.views[static_cast<size_t>(found.views[i])];
        const Eigen::Vector3d point = WorldPoint(drawn.camera, {x + 0.5, y + 0.5}, 1 / w);
        const auto sigma_z = SigmaZ(view, point, sigma_of);
        if (!sigma_z) continue;
        sum += share * *sigma_z / (view.cam_from_world * point).z();
        shares += share;
      }
      if (shares > 0) picture(x, y) = static_cast<float>(sum / shares);
    }
  }
  return picture;
}

std::optional<Scale> With(const std::optional<report::ColorScale>& scale, Scale::Unit unit) {
  if (!scale) return std::nullopt;
  return Scale{scale->dark, scale->bright, unit};
}

}  // namespace

const char* NameOf(Shown shown) {
  switch (shown) {
    case Shown::kColour:
      return "colour";
    case Shown::kDepth:
      return "depth";
    case Shown::kSigma:
      return "sigma";
    case Shown::kWeights:
      return "weights";
    case Shown::kViewCount:
      return "view count";
    case Shown::kCoverage:
      return "coverage";
    case Shown::kWireframe:
      return "wireframe";
  }
  return "";
}

const char* LegendOf(Shown shown) {
  switch (shown) {
    case Shown::kColour:
      return "what the views show, blended";
    case Shown::kDepth:
      return "closer is brighter; green: no view saw it";
    case Shown::kSigma:
      return "standard deviation of depth over depth: dark is certain; green: not known";
    case Shown::kWeights:
      return "each view's colour, mixed by its share of the pixel";
    case Shown::kViewCount:
      return "brighter: more views blended; green: none";
    case Shown::kCoverage:
      return "light: some view saw it; green: none did";
    case Shown::kWireframe:
      return "the views' reduced meshes, one colour per view; the nearest view's on top";
  }
  return "";
}

ViewColours::ViewColours(const DtrSet& set) {
  for (size_t frame = 0; frame < set.frames.size(); ++frame) {
    for (const View* view : SurroundingsOf(set, frame).views) {
      by_name_.try_emplace(view->name, ViewColour(static_cast<int>(by_name_.size())));
    }
  }
}

Rgb ViewColours::Of(const View& view) const {
  const auto found = by_name_.find(view.name);
  return found != by_name_.end() ? found->second : Rgb{};
}

std::string TextOf(double value, Scale::Unit unit, const std::string& length_unit) {
  switch (unit) {
    case Scale::Unit::kLength:
      if (std::isinf(value)) return "infinity";
      return fmt::format("{:.3g} {}", value, length_unit);
    case Scale::Unit::kShare:
      return fmt::format("{:.2g} %", 100 * value);
    case Scale::Unit::kViews:
      return fmt::format("{:.0f} {}", value, value == 1 ? "view" : "views");
  }
  return "";
}

FalseColours FalseColour(Shown shown, const Drawn& drawn, const SigmaOf& sigma_of) {
  const RenderResult& result = drawn.result;
  switch (shown) {
    case Shown::kColour:
    case Shown::kWireframe:
      break;
    case Shown::kDepth:
      return {report::ColorizeDepth(result.depth),
              With(report::ScaleOfDepth(result.depth), Scale::Unit::kLength)};
    case Shown::kSigma: {
      const Grid<float> sigma = SigmaImage(drawn, sigma_of);
      return {report::ColorizeSigma(sigma), With(report::ScaleOfSigma(sigma), Scale::Unit::kShare)};
    }
    case Shown::kWeights:
      return {WeightImage(drawn), {}};
    case Shown::kViewCount: {
      const int views = std::max(drawn.options.views, 1);
      return {Painted(result,
                      [&](size_t p) {
                        return report::PaletteColor(
                            report::Palette::kColor,
                            static_cast<double>(result.view_count.data()[p]) / views);
                      }),
              Scale{0, static_cast<double>(views), Scale::Unit::kViews}};
    }
    case Shown::kCoverage:
      return {Painted(result, [](size_t) { return kSeen; }), {}};
  }
  throw std::invalid_argument("FalseColour: not a false colour");
}

}  // namespace dtr::viewer
