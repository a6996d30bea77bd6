#include "pipeline/export_web.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/work_folder.h"
#include "dtr/io/set_io.h"
#include "dtr/io/validation_result.h"
#include "dtr/render/scene.h"
#include "dtr/render/time_steps.h"
#include "pipeline/detail/web/web_view.h"
#include "pipeline/evaluate.h"
#include "viewer/web/web_page.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kBytesPerMb = 1e6;

/// From as the page is by default to the smallest that still shows the scene.
constexpr WebCoding kCodings[] = {{85, 0.15, false}, {80, 0.15, true}, {70, 0.2, true},
                                  {60, 0.25, true},  {45, 0.35, true}, {30, 0.5, true},
                                  {15, 0.5, true}};

/// The source views, each once, in byte order of their ids.
std::vector<View> SourceViews(DtrSet& set) {
  io::CollapseDuplicates(set);
  std::vector<View> views;
  for (View& view : set.frames.front().views) {
    if (view.role == ViewRole::kSource) views.push_back(view);
  }
  std::stable_sort(views.begin(), views.end(),
                   [](const View& a, const View& b) { return a.id < b.id; });
  return views;
}

void RequireDepth(const fs::path& folder, const std::vector<View>& views) {
  if (views.empty()) throw Error(folder.string() + ": expected source views to show, found none");
  for (const View& view : views) {
    if (!view.depth_file) {
      throw Error(
          fmt::format("{}: {} has no depth; `dtr stereo` makes it", folder.string(), view.name));
    }
  }
}

bool AllAreJpeg(const std::vector<View>& views) {
  return std::all_of(views.begin(), views.end(), [](const View& v) { return IsStoredAsJpeg(v); });
}

Json JsonOf(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

std::string Name(const fs::path& set) {
  return WithoutTrailingSlash(fs::absolute(set)).stem().string();
}

using Figures = std::vector<std::pair<std::string, std::string>>;

/// Means over the held-out photos, as `dtr evaluate` has them.
void AddHeldOut(const WebPageRequest& request, const DtrSet& set, Figures& figures,
                Progress& progress) {
  const std::vector<View>& all = set.frames.front().views;
  const auto count = std::count_if(
      all.begin(), all.end(), [](const View& view) { return view.role == ViewRole::kHeldOut; });
  figures.emplace_back("held-out photos", std::to_string(count));
  if (count == 0 || !request.make_renderer) return;
  EvaluateRequest evaluate;
  evaluate.set = request.set;
  evaluate.render = request.render;
  evaluate.threads = request.threads;
  const eval::ViewScore mean = Evaluate(evaluate, request.make_renderer, progress).views.mean;
  if (mean.psnr_db) figures.emplace_back("their PSNR", fmt::format("{:.2f} dB", *mean.psnr_db));
  if (mean.psnr_covered_db) {
    figures.emplace_back("on seen pixels", fmt::format("{:.2f} dB", *mean.psnr_covered_db));
  }
  if (mean.ssim) figures.emplace_back("their SSIM", fmt::format("{:.3f}", *mean.ssim));
  figures.emplace_back("of them seen", fmt::format("{:.1f} %", 100 * mean.coverage));
}

/// Each test of the set's validation, where it has one: free text to a reader of sets.
void AddValidation(const DtrSet& set, Figures& figures) {
  figures.emplace_back("calibration", io::ValidationLine(set));
  const Json validation = Json::parse(set.validation_json, nullptr, false);
  if (!validation.is_object() || !validation.contains("tests")) return;
  for (const Json& test : validation["tests"]) {
    if (!test.is_object() || !test.value("name", Json()).is_string() ||
        !test.value("value", Json()).is_number() || !test.value("limit", Json()).is_number()) {
      continue;
    }
    std::string name = test["name"];
    std::replace(name.begin(), name.end(), '_', ' ');
    const bool failed = test.value("passed", Json()) == false;
    figures.emplace_back(name, fmt::format("{:.3g}, limit {:.3g}{}", test["value"].get<double>(),
                                           test["limit"].get<double>(), failed ? ": failed" : ""));
  }
}

Figures FiguresOf(const WebPageRequest& request, const DtrSet& set, const std::vector<View>& views,
                  Progress& progress) {
  const PinholeCamera& camera = views.front().camera;
  Figures figures = {
      {"photos", std::to_string(views.size())},
      {"first photo", fmt::format("{} x {} pixels", camera.width_px(), camera.height_px())},
      {"unit", NameOf(set.unit)}};
  AddHeldOut(request, set, figures, progress);
  AddValidation(set, figures);
  return figures;
}

std::string SetJson(const fs::path& folder, const DtrSet& set, const Figures& figures,
                    const std::vector<WebView>& packed) {
  Json json = {{"format", "dtr-web-page"},
               {"version", 2},
               {"name", Name(folder)},
               {"unit", NameOf(set.unit)},
               {"scene_center", JsonOf(set.scene_center)},
               {"bounds", nullptr},
               {"validation", io::ValidationLine(set)},
               {"validation_failed", !io::ValidationWarning(set).empty()},
               {"figures", figures}};
  if (!set.bounds.empty()) {
    json["bounds"] = {{"min", JsonOf(set.bounds.min)}, {"max", JsonOf(set.bounds.max)}};
  }
  std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.back() = ',';
  text += "\"views\":[";
  for (const WebView& view : packed) text += (&view == packed.data() ? "" : ",\n") + view.json;
  return text + "]}";
}

std::string PageOf(const WebPageRequest& request, const DtrSet& set, const std::vector<View>& views,
                   const Figures& figures, const WebCoding& coding, Progress& progress) {
  web::WebPage page{Name(request.set), DTR_VERSION, "", {}};
  std::vector<WebView> packed;
  progress.Stage("packing views", static_cast<int>(views.size()));
  for (const View& described : views) {
    progress.ThrowIfInterrupted();
    View view = described;
    io::LoadOptions load;
    load.completed = load.sigma = true;
    io::LoadPixels(request.set, view, load);
    RequireLoaded(view);
    packed.push_back(PackView(view, request.set, coding));
    progress.Update(static_cast<int>(packed.size()));
  }
  page.set_json = SetJson(request.set, set, figures, packed);
  for (WebView& view : packed) page.views.push_back(std::move(view.bytes));
  return web::MakeWebPage(page);
}

}  // namespace

