#include "pipeline/export/export_web.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numeric>
#include <span>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/work_folder.h"
#include "dtr/io/set_io.h"
#include "dtr/io/validation_result.h"
#include "dtr/render/opening_view.h"
#include "dtr/render/scene.h"
#include "pipeline/core/run/output_folder.h"
#include "pipeline/evaluate/evaluate.h"
#include "pipeline/export/web/web_view.h"
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
/// So many of them before anything of the set is left out, for these losses in dB.
constexpr size_t kCodingsBeforePruning = 4;
constexpr double kPruningDb[] = {0.5, 2};

/// The source views of a time step, each once, in byte order of their ids.
std::vector<View> SourceViews(const Frame& frame) {
  std::vector<View> views;
  for (const View& view : frame.views) {
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
  const bool is_still = set.frames.size() == 1;
  Figures figures = {
      {"photos", std::to_string(views.size())},
      {"first photo", fmt::format("{} x {} pixels", camera.width_px(), camera.height_px())},
      {"unit", NameOf(set.unit)}};
  if (is_still) {
    AddHeldOut(request, set, figures, progress);
  } else {
    figures.emplace_back("time steps", std::to_string(set.frames.size()));
  }
  AddValidation(set, figures);
  return figures;
}

/// What a page is made of.
struct Source {
  fs::path folder;
  DtrSet set;
  std::vector<View> views;  ///< of all time steps, one after the other
  std::vector<size_t> views_of_step;
  Figures figures;
};

std::vector<const View*> ViewsOfFirstStep(const Source& source) {
  std::vector<const View*> views;
  for (size_t i = 0; i < source.views_of_step.front(); ++i) views.push_back(&source.views[i]);
  return views;
}

Json TimeStepsJson(const Source& source) {
  Json steps = Json::array();
  for (size_t i = 0; i < source.views_of_step.size(); ++i) {
    steps.push_back({{"time_s", source.set.frames[i].time_s}, {"views", source.views_of_step[i]}});
  }
  return steps;
}

std::string SetJson(const std::string& name, const Source& source,
                    const std::vector<WebView>& packed) {
  const DtrSet& set = source.set;
  const std::vector<const View*> views = ViewsOfFirstStep(source);
  Json json = {{"format", "dtr-web-page"},
               {"version", 2},
               {"name", name},
               {"unit", NameOf(set.unit)},
               {"scene_center", JsonOf(set.scene_center)},
               {"opening_view", OpeningView(views, set.scene_center)},
               {"camera_span_rad", CameraSpan(views, set.scene_center)},
               {"bounds", nullptr},
               {"validation", io::ValidationLine(set)},
               {"validation_failed", !io::ValidationWarning(set).empty()},
               {"figures", source.figures},
               {"time_steps", TimeStepsJson(source)}};
  if (!set.bounds.empty()) {
    json["bounds"] = {{"min", JsonOf(set.bounds.min)}, {"max", JsonOf(set.bounds.max)}};
  }
  std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.back() = ',';
  text += "\"views\":[";
  for (const WebView& view : packed) text += (&view == packed.data() ? "" : ",\n") + view.json;
  return text + "]}";
}

Source SourceOf(const WebPageRequest& request, Progress& progress) {
  Source source{request.set, io::ReadSet(request.set), {}, {}, {}};
  io::CollapseDuplicates(source.set);
  for (const Frame& frame : source.set.frames) {
    const std::vector<View> views = SourceViews(frame);
    RequireDepth(request.set, views);
    source.views.insert(source.views.end(), views.begin(), views.end());
    source.views_of_step.push_back(views.size());
  }
  source.figures = FiguresOf(request, source.set, source.views, progress);
  return source;
}

/// What is written: the page, or what a site consists of.
using Files = std::vector<web::SiteFile>;

std::uint64_t BytesOf(const Files& files) {
  return std::accumulate(
      files.begin(), files.end(), std::uint64_t{0},
      [](std::uint64_t sum, const web::SiteFile& file) { return sum + file.bytes.size(); });
}

Files FilesOf(const WebPageRequest& request, const Source& source, const WebCoding& coding,
              Progress& progress) {
  const std::string name = Name(request.set);
  web::WebPage page{name, DTR_VERSION, "", {}};
  std::vector<WebView> packed;
  progress.Stage("packing views", static_cast<int>(source.views.size()));
  for (const View& described : source.views) {
    progress.ThrowIfInterrupted();
    View view = described;
    io::LoadOptions load;
    load.completed = load.sigma = true;
    io::LoadPixels(source.folder, view, load);
    RequireLoaded(view);
    packed.push_back(PackView(view, source.folder, coding));
    progress.Update(static_cast<int>(packed.size()));
  }
  page.set_json = SetJson(name, source, packed);
  for (WebView& view : packed) page.views.push_back(std::move(view.bytes));
  if (request.as_site) return web::MakeWebSite(page);
  return {{request.output.filename().string(), web::MakeWebPage(page)}};
}

WebCoding CodingOf(const WebPageRequest& request, WebCoding coding) {
  if (request.jpeg_quality) {
    coding.jpeg_quality = coding.recodes_jpeg ? std::min(coding.jpeg_quality, *request.jpeg_quality)
                                              : *request.jpeg_quality;
  }
  coding.depth_error_px = coding.recodes_jpeg
                              ? std::max(coding.depth_error_px, request.depth_error_px)
                              : request.depth_error_px;
  coding.recodes_jpeg = coding.recodes_jpeg || request.jpeg_quality.has_value();
  return coding;
}

bool Fits(const WebPageRequest& request, const Files& files) {
  return !request.max_mb || static_cast<double>(BytesOf(files)) <= *request.max_mb * kBytesPerMb;
}

/// The first page that fits, or the last of these codings.
Files FilesWithin(const WebPageRequest& request, const Source& source,
                  std::span<const WebCoding> codings, WebPageReport& report, Progress& progress) {
  Files files;
  for (const WebCoding& listed : codings) {
    const WebCoding coding = CodingOf(request, listed);
    files = FilesOf(request, source, coding, progress);
    report.views = source.views.size();
    report.bytes = BytesOf(files);
    report.jpeg_quality =
        coding.recodes_jpeg || !AllAreJpeg(source.views) ? coding.jpeg_quality : 0;
    report.depth_error_px = coding.depth_error_px;
    if (Fits(request, files)) break;
  }
  return files;
}

/// The set without what may go for this loss.
Source Pruned(const WebPageRequest& request, double loss_db, const fs::path& output,
              Progress& progress) {
  request.prune(loss_db, output);
  WebPageRequest of_pruned = request;
  of_pruned.set = output;
  return SourceOf(of_pruned, progress);
}

Files SmallEnough(const WebPageRequest& request, const Source& source, const fs::path& work,
                  WebPageReport& report, Progress& progress) {
  const std::span<const WebCoding> codings(kCodings);
  const bool can_prune = request.make_renderer && request.prune && source.set.frames.size() == 1;
  if (!request.max_mb || !can_prune) {
    return FilesWithin(request, source, codings, report, progress);
  }
  Files files =
      FilesWithin(request, source, codings.first(kCodingsBeforePruning), report, progress);
  for (const double loss_db : kPruningDb) {
    if (Fits(request, files)) return files;
    report.pruned_db = loss_db;
    const bool last = loss_db == std::end(kPruningDb)[-1];
    files = FilesWithin(request,
                        Pruned(request, loss_db, work / fmt::format("{}.dtr", loss_db), progress),
                        last ? codings : codings.first(kCodingsBeforePruning), report, progress);
  }
  return files;
}

/// Under their names, once all of them are whole.
void Write(const WebPageRequest& request, const Files& files, const fs::path& work) {
  fs::path made = work / "site";
  if (request.as_site) {
    fs::create_directory(made);
    for (const auto& [name, bytes] : files) WriteFileAtomically(made / name, bytes);
    SyncFolder(made);
  } else {
    made = work / files.front().name;
    WriteFileAtomically(made, files.front().bytes);
  }
  if (!request.as_site) return PublishFile(made, request.output);
  const fs::path place = ResolveLinks(request.output);
  Rename(made, place);
  SyncFolder(fs::absolute(place).parent_path());
}

}  // namespace

WebPageReport ExportWebPage(const WebPageRequest& request, Progress& progress) {
  RequireNew(request.output, "export", request.force);
  const Source source = SourceOf(request, progress);
  const WorkFolder work(WorkFolder::Of(request.output), "export");
  WebPageReport report;
  report.warning = io::ValidationWarning(source.set);
  const Files files = SmallEnough(request, source, work.path(), report, progress);
  if (!Fits(request, files)) {
    throw Error(fmt::format(
        "`max_mb` {}: the smallest page of this set takes {:.3f} MB; leave views out with `dtr "
        "prune` first",
        *request.max_mb,
        std::ceil(static_cast<double>(BytesOf(files)) / kBytesPerMb * 1000) / 1000));
  }
  Write(request, files, work.path());
  return report;
}

}  // namespace dtr::pipeline
