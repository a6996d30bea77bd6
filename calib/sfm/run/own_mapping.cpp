#include "calib/sfm/run/own_mapping.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "calib/bundle/bundle.h"
#include "calib/bundle/degeneracy.h"
#include "calib/bundle/refine.h"
#include "calib/sfm/mapping/model_check.h"
#include "calib/sfm/run/colmap_steps.h"
#include "calib/sfm/run/own_steps.h"
#include "calib/sfm/run/parallax.h"
#include "calib/sfm/run/sfm_steps.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::sfm {
namespace {

using nlohmann::json;

constexpr std::uintmax_t kLargestNote = 1 << 24;
// A model with more photos may predict held-out observations by this factor worse: photos that the
// other left out are the hard ones.
constexpr double kClearlyWorse = 1.2;

// Observations by which two models are compared; fewer tell nothing.
constexpr int kMinHeldOut = 50;

// What the photos leave undetermined of a model, as a clause; empty: nothing.
struct Undetermined {
  std::string clause;
  bool by_path = false;  // of the camera alone, which is that of any model of the matches
};

// The adjustment that tells is expensive, and made only where the geometry of cameras and points,
// or pairs that one homography explains, give cause: of a wall, a map that is far from it may look
// sound.
Undetermined UndeterminedOf(Workspace& workspace, const calib::SfmModel& model,
                            const SfmOptions& options) {
  calib::Adjusted as_given;
  as_given.bundle = calib::BundleOf(model);
  as_given.used.assign(as_given.bundle.observations.size(), true);
  const auto found = calib::FindDegeneracies(as_given, {}, calib::kMaxFocalShare);
  const bool suspicious = std::any_of(found.begin(), found.end(), [](const auto& degeneracy) {
    return degeneracy.name != "duplicate_images" && degeneracy.name != "too_few_views";
  });
  if (!suspicious && LackOfParallax(CountPairs(SummaryOf(workspace))).empty()) return {};
  calib::RefineOptions refine;
  refine.seed = options.seed;
  refine.progress = &workspace.progress();
  if (options.intrinsics_are_known) refine.known_lenses = model.cameras;
  const auto has = [&](const char* name) {
    return std::any_of(found.begin(), found.end(),
                       [&](const auto& degeneracy) { return degeneracy.name == name; });
  };
  // Of points that are all seen under small angles, the path is not known either.
  const bool by_path = (has("collinear_centres") || has("forward_motion")) && !has("small_angles");
  return {calib::WhyUndetermined(model, refine), by_path};
}

// A model that tests do not pass, though the photos determine it.
struct Doubtful {
  calib::SfmModel model;
  std::string why;
  bool by_colmap = false;
};

// Drops COLMAP's models unless the matches agree with the largest, which is returned then.
std::optional<Doubtful> DropContradicted(Workspace& workspace,
                                         const std::vector<CameraGroup>& groups,
                                         std::vector<calib::SfmModel>& colmaps) {
  if (colmaps.empty()) return std::nullopt;
  ViewGraph graph = ReadGraph(workspace);
  // What EXIF says contradicts nothing; what pairs voted for does.
  const GroupLenses exif = LensesOf(workspace, groups);
  for (size_t i = 0; i < graph.cameras.size() && i < exif.lenses.size(); ++i) {
    const bool is_exifs =
        exif.focal_is_known[i] && graph.cameras[i].params[0] == exif.lenses[i].params[0];
    if (is_exifs) graph.focal_is_known[i] = 0;
  }
  std::string why = WhyContradicted(graph, colmaps.front());
  if (why.empty()) return std::nullopt;
  Doubtful dropped{std::move(colmaps.front()), std::move(why), true};
  colmaps.clear();
  return dropped;
}

// A model of the global mapper, and what the photos leave undetermined of it where it passes.
struct Own {
  GloballyMapped mapped;
  Undetermined undetermined;

