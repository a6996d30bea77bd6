#include "viewer/advice_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "dtr/report/html.h"
#include "viewer/map_from_above.h"

namespace dtr::viewer {
namespace {

std::string Percent(double share) { return fmt::format("{:.1f} %", 100 * share); }

// The set with the cameras to add among its own, so that one map shows both.
DtrSet WithAdditions(const DtrSet& set, const advise::Advice& advice) {
  DtrSet all = set;
  for (size_t i = 0; i < advice.add.size(); ++i) {
    const advise::Place& place = advice.places[advice.add[i].place];
    View view;
    view.id = view.name = fmt::format("add {}", i + 1);
    view.camera = place.camera;
    view.cam_from_world = place.cam_from_world;
    all.frames.front().views.push_back(std::move(view));
  }
  return all;
}

void AddMap(report::HtmlReport& page, const DtrSet& set, const advise::Advice& advice) {
  std::set<std::string> redundant;
  for (const auto& view : advice.redundant) redundant.insert(view.name);
  const DtrSet all = WithAdditions(set, advice);
  const size_t own = set.frames.front().views.size();
  const View* first = all.frames.front().views.data();
  page.Section("From above");
  page.Svg("blue: the set's cameras; grey: those that add nothing; red: those to add",
           CameraMapSvg(all, GroundOf(all), [&](const View& view) -> std::string {
             if (static_cast<size_t>(&view - first) >= own) return "#d43b2f";
             return redundant.contains(view.name) ? "#9a9a9a" : "#3b6fd4";
           }));
}

std::vector<report::Cell> RowOf(const advise::Place& place) {
  return {place.where,
          place.poor ? std::string("poor") : std::string("good"),
          Percent(place.seen_share),
          Percent(place.depthless_share),
          Percent(place.unseen_share),
          Percent(place.single_share),
          fmt::format("{:.1f}", place.gap_deg)};
}

}  // namespace

std::string AdvicePage(const std::string& name, const DtrSet& set, const advise::Advice& advice,
                       const advise::AdviseOptions& options) {
  const auto poor = std::count_if(advice.places.begin(), advice.places.end(),
                                  [](const auto& place) { return place.poor; });
  report::HtmlReport page("Advice on " + name);
  page.Result(poor == 0, fmt::format("{} of {} positions between and beyond the cameras are poor",
                                     poor, advice.places.size()));
  page.Paragraph(fmt::format(
      "A position is poor where more than {} of what it sees is in no photo, or where a twentieth "
      "of "
      "the points it sees have no photo within {:.0f} degrees, seen from the point. Pixels that "
      "photos show but that have no depth (sky, plain walls) are counted apart: another camera "
      "would not fix them.",
      Percent(options.max_unseen), options.max_gap_deg));
  page.Section("Cameras to add");
  if (advice.add.empty()) page.Paragraph("None would leave fewer or better poor positions.");
  std::vector<std::vector<report::Cell>> rows;
  for (size_t i = 0; i < advice.add.size(); ++i) {
    const auto& addition = advice.add[i];
    const auto& place = advice.places[addition.place];
    rows.push_back({std::to_string(i + 1), place.where, Percent(place.unseen_share),
                    fmt::format("{:.1f}", place.gap_deg),
                    fmt::format("{} -> {}", addition.poor_before, addition.poor_after)});
  }
  if (!rows.empty()) {
    page.Table({"order", "where", "in no photo", "nearest photo, degrees", "poor positions"}, rows);
  }
  page.Section("Cameras that add nothing");
  if (advice.redundant.empty()) page.Paragraph("Every camera shows something of its own.");
  rows.clear();
  for (const auto& view : advice.redundant)
    rows.push_back({view.name, Percent(view.covered_share)});
  if (!rows.empty()) {
    page.Paragraph("All of these may be left out together:");
    page.Table({"camera", "shown by those that stay"}, rows);
  }
  AddMap(page, set, advice);
  page.Section("All positions");
  std::vector<advise::Place> places = advice.places;
  std::stable_sort(places.begin(), places.end(),
                   [](const auto& a, const auto& b) { return a.poor > b.poor; });
  rows.clear();
  for (const auto& place : places) rows.push_back(RowOf(place));
  page.Table({"where", "result", "seen", "without depth", "in no photo", "in one photo only",
              "nearest photo, degrees"},
             rows);
  return page.Finish();
}

}  // namespace dtr::viewer
