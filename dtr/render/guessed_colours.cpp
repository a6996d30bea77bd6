#include "dtr/render/guessed_colours.h"

#include <algorithm>
#include <cmath>

#include "dtr/base/parallel_for.h"
#include "dtr/render/colour.h"
#include "dtr/render/frame.h"
#include "dtr/render/texture.h"

namespace dtr {
namespace {

// SPEC 7.4.
constexpr double kExposureSamples = 20000, kNearWhite = 0.85, kMaxExposure = 2,
                 kExposureNoise = 0.01;
constexpr int kMinExposed = 200;
constexpr double kRimShare = 0.05;   // of the shorter side
constexpr double kMinFadePx = 1e-6;  // at a view's own place: no pixel's centre is as near

Eigen::Matrix3d CalibrationOf(const PinholeCamera& camera) {
  Eigen::Matrix3d k;
  k << camera.fx_px(), 0, camera.cx_px(), 0, camera.fy_px(), camera.cy_px(), 0, 0, 1;
  return k;
}

/// Depth that the view measured at an image pixel. Dividing costs as much as all the rest.
float DepthAt(const View& view, int x, int y) {
  if (view.depth_scale == 1) return view.depth(x, y);
  return view.depth(x / view.depth_scale, y / view.depth_scale);
}

/// SPEC 7.4, and 4.8 near the view's own place.
double FadeWidth(const View& view, double moved_px) {
  const int side = std::min(view.camera.width_px(), view.camera.height_px());
  return std::clamp(kFadePerMoved * moved_px, kMinFadePx, kRimShare * side);
}

bool Usable(const View& view, const BilinearTaps& taps, size_t tap) {
  return view.mask.empty() || view.mask(taps.columns[tap], taps.rows[tap]) != 0;
}

/// As ColourAt in linear light. False where all pixels around are masked.
bool ColourOf(const GuessedColours::Placed& placed, const Eigen::Vector2d& pixel,
              Eigen::Vector3d& rgb) {
  const ImageRgb8& image = placed.view->image;
  const BilinearTaps taps(image.width(), image.height(), pixel);
  rgb.setZero();
  for (size_t tap = 0; tap < 4; ++tap) {
    if (!Usable(*placed.view, taps, tap)) {
      const auto colour = ColourAt(*placed.view, pixel, true);
      if (colour) rgb = *colour;
      return colour.has_value();
    }
    const std::uint8_t* levels = &image(taps.columns[tap], taps.rows[tap]);
    for (size_t c = 0; c < 3; ++c) {
      rgb[static_cast<Eigen::Index>(c)] += taps.weights[tap] * placed.linear[c][levels[c]];
    }
  }
  return true;
}

/// What the view shows of a surface that the image shows at a pixel; none where it measured
/// another.
std::optional<Eigen::Vector3d> ColourOfSurface(const GuessedColours::Placed& placed, int x, int y,
                                               double inverse_depth) {
  const Eigen::Vector3d p = placed.pixel_from_novel_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1) +
                            inverse_depth * placed.pixel_per_inverse_depth;
  if (!(p.z() > 0)) return std::nullopt;
  const Eigen::Vector2d pixel = p.head<2>() / p.z();
  if (!placed.view->camera.Contains(pixel)) return std::nullopt;
  const float z = DepthAt(*placed.view, static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
  if (DepthImage::IsHole(z)) return std::nullopt;
  const double off = 1 / static_cast<double>(z) - inverse_depth / p.z();
  if (std::abs(off) > placed.delta_inverse_depth) return std::nullopt;
  Eigen::Vector3d rgb;
  if (!ColourOf(placed, pixel, rgb)) return std::nullopt;
  return rgb;
}

}  // namespace

GuessedColours::GuessedColours(const RenderScene& scene, const std::vector<int>& views_used,
                               const PinholeCamera& novel, const Pose& novel_from_world,
                               const RenderOptions& options)
    : novel_(novel), blend_(BlendParametersOf(options, novel.fx_px())) {
  const size_t count = std::min(views_used.size(), static_cast<size_t>(options.views));
  const std::vector<int> nearest(views_used.begin(),
                                 views_used.begin() + static_cast<std::ptrdiff_t>(count));
  const Eigen::Matrix3d ray_from_pixel = CalibrationOf(novel).inverse();
  for (const int index : CanonicalOrder(scene, nearest)) {
    const View& view = *scene.views[static_cast<size_t>(index)];
    RequireLoaded(view);
    const ViewPlacement placed = PlaceView(view, novel_from_world);
    const Eigen::Matrix3d pixel_from_novel =
        CalibrationOf(view.camera) * placed.rotation.transpose();
    views_.push_back(
        {&view, pixel_from_novel * ray_from_pixel, -(pixel_from_novel * placed.translation),
         placed.translation, ThresholdsOf(view, options).delta,
         FadeWidth(view, CornersMovedPx(view, novel, novel_from_world, scene.center))});
    for (int c = 0; c < 3; ++c) {
      views_.back().linear[static_cast<size_t>(c)] = LinearAfterGain(view, c);
    }
  }
}

void GuessedColours::MatchExposures(const Grid<float>& seen, const ImageRgb8& image, int threads) {
  const std::array<double, 256>& linear = LinearFromSrgb8();
  const double pixels = static_cast<double>(seen.width()) * seen.height();
  const int step = std::max(1, static_cast<int>(std::sqrt(pixels / kExposureSamples)));
  ParallelFor(0, static_cast<int>(views_.size()), threads, [&](int v) {
    Placed& placed = views_[static_cast<size_t>(v)];
    Eigen::Vector3d in_picture = Eigen::Vector3d::Zero(), in_view = Eigen::Vector3d::Zero();
    int count = 0;
    for (int y = step / 2; y < seen.height(); y += step) {
      for (int x = step / 2; x < seen.width(); x += step) {
        if (!(seen(x, y) > 0)) continue;
        const auto colour = ColourOfSurface(placed, x, y, 1 / static_cast<double>(seen(x, y)));
        const std::uint8_t* rgb = &image(x, y);
        const Eigen::Vector3d shown(linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]);
        if (!colour || std::max(colour->maxCoeff(), shown.maxCoeff()) > kNearWhite) continue;
        in_picture += shown;
        in_view += *colour;
        ++count;
      }
    }
    if (count < kMinExposed) return;
    for (int c = 0; c < 3; ++c) {
      if (!(in_view[c] > 0)) continue;
      const double exposure =
          std::clamp(in_picture[c] / in_view[c], 1 / kMaxExposure, kMaxExposure);
      if (std::abs(exposure - 1) > kExposureNoise) placed.exposure[c] = exposure;
    }
  });
}