  bool Passes() const { return mapped.why_not.empty() && !mapped.model.images.empty(); }
  // A model that validation rejects is no result, however well it fits the matches.
  bool IsResult() const { return Passes() && undetermined.clause.empty(); }
  // What the path of the camera leaves open no other mapper finds.
  bool IsAllThereIs() const { return IsResult() || (Passes() && undetermined.by_path); }
};

bool TakeColmaps(Workspace& workspace, const Own& own, const calib::SfmModel& colmaps,
                 const SfmOptions& options) {
  const GloballyMapped& ours = own.mapped;
  if (!own.Passes()) return true;
  if (!own.undetermined.clause.empty()) {
    return UndeterminedOf(workspace, colmaps, options).clause.empty();
  }
  if (colmaps.images.size() <= ours.model.images.size()) return false;
  int own_count = 0, colmap_count = 0;
  const double own_px = calib::HeldOutErrorPx(ours.model, options.seed, &own_count);
  const double colmap_px = calib::HeldOutErrorPx(colmaps, options.seed, &colmap_count);
  return std::min(own_count, colmap_count) >= kMinHeldOut && colmap_px <= kClearlyWorse * own_px;
}

std::string WhyAsked(const Workspace& workspace, const Own& own) {
  const GloballyMapped& ours = own.mapped;
  if (!ours.why_not.empty()) {
    const std::string lack = LackOfParallax(CountPairs(SummaryOf(workspace)));
    return lack.empty() ? ours.why_not : ours.why_not + "; " + lack;
  }
  if (!own.undetermined.clause.empty()) return own.undetermined.clause;
  return fmt::format("{} of {} photos have no camera",
                     workspace.images().size() - ours.model.images.size(),
                     workspace.images().size());
}

void WriteNote(const Workspace& workspace, const GloballyMapped& ours, bool colmaps,
               const std::string& asked_because, const std::string& doubt = "") {
  json why = json::object();
  if (!colmaps) {
    for (const auto& [name, reason] : ours.why_without_camera) why[name] = reason;
  }
  const json note = {{"mapper", colmaps ? "colmap" : "global"},
                     {"colmap_asked_because", asked_because},
                     {"doubt", doubt},
                     {"why_not_registered", why}};
  WriteFileAtomically(workspace.folder() / kOwnMappingNote,
                      note.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

[[noreturn]] void ThrowRejected(const std::string& why, const char* advice) {
  throw Error(
      fmt::format("structure from motion: expected photos that determine their cameras, "
                  "found that {}; {}",
                  why, advice));
}

// What helps where a model cannot be made sure of.
std::string NextStep(const std::string& why) {
  if (why.find("focal length") != std::string::npos) {
    return "give the lens (`lens`), or `camera_per` photo where it was zoomed";
  }
  return "look whether the cameras stand where the photos were taken; else add photos in between, "
         "that overlap by half, or give their cameras (`poses`)";
}

// Whether a model that does not pass is one to be looked at: most photos have a camera, and what
// they see determines it. Of a camera that only turned there is none.
bool IsModel(Workspace& workspace, const calib::SfmModel& model, const SfmOptions& options) {
  constexpr size_t kFewest = 3;
  const size_t photos = model.images.size();
  if (photos < kFewest || 2 * photos < workspace.images().size() || model.points.empty()) {
    return false;
  }
  if (CameraStoodStill(CountPairs(SummaryOf(workspace)))) return false;
  try {
    return UndeterminedOf(workspace, model, options).clause.empty();
  } catch (const Interrupted&) {
    throw;
  } catch (const Error&) {  // one that cannot even be adjusted
    return false;
  }
}

// The best of the models that do not pass; with its cameras come the words that it is one.
std::optional<Doubtful> InDoubt(Workspace& workspace, const Own& own,
                                std::optional<Doubtful> colmaps, const SfmOptions& options) {
  Doubtful ours{own.mapped.model, own.mapped.why_not, false};
  const bool colmaps_first =
      colmaps && colmaps->model.images.size() > own.mapped.model.images.size();
  for (const bool by_colmap : {colmaps_first, !colmaps_first}) {
    if (by_colmap && !colmaps) continue;
    const Doubtful& doubtful = by_colmap ? *colmaps : ours;
    if (IsModel(workspace, doubtful.model, options)) return doubtful;
  }
  return std::nullopt;
}

// Takes such a model and says so; throws where there is none.
std::vector<calib::SfmModel> TakeInDoubt(Workspace& workspace, const Own& own,
                                         std::optional<Doubtful> colmaps, const SfmOptions& options,
                                         const std::string& why, const char* advice) {
  std::string all = why;
  if (colmaps) all += ", and of COLMAP's model that " + colmaps->why;
  auto taken = InDoubt(workspace, own, std::move(colmaps), options);
  if (!taken) ThrowRejected(all, advice);
  const std::string doubt = fmt::format("{}; {}", taken->why, NextStep(taken->why));
  workspace.progress().Note(
      fmt::format("structure from motion is not sure of these cameras: {}", doubt));
  if (!taken->by_colmap) {
    RemoveTree(workspace.folder() / kFixedIntrinsicsNote);
    RemoveTree(workspace.folder() / kForwardMotionNote);
  }
  WriteNote(workspace, own.mapped, taken->by_colmap, why, doubt);
  return {std::move(taken->model)};
}

// COLMAP's models; where there is one of ours, a failure of COLMAP is no reason to lose it.
std::vector<calib::SfmModel> AskColmap(Workspace& workspace, const std::vector<CameraGroup>& groups,
                                       const SfmOptions& options,
                                       const std::function<bool()>& there_is_ours) {
  try {
    return options.colmap->Map(workspace, groups, options);
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& error) {
    if (!there_is_ours()) throw;
    workspace.progress().Note(fmt::format("COLMAP's mapper failed: {}", error.what()));
    return {};
  }
}

Own MapOwn(Workspace& workspace, const std::vector<CameraGroup>& groups, const SfmOptions& options,
           bool focals_hold) {
  std::optional<GroupLenses> known;
  if (options.intrinsics_are_known) known = LensesOf(workspace, groups);
  Own own{MapHere(workspace, options, known, focals_hold), {}};
  if (own.Passes()) own.undetermined = UndeterminedOf(workspace, own.mapped.model, options);
  return own;
}

// Whether EXIF knows every focal length and no vote of the matches changed one.
bool AllFocalsAreExifs(const Workspace& workspace, const std::vector<CameraGroup>& groups) {
  const GroupLenses exif = LensesOf(workspace, groups);
  const ViewGraph graph = ReadGraph(workspace);
  if (graph.cameras.size() != exif.lenses.size()) return false;
  for (size_t i = 0; i < exif.lenses.size(); ++i) {
    const bool is_exifs =
        exif.focal_is_known[i] && graph.cameras[i].params[0] == exif.lenses[i].params[0];
    if (!is_exifs) return false;
  }
  return true;
}

// Where matches alone do not lead to a model (of a wall any focal length fits two photos, of a
// straight walk any fits all), with EXIF's focal lengths they may: all photos must have a camera.
bool MapsWithExifHeld(Workspace& workspace, const std::vector<CameraGroup>& groups,
                      const SfmOptions& options, Own& own) {
  if (!AllFocalsAreExifs(workspace, groups)) return false;
  Own held = MapOwn(workspace, groups, options, true);
  const bool is_whole = held.mapped.model.images.size() == workspace.images().size();
  if (!held.IsAllThereIs() || !is_whole) return false;
  workspace.progress().Note(
      fmt::format("global mapper: {}; EXIF's focal length is held", WhyAsked(workspace, own)));
  if (!held.undetermined.clause.empty()) {
    WriteFileAtomically(workspace.folder() / kFixedIntrinsicsNote, "");
  }
  own = std::move(held);
  return true;
}

// Whether another mapper may give cameras to photos that this model leaves out: COLMAP needs 30
// points of the map in a photo, each of which is a match with a photo of it.
bool MayBeExtended(const Workspace& workspace, const calib::SfmModel& model) {
  constexpr size_t kFewestPoints = 30;
  if (model.images.size() == workspace.images().size()) return false;
  std::set<std::string> names;
  for (const calib::SfmImage& image : model.images) names.insert(image.name);
  const ViewGraph graph = ReadGraph(workspace);
  std::vector<char> placed;
  for (const GraphImage& image : graph.images) {
    placed.push_back(names.contains(image.name));
  }
  std::vector<size_t> matches(placed.size());
  for (const PairGeometry& pair : graph.pairs) {
    const auto a = static_cast<size_t>(pair.image_a), b = static_cast<size_t>(pair.image_b);
    if (placed[a]) matches[b] += pair.matches.size();
    if (placed[b]) matches[a] += pair.matches.size();
  }
  for (size_t i = 0; i < placed.size(); ++i) {
    if (!placed[i] && matches[i] >= kFewestPoints) return true;
  }
  return false;
}

bool HasStations(const Workspace& workspace) {
  const auto& images = workspace.images();
  return std::any_of(images.begin(), images.end(),
                     [](const SfmImageInput& image) { return !image.station.empty(); });
}

// Whether COLMAP's mapper is to be asked: it works, or a note says why not.
bool CanAsk(Workspace& workspace, const SfmOptions& options, const std::string& why) {
  if (options.engine != SfmEngine::kAuto) return false;
  const ColmapState state = options.colmap->Find();
  if (state.Works()) return true;
  workspace.progress().Note(fmt::format(
      "global mapper: {}; with COLMAP {} its mapper would be tried, too", why,
      state.why_not.empty() ? "installed" : "in working order (" + state.why_not + ")"));
  return false;
}

}  // namespace

std::vector<calib::SfmModel> MapOrFallBack(Workspace& workspace,
                                           const std::vector<CameraGroup>& groups,
                                           const SfmOptions& options) {
  Own own = MapOwn(workspace, groups, options, false);
  if (HasStations(workspace) && !own.mapped.model.images.empty()) {
    // Views of a plain ceiling alone may stand anywhere. What their stations make of them is tested
    // (PointsOfMatches), not this.
    own.mapped.why_not.clear();
    WriteNote(workspace, own.mapped, false, "");
    return {std::move(own.mapped.model)};
  }
  const bool held = !own.IsResult() && !options.intrinsics_are_known &&
                    MapsWithExifHeld(workspace, groups, options, own);
  const bool passes = own.Passes();
  const GloballyMapped& ours = own.mapped;
  if (held || (own.IsAllThereIs() && !MayBeExtended(workspace, ours.model))) {
    WriteNote(workspace, ours, false, "");
    return {ours.model};
  }
  const std::string why = WhyAsked(workspace, own);
  const bool ask = CanAsk(workspace, options, why);
  if (!ask && !passes) {
    return TakeInDoubt(workspace, own, std::nullopt, options, why,
                       options.engine == SfmEngine::kAuto
                           ? "photos must overlap by half, from several places; or install COLMAP "
                             "(apt-get install colmap), whose mapper is tried then"
                           : "photos must overlap by half, from several places; or use --sfm auto, "
                             "with which COLMAP's mapper is tried");
  }
  std::vector<calib::SfmModel> colmaps;
  if (ask) {
    workspace.progress().Note(
        fmt::format("global mapper: {}; trying COLMAP's mapper on the same matches", why));
    colmaps = AskColmap(workspace, groups, options,
                        [&] { return passes || IsModel(workspace, ours.model, options); });
  }
  const bool made_none = colmaps.empty();
  auto dropped = DropContradicted(workspace, groups, colmaps);
  if (colmaps.empty() && !passes) {
    if (made_none && !IsModel(workspace, ours.model, options)) return {};
    return TakeInDoubt(workspace, own, std::move(dropped), options, why,
                       "photos must overlap by half, from several places");
  }
  if (dropped) workspace.progress().Note("COLMAP's model does not pass: " + dropped->why);
  const bool take = !colmaps.empty() && TakeColmaps(workspace, own, colmaps.front(), options);
  if (ask) {
    workspace.progress().Note(take ? "COLMAP's model is taken"
                                   : "the global mapper's model is taken");
  }
  if (!take) {  // what COLMAP's attempts left says nothing of our model
    RemoveTree(workspace.folder() / kFixedIntrinsicsNote);
    RemoveTree(workspace.folder() / kForwardMotionNote);
  }
  WriteNote(workspace, ours, take, why);
  if (take) return colmaps;
  return {ours.model};
}

void ReadOwnMappingNote(const Workspace& workspace, SfmReport& report) {
  const std::filesystem::path file = workspace.folder() / kOwnMappingNote;
  try {
    const json note = json::parse(ReadFile(file, kLargestNote));
    if (note.at("mapper") == "colmap") report.version += ", COLMAP's mapper";
    report.doubt = note.value("doubt", "");
    for (const auto& [name, why] : note.at("why_not_registered").items()) {
      report.why_not_registered[name] = why.get<std::string>();
    }
  } catch (const json::exception&) {
    throw Error(file.string() +
                ": expected what structure from motion wrote, found another text; delete the "
                "workspace to start again");
  }
}

}  // namespace dtr::sfm
