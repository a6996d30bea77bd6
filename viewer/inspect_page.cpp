#include "viewer/inspect_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "dtr/base/order_statistics.h"
#include "dtr/cpu/contributions.h"
#include "dtr/cpu/renderer.h"
#include "dtr/eval/metrics.h"
#include "dtr/report/contact_sheet.h"
#include "dtr/report/false_color.h"
#include "dtr/report/html.h"
#include "dtr/report/set_report.h"
#include "dtr/types/area_average.h"
#include "viewer/controller.h"
#include "viewer/map_from_above.h"
#include "viewer/shown.h"

namespace dtr::viewer {
namespace {

constexpr int kThumbnailPx = 220, kMapCells = 420;
constexpr int kSmallPx = 240;  // long side of a view that is rendered without its photo
constexpr size_t kWorstViews = 5;
constexpr int kNamedShares = 4;  // contributors that are named
constexpr size_t kMaxThumbnails = 100;

/// What was found about one source view.
struct ViewFindings {
  const View* view = nullptr;
  double depth_share = 0;                ///< of its pixels that have depth
  std::optional<double> sigma_px;        ///< median of sigma in px of disparity
  std::optional<double> psnr_db;         ///< rendered without it, over what was seen
  double coverage = 0;                   ///< of its image, seen by the others
  std::map<std::string, double> shares;  ///< of the image, by the other views' names
  ImageRgb8 photo, rendered, weights;    ///< small
};

struct Findings {
  std::vector<ViewFindings> views;
  std::vector<report::Picture> photos, depths, sigmas;  ///< thumbnails
  ImageRgb8 coverage;
  Ground ground;
};

double DepthShare(const DepthImage& depth) {
  const auto& z = depth.grid().data();
  if (z.empty()) return 0;
  const auto kept =
      std::count_if(z.begin(), z.end(), [](float v) { return !DepthImage::IsHole(v); });
  return static_cast<double>(kept) / static_cast<double>(z.size());
}

std::optional<double> MedianSigmaPx(const View& view) {
  if (!view.inverse_depth_sigma) return std::nullopt;
  std::vector<float> sigmas;
  for (const float sigma : view.inverse_depth_sigma->data()) {
    if (sigma > 0 && std::isfinite(sigma)) sigmas.push_back(sigma);
  }
  if (sigmas.empty()) return std::nullopt;
  return UpperMedian(sigmas) * view.camera.fx_px() * DisparityBaseline(view);
}

/// The view as the others show it. `loaded` has its photo.
void RenderWithoutItself(const View& view, const View& loaded, ViewStream& stream,
                         RenderOptions options, const ViewColours& colours,
                         ViewFindings& findings) {
  const auto [width, height] =
      TargetSize(view.camera.width_px(), view.camera.height_px(), kSmallPx);
  const PinholeCamera small = view.camera.Resized(width, height);
  // Depth no finer than the image: the page is not to take an hour.
  options.resolution =
      std::max(options.resolution, view.camera.width_px() / view.depth_scale / width);
  stream.Hide({&view});
  const RenderScene scene =
      stream.SceneFor(view.cam_from_world, options, ViewStream::Wait::kForAll);
  const RenderResult result = cpu::Render(scene, small, view.cam_from_world, options);
  findings.photo = AreaAverage(loaded.image, width, height);
  Mask mask = result.coverage;
  if (!loaded.mask.empty()) mask = eval::Intersect(mask, ShrinkMask(loaded.mask, width, height));
  findings.psnr_db = eval::Psnr(result.image, findings.photo, mask);
  findings.coverage = result.coverage_share;
  const NovelCamera camera{small, view.cam_from_world};
  findings.weights =
      FalseColour(Shown::kWeights, {result, scene, camera, options, colours}, [](const View&) {
        return nullptr;
      }).image;
  const cpu::Contributions found =
      cpu::ContributionsTo(result.depth, scene, small, view.cam_from_world, options);
  for (size_t i = 0; i < found.views.size(); ++i) {
    double sum = 0;
    for (const float share : found.shares[i].data()) sum += share;
    findings.shares[scene.views[static_cast<size_t>(found.views[i])]->name] =
        sum / static_cast<double>(found.shares[i].data().size());
  }
  findings.rendered = result.image;
}

std::string RangeText(const std::optional<report::ColorScale>& scale) {
  if (!scale) return "none";
  return fmt::format("{:.3g} to {:.3g}", std::min(scale->dark, scale->bright),
                     std::max(scale->dark, scale->bright));
}

void AddThumbnails(const View& loaded, Findings& findings) {
  const auto add = [&](std::vector<report::Picture>& to, const ImageRgb8& image,
                       const std::string& further) {
    to.push_back({report::Shrink(image, kThumbnailPx), loaded.name + further});
  };
  add(findings.photos, loaded.image, "");
  if (!loaded.depth.empty()) {
    add(findings.depths, report::ColorizeDepth(loaded.depth),
        ": " + RangeText(report::ScaleOfDepth(loaded.depth)));
  }
  if (loaded.inverse_depth_sigma) {
    add(findings.sigmas, report::ColorizeSigma(*loaded.inverse_depth_sigma),
        ": " + RangeText(report::ScaleOfSigma(*loaded.inverse_depth_sigma)));
  }
}

Findings FindOut(const DtrSet& set, ViewStream& stream, const InspectFacts& facts,
                 const RenderOptions& options, Progress& progress) {
  Findings findings;
  findings.ground = GroundOf(set);
  CoverageFromAbove coverage(findings.ground, kMapCells);
  const std::vector<const View*> views = SurroundingsOf(set).views;
  const ViewColours colours(set);
  progress.Stage("inspecting", static_cast<int>(views.size()));
  for (const View* view : views) {
    progress.ThrowIfInterrupted();
    const View loaded = facts.load(*view);
    ViewFindings found;
    found.view = view;
    found.depth_share = DepthShare(loaded.depth);
    found.sigma_px = MedianSigmaPx(loaded);
    coverage.Add(loaded);
    if (findings.photos.size() < kMaxThumbnails) {
      AddThumbnails(loaded, findings);
    }
    if (views.size() > 1) {
      RenderWithoutItself(*view, loaded, stream, options, colours, found);
    }
    findings.views.push_back(std::move(found));
    progress.Update(static_cast<int>(findings.views.size()));
  }
  stream.Hide({});
  findings.coverage = coverage.Picture(static_cast<int>(views.size()));
  return findings;
}

std::string PercentText(double share) { return fmt::format("{:.1f} %", 100 * share); }

void AddResult(report::HtmlReport& page, const InspectFacts& facts) {
  page.Result(AllPassed(facts.checks), facts.checks.empty()
                                           ? "not validated: run dtr validate"
                                           : report::ValidationResult(facts.checks));
}

void AddTests(report::HtmlReport& page, const InspectFacts& facts) {
  if (facts.checks.empty()) return;
  page.Section("Validation of the calibration");
  report::AddChecks(page, facts.checks);
}

void AddGalleries(report::HtmlReport& page, const Findings& findings, LengthUnit unit) {
  page.Section("Photos, depth, uncertainty");
  if (findings.views.size() > kMaxThumbnails) {
    page.Paragraph(fmt::format("The first {} in the order of the views' ids.", kMaxThumbnails));
  }
  page.Gallery(findings.photos);
  const char* length = unit == LengthUnit::kMetre ? "metres" : "scene units";
  page.Paragraph(fmt::format(
      "Depth, {}: closer is brighter, green is a hole. The numbers are the ends of each palette, "
      "1 % and 99 % of the pixels.",
      length));
  page.Gallery(findings.depths);
  if (findings.sigmas.empty()) return;
  page.Paragraph(fmt::format(
      "Standard deviation of inverse depth, 1 over {}: dark is certain, green is not known.",
      length));
  page.Gallery(findings.sigmas);
}

void AddMaps(report::HtmlReport& page, const DtrSet& set, const Findings& findings,
             const InspectFacts& facts) {
  page.Section("From above");
  page.Svg("cameras: green holds, red is above its limit, blue was not tested",
           CameraMapSvg(set, findings.ground, [&](const View& view) -> std::string {
             const auto error = facts.error_px.find(view.name);
             if (error == facts.error_px.end()) return "#3b6fd4";
             return error->second <= facts.error_limit_px ? "#2c9c4b" : "#d43b2f";
           }));
  page.Image(
      "positions by the number of views that have depth there: brighter is more, green is none; "
      "the same window as the map of cameras",
      findings.coverage);
}

/// The colour of a view in the images of weights.
report::Picture Swatch(const Rgb& colour, const std::string& name) {
  constexpr int kSwatchPx = 14;
  ImageRgb8 square(kSwatchPx, kSwatchPx, 3);
  for (int y = 0; y < kSwatchPx; ++y) {
    for (int x = 0; x < kSwatchPx; ++x) {
      for (int c = 0; c < 3; ++c) square(x, y, c) = colour[static_cast<size_t>(c)];
    }
  }
  return {square, "colour of " + name};
}

std::string LargestShares(const std::map<std::string, double>& shares) {
  std::vector<std::pair<double, std::string>> sorted;
  for (const auto& [name, share] : shares) sorted.push_back({-share, name});
  std::sort(sorted.begin(), sorted.end());
  std::string text;
  for (int i = 0; i < std::min<int>(kNamedShares, static_cast<int>(sorted.size())); ++i) {
    const auto& [share, name] = sorted[static_cast<size_t>(i)];
    text += fmt::format("{}{} {}", i == 0 ? "" : ", ", name, PercentText(-share));
  }
  return text;
}

void AddContributions(report::HtmlReport& page, const DtrSet& set, const Findings& findings) {
  const ViewColours colours(set);
  std::map<std::string, double> total;
  std::vector<std::vector<report::Cell>> rows;
  for (const ViewFindings& found : findings.views) {
    for (const auto& [name, share] : found.shares) total[name] += share;
  }
  // A view's own image is drawn without it.
  const auto others = static_cast<double>(std::max<size_t>(2, findings.views.size()) - 1);
  for (const ViewFindings& found : findings.views) {
    rows.push_back({report::Picture{found.weights, "weights of " + found.view->name},
                    Swatch(colours.Of(*found.view), found.view->name), found.view->name,
                    LargestShares(found.shares), PercentText(found.coverage),
                    PercentText(total[found.view->name] / others)});
  }
  page.Section("Which view contributes where");
  page.Paragraph(
      "Every view is rendered without its own photo. The image mixes one colour per other view, "
      "that of the square beside its name, by their shares of each pixel; green is what none of "
      "them saw. The last column is what the view "
      "itself gives to the images of all the others: one near 0 % could be left out.");
  page.Table({"Shares", "Its colour", "In place of", "Largest shares of the image",
              "Seen by the others", "Gives to the others"},
             rows);
}

std::string Decibels(const std::optional<double>& psnr_db) {
  return psnr_db && std::isfinite(*psnr_db) ? fmt::format("{:.1f} dB", *psnr_db) : "-";
}

void AddWorstViews(report::HtmlReport& page, const Findings& findings, const InspectFacts& facts) {
  std::vector<const ViewFindings*> worst;
  for (const ViewFindings& found : findings.views) worst.push_back(&found);
  std::stable_sort(worst.begin(), worst.end(), [](const auto* a, const auto* b) {
    constexpr double kNothingSeen = -1;
    return a->psnr_db.value_or(kNothingSeen) < b->psnr_db.value_or(kNothingSeen);
  });
  const auto row = [&](const ViewFindings& found) -> std::vector<report::Cell> {
    const auto error = facts.error_px.find(found.view->name);
    return {
        found.view->name,
        Decibels(found.psnr_db),
        PercentText(found.coverage),
        PercentText(found.depth_share),
        found.sigma_px ? fmt::format("{:.3f} px", *found.sigma_px) : std::string("-"),
        error != facts.error_px.end() ? fmt::format("{:.2f} px", error->second) : std::string("-")};
  };
  const std::vector<std::string> header{"View",       "PSNR without it", "Seen by the others",
                                        "With depth", "Median sigma",    "Reprojection"};
  std::vector<std::vector<report::Cell>> pictures, rows;
  for (size_t i = 0; i < std::min(kWorstViews, worst.size()); ++i) {
    pictures.push_back({report::Picture{worst[i]->photo, "photo"},
                        report::Picture{worst[i]->rendered, "rendered without it"},
                        worst[i]->view->name, Decibels(worst[i]->psnr_db)});
  }
  for (const ViewFindings* found : worst) rows.push_back(row(*found));
  page.Section("Worst views");
  page.Paragraph(fmt::format(
      "Worst first, by how well the other views show what this one photographed, at {} px, over "
      "the pixels that they see. Sigma and reprojection are in pixels of this view.",
      kSmallPx));
  page.Table({"Photo", "Rendered without it", "View", "PSNR without it"}, pictures);
  page.Table(header, rows);
}

void AddCosts(report::HtmlReport& page, const InspectFacts& facts) {
  if (facts.stages.empty()) return;
  std::vector<std::vector<report::Cell>> rows;
  StageCost all{"all", 0, 0, 0};
  const auto row = [](const StageCost& cost) -> std::vector<report::Cell> {
    return {cost.name, fmt::format("{:.1f} s", cost.wall_s), fmt::format("{:.1f} s", cost.cpu_s),
            fmt::format("{:.0f} MB", cost.peak_bytes / 1e6)};
  };
  for (const StageCost& stage : facts.stages) {
    rows.push_back(row(stage));
    all.wall_s += stage.wall_s;
    all.cpu_s += stage.cpu_s;
    all.peak_bytes = std::max(all.peak_bytes, stage.peak_bytes);
  }
  rows.push_back(row(all));
  page.Section("What every stage cost");
  page.Table({"Stage", "Wall clock", "Processor", "Most memory"}, rows);
}

}  // namespace

std::string InspectPage(const DtrSet& set, ViewStream& stream, const InspectFacts& facts,
                        const RenderOptions& options, Progress& progress) {
  const Findings findings = FindOut(set, stream, facts, options, progress);
  report::HtmlReport page("Inspection of " + facts.name);
  AddResult(page, facts);
  page.Paragraph(fmt::format("{} source views; lengths in {}.", findings.views.size(),
                             set.unit == LengthUnit::kMetre ? "metres" : "scene units"));
  AddGalleries(page, findings, set.unit);
  AddMaps(page, set, findings, facts);
  AddWorstViews(page, findings, facts);
  AddContributions(page, set, findings);
  AddTests(page, facts);
  AddCosts(page, facts);
  if (facts.add_further) facts.add_further(page);
  return page.Finish();
}

}  // namespace dtr::viewer