GuessedColours::Row::Row(const GuessedColours& guesses, int y)
    : guesses_(guesses),
      row_{guesses.novel_.fx_px(), guesses.novel_.cx_px(),
           guesses.novel_.RayFromPixel({0.5, y + 0.5}).y()} {
  for (const Placed& placed : guesses.views_) {
    const View& view = *placed.view;
    GuessView asked{};
    const auto copy = [](const Eigen::Vector3d& from, double* to) {
      Eigen::Map<Eigen::Vector3d>{to} = from;
    };
    copy(placed.pixel_from_novel_pixel * Eigen::Vector3d(0.5, y + 0.5, 1), asked.pixel_at_0);
    copy(placed.pixel_from_novel_pixel.col(0), asked.pixel_per_x);
    copy(placed.pixel_per_inverse_depth, asked.pixel_per_inverse_depth);
    copy(placed.center_in_novel, asked.centre);
    copy(placed.exposure, asked.exposure);
    asked.delta = placed.delta_inverse_depth;
    asked.width_px = view.camera.width_px(), asked.height_px = view.camera.height_px();
    asked.depth = view.depth.grid().data().data();
    asked.depth_columns = view.depth.grid().width(), asked.depth_scale = view.depth_scale;
    asked.fade_width_px = placed.fade_width_px;
    views_.push_back(asked);
  }
  answers_.views.resize(views_.size());
}

