#include "pipeline/core/reports/set_page.h"

#include <fmt/format.h>

#include <numeric>

#include "dtr/base/files.h"
#include "dtr/report/set_report.h"
#include "pipeline/core/run/side_by_side.h"

namespace dtr::pipeline {

void WriteSetPage(const io::SetWriter& writer, const DtrSet& set, const SetPageFacts& facts,
                  Progress& progress) {
  DtrSet sources = set;
  std::vector<View>& views = sources.frames.front().views;
  const size_t all = views.size();
  std::erase_if(views, [](const View& view) { return view.role == ViewRole::kHeldOut; });
  report::SetReportInfo info;
  info.title = "D+TR set " + facts.name;
  info.facts = {{"views", std::to_string(views.size())},
                {"held out", std::to_string(all - views.size())},
                {"depth engine", facts.engine},
                {"not registered", std::to_string(facts.not_registered)}};
  if (facts.prior) {
    for (const std::string& line : facts.prior->lines) info.facts.emplace_back("depth prior", line);
    for (const stereo::PriorBin& bin : facts.prior->agreement.by_distance) {
      info.facts.emplace_back(fmt::format("depth prior, {:.3g} to {:.3g}", bin.near_z, bin.far_z),
                              fmt::format("bias {:+.2f} %, noise {:.2f} % of the depth, {} points",
                                          100 * bin.bias, 100 * bin.noise, bin.points));
    }
  }
  info.checks = facts.checks;
  std::vector<int> all_views(views.size());
  std::iota(all_views.begin(), all_views.end(), 0);
  info.for_rows = [&](size_t, const std::function<void(size_t)>& row) {
    ForViews(views, all_views, "page", facts.memory_gb, progress, row);
  };
  info.load = [&](const View& view) { return Loaded(view, writer.folder(), {.sigma = true}); };
  for (const auto& [name, reason] : facts.skipped) info.skipped.push_back({name, reason});
  std::filesystem::create_directories(writer.folder() / "report");
  WriteFileAtomically(writer.folder() / "report" / "index.html", report::SetReport(sources, info));
}

}  // namespace dtr::pipeline