WebPageReport ExportWebPage(const WebPageRequest& request, Progress& progress) {
  if (fs::exists(request.output)) {
    throw UsageError(
        fmt::format("{}: exists already; choose another name", request.output.string()));
  }
  DtrSet set = io::ReadSet(request.set);
  RequireOneFrame(set);
  const std::vector<View> views = SourceViews(set);
  RequireDepth(request.set, views);
  WorkFolder work(WorkFolder::Of(request.output), "export");
  WebPageReport report;
  report.views = views.size();
  report.warning = io::ValidationWarning(set);
  const Figures figures = FiguresOf(request, set, views, progress);
  std::string page;
  for (WebCoding coding : kCodings) {
    coding.depth_error_px = coding.recodes_jpeg
                                ? std::max(coding.depth_error_px, request.depth_error_px)
                                : request.depth_error_px;
    if (request.jpeg_quality && !coding.recodes_jpeg) {
      coding = {*request.jpeg_quality, coding.depth_error_px, true};
    }
    if (request.jpeg_quality)
      coding.jpeg_quality = std::min(coding.jpeg_quality, *request.jpeg_quality);
    page = PageOf(request, set, views, figures, coding, progress);
    report.bytes = page.size();
    report.jpeg_quality = coding.recodes_jpeg || !AllAreJpeg(views) ? coding.jpeg_quality : 0;
    report.depth_error_px = coding.depth_error_px;
    if (!request.max_mb || static_cast<double>(page.size()) <= *request.max_mb * kBytesPerMb) {
      const fs::path file = work.path() / request.output.filename();
      WriteFileAtomically(file, page);
      Rename(file, request.output);
      SyncFolder(fs::absolute(request.output).parent_path());
      return report;
    }
  }
  throw Error(fmt::format(
      "`max_mb` {}: the smallest page of this set takes {:.2f} MB; leave views out with `dtr "
      "prune` first",
      *request.max_mb, std::ceil(static_cast<double>(page.size()) / kBytesPerMb * 100) / 100));
}

}  // namespace dtr::pipeline
