#include "calib/colmap/own_mapping.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "calib/bundle/refine.h"
#include "calib/colmap/own_steps.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::colmap {
namespace {

using nlohmann::json;

constexpr std::uintmax_t kLargestNote = 1 << 24;
// A model with more photos may predict held-out observations by this factor worse: photos that the
// other left out are the hard ones.
constexpr double kClearlyWorse = 1.2;

// The model under the photos' own names.
calib::SfmModel WithOwnNames(const Workspace& workspace, calib::SfmModel model) {
  for (calib::SfmImage& image : model.images) image.name = workspace.NameOfAlias(image.name);
  return model;
}

bool TakeColmaps(const GloballyMapped& ours, const calib::SfmModel& own,
                 const calib::SfmModel& colmaps, const SfmOptions& options) {
  if (!ours.why_not.empty() || own.images.empty()) return true;
  if (colmaps.images.size() <= own.images.size()) return false;
  int count = 0;
  const double own_px = calib::HeldOutErrorPx(own, options.seed, &count);
  const double colmap_px = calib::HeldOutErrorPx(colmaps, options.seed, &count);
  return !(colmap_px > kClearlyWorse * own_px);
}

std::string WhyAsked(const Workspace& workspace, const GloballyMapped& ours) {
  if (!ours.why_not.empty()) return ours.why_not;
  return fmt::format("{} of {} photos have no camera",
                     workspace.images().size() - ours.model.images.size(),
                     workspace.images().size());
}

void WriteNote(const Workspace& workspace, const GloballyMapped& ours, bool colmaps,
               const std::string& asked_because) {
  json why = json::object();
  if (!colmaps) {
    for (const auto& [alias, reason] : ours.why_without_camera) {
      why[workspace.NameOfAlias(alias)] = reason;
    }
  }
  const json note = {{"mapper", colmaps ? "colmap" : "global"},
                     {"colmap_asked_because", asked_because},
                     {"why_not_registered", why}};
  WriteFileAtomically(workspace.folder() / kOwnMappingNote,
                      note.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

[[noreturn]] void ThrowRefused(const std::string& why, const char* advice) {
  throw Error(
      fmt::format("structure from motion: expected photos that determine their cameras, "
                  "found that {}; {}",
                  why, advice));
}

}  // namespace

std::vector<calib::SfmModel> MapOrFallBack(
    Workspace& workspace, const SfmOptions& options,
    const std::function<std::vector<calib::SfmModel>()>& by_colmap) {
  const GloballyMapped ours = MapHere(workspace, options);
  calib::SfmModel own = WithOwnNames(workspace, ours.model);
  const bool passes = ours.why_not.empty() && !own.images.empty();
  if (passes && own.images.size() == workspace.images().size()) {
    WriteNote(workspace, ours, false, "");
    return {std::move(own)};
  }
  const std::string why = WhyAsked(workspace, ours);
  const bool ask = options.engine == SfmEngine::kAuto && Program::IsInstalled();
  if (!ask && !passes) {
    ThrowRefused(why, options.engine == SfmEngine::kAuto
                          ? "photos must overlap by half, from several places; or install COLMAP "
                            "(apt-get install colmap), whose mapper is tried then"
                          : "photos must overlap by half, from several places; or use --sfm auto, "
                            "with which COLMAP's mapper is tried");
  }
  std::vector<calib::SfmModel> colmaps;
  if (ask) {
    workspace.progress().Note(
        fmt::format("global mapper: {}; trying COLMAP's mapper on the same matches", why));
    colmaps = by_colmap();
  }
  if (colmaps.empty() && !passes) return {};
  const bool take = !colmaps.empty() && TakeColmaps(ours, own, colmaps.front(), options);
  if (ask)
    workspace.progress().Note(take ? "COLMAP's model is taken"
                                   : "the global mapper's model is taken");
  WriteNote(workspace, ours, take, why);
  return take ? colmaps : std::vector<calib::SfmModel>{std::move(own)};
}

void ReadOwnMappingNote(const Workspace& workspace, SfmReport& report) {
  const std::filesystem::path file = workspace.folder() / kOwnMappingNote;
  try {
    const json note = json::parse(ReadFile(file, kLargestNote));
    if (note.at("mapper") == "colmap") report.version += ", COLMAP's mapper";
    for (const auto& [name, why] : note.at("why_not_registered").items()) {
      report.why_not_registered[name] = why.get<std::string>();
    }
  } catch (const json::exception&) {
    throw Error(file.string() +
                ": expected what structure from motion wrote, found another text; delete the "
                "workspace to start again");
  }
}

}  // namespace dtr::colmap