/// Whether any view that answers shows more than masked pixels.
bool GuessedColours::Row::AnyUsable(size_t lane) const {
  for (size_t i = 0; i < views_.size(); ++i) {
    const GuessAnswers::OfView& of = answers_.views[i];
    if (of.answers[lane] == 0) continue;
    const View& view = *guesses_.views_[i].view;
    const Eigen::Vector2d pixel(of.pixel_x[lane], of.pixel_y[lane]);
    const BilinearTaps taps(view.image.width(), view.image.height(), pixel);
    for (size_t tap = 0; tap < 4; ++tap) {
      if (taps.weights[tap] > 0 && Usable(view, taps, tap)) return true;
    }
  }
  return false;
}

const std::vector<double>& GuessedColours::Row::DepthsOf(std::span<const Hole> holes) {
  depths_.resize(holes.size());
  for (size_t first = 0; first < holes.size(); first += kGuessesTogether) {
    const size_t count = std::min(kGuessesTogether, holes.size() - first);
    GuessLanes x, farthest, nearest, found;
    for (size_t lane = 0; lane < kGuessesTogether; ++lane) {
      const Hole& hole = holes[first + std::min(lane, count - 1)];
      x[lane] = hole.x, farthest[lane] = hole.farthest, nearest[lane] = hole.nearest;
    }
    FindGuesses(views_, x, farthest, nearest, sceptic_, found);
    AskViews(views_, x, found, answers_);
    for (size_t lane = 0; lane < count; ++lane) {
      depths_[first + lane] = AnyUsable(lane) ? found[lane] : 0;
    }
  }
  return depths_;
}

void GuessedColours::Row::AskColours(size_t count) {
  for (size_t i = 0; i < views_.size(); ++i) {
    GuessAnswers::OfView& of = answers_.views[i];
    for (size_t lane = 0; lane < kGuessesTogether; ++lane) {
      Eigen::Vector3d rgb = Eigen::Vector3d::Zero();
      if (lane >= count || of.answers[lane] == 0 ||
          !ColourOf(guesses_.views_[i], {of.pixel_x[lane], of.pixel_y[lane]}, rgb)) {
        of.answers[lane] = 0;
      }
      for (size_t c = 0; c < 3; ++c) of.rgb[c][lane] = rgb[static_cast<Eigen::Index>(c)];
    }
  }
}

/// SPEC 4.5, 4.6.
void GuessedColours::Row::Share() {
  const BlendParameters& blend = guesses_.blend_;
  if (blend.blend == BlendWeight::kInverseAngle) {
    ShareByInverseAngle(blend.pixel_angle_rad, blend.blend_k, answers_);
    return;
  }
  for (size_t lane = 0; lane < kGuessesTogether; ++lane) {
    angles_.clear();
    for (const auto& of : answers_.views) {
      if (of.answers[lane] != 0) angles_.push_back(of.angle_rad[lane]);
    }
    shares_.resize(angles_.size());
    BlendShares(blend, angles_, shares_);
    size_t next = 0;
    for (auto& of : answers_.views) {
      of.share[lane] = of.answers[lane] != 0 ? shares_[next++] : 0;
    }
  }
}

const std::vector<std::optional<Eigen::Vector3d>>& GuessedColours::Row::ColoursAt(
    std::span<const Point> points) {
  colours_.resize(points.size());
  for (size_t first = 0; first < points.size(); first += kGuessesTogether) {
    const size_t count = std::min(kGuessesTogether, points.size() - first);
    GuessLanes x, w, rgb[3], answered;
    for (size_t lane = 0; lane < kGuessesTogether; ++lane) {
      const Point& point = points[first + std::min(lane, count - 1)];
      x[lane] = point.x, w[lane] = point.inverse_depth;
    }
    AskViews(views_, x, w, answers_);
    AskColours(count);
    AnglesOfViews(views_, row_, x, w, answers_);
    Share();
    MixAnswers(views_, answers_, rgb, answered);
    for (size_t lane = 0; lane < count; ++lane) {
      colours_[first + lane].reset();
      if (answered[lane] != 0) {
        colours_[first + lane].emplace(rgb[0][lane], rgb[1][lane], rgb[2][lane]);
      }
    }
  }
  return colours_;
}

}  // namespace dtr
