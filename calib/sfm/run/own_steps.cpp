#include "calib/sfm/run/own_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <initializer_list>
#include <map>

#include "calib/models/fisheye.h"
#include "calib/sfm/features/sift.h"
#include "calib/sfm/mapping/global_mapper.h"
#include "calib/sfm/matching/match_photos.h"
#include "calib/sfm/matching/pair_journal.h"
#include "calib/sfm/run/parallax.h"
#include "calib/sfm/run/point_colours.h"
#include "calib/sfm/run/store.h"
#include "dtr/base/delete.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/image_io.h"

namespace dtr::sfm {
namespace fs = std::filesystem;
namespace {

// Where EXIF says nothing, of the long side: a moderate wide angle, as COLMAP assumes.
constexpr double kGuessedFocal = 1.2;
constexpr double kGuessedFisheyeFocal = 0.4;  // 143 degrees on the long side
// Of the memory, for descriptors; matches and what they are copied to take the rest.
constexpr double kDescriptorShare = 0.5;
constexpr char kPart[] = ".part_";  // of features that one of several processes found

// Brightness of a photo by the weights of ITU-R BT.709.
Grid<std::uint8_t> GreyOf(const ImageRgb8& image) {
  constexpr int kRed = 54, kGreen = 183, kBlue = 19, kHalf = 128;  // of 256
  Grid<std::uint8_t> grey(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y) {
    const std::uint8_t* from = image.row(y);
    std::uint8_t* to = grey.row(y);
    for (int x = 0; x < image.width(); ++x, from += 3) {
      to[x] = static_cast<std::uint8_t>(
          (kRed * from[0] + kGreen * from[1] + kBlue * from[2] + kHalf) >> 8);
    }
  }
  return grey;
}

// All photos in the order of groups.
std::vector<size_t> InOrder(const std::vector<CameraGroup>& groups) {
  std::vector<size_t> images;
  for (const CameraGroup& group : groups) {
    images.insert(images.end(), group.images.begin(), group.images.end());
  }
  return images;
}

std::vector<std::string> NamesOf(const Workspace& workspace) {
  std::vector<std::string> names;
  for (const SfmImageInput& image : workspace.images()) names.push_back(image.name);
  return names;
}

// The pairs to be matched, or chosen from; nothing: all.
std::optional<std::vector<std::pair<int, int>>> PairsFor(const std::vector<SfmImageInput>& images,
                                                         Matching matching,
                                                         const std::optional<ImagePairs>& allowed) {
  constexpr size_t kNeighbours = 10;  // of a sequence, and as many at distances of powers of two
  const size_t photos = images.size();
  const bool stations = std::any_of(images.begin(), images.end(), [](const SfmImageInput& image) {
    return !image.station.empty();
  });
  const auto may = [&](size_t a, size_t b) {
    if (!images[a].station.empty() && images[a].station == images[b].station) return false;
    return !allowed || std::binary_search(allowed->begin(), allowed->end(), std::pair(a, b));
  };
  if (matching != Matching::kSequential && !allowed && !stations) return std::nullopt;
  std::vector<std::pair<int, int>> pairs;
  for (size_t a = 0; a < photos; ++a) {
    for (size_t b = a + 1; b < photos; ++b) {
      const size_t apart = b - a;
      const bool power = (apart & (apart - 1)) == 0 && apart < (size_t{1} << kNeighbours);
      if (matching == Matching::kSequential && apart > kNeighbours && !power) continue;
      if (may(a, b)) pairs.emplace_back(static_cast<int>(a), static_cast<int>(b));
    }
  }
  return pairs;
}

MatchPart MatchPartOf(const SfmPart& part) {
  using Stage = MatchPart::Stage;
  switch (part.stage) {
    case SfmStage::kMatching:
      return {Stage::kMatching, part.part};
    case SfmStage::kVerification:
      return {Stage::kVerification, part.part};
    default:
      return {Stage::kPairs, {}};
  }
}

}  // namespace

GroupLenses LensesOf(const Workspace& workspace, const std::vector<CameraGroup>& groups) {
  GroupLenses known;
  for (const CameraGroup& group : groups) {
    const SfmImageInput& first = workspace.images()[group.images.front()];
    const double guess_px = (calib::IsFisheye(group.model) ? kGuessedFisheyeFocal : kGuessedFocal) *
                            std::max(first.width_px, first.height_px);
    known.lenses.push_back(
        {group.model, first.width_px, first.height_px,
         group.params.empty() ? FirstGuess(group.model, first, guess_px) : group.params});
    known.focal_is_known.push_back(!group.params.empty());
  }
  return known;
}

Features FeaturesOf(const fs::path& photo, const fs::path& mask_file, int max_image_size_px,
                    int max_features) {
  const Grid<std::uint8_t> grey =
      GreyOf(io::ReadImage(photo, {.memory_gb = 0}));  // it was written within it
  Mask mask;
  if (!mask_file.empty()) mask = io::ReadMask(mask_file);
  if (!mask.empty() && (mask.width() != grey.width() || mask.height() != grey.height())) {
    throw Error(fmt::format("{}: expected a mask of {} x {}, the size of its photo, found {} x {}",
                            mask_file.string(), grey.width(), grey.height(), mask.width(),
                            mask.height()));
  }
  SiftOptions options;
  options.max_features = max_features > 0 ? max_features : kMaxOwnFeatures;
  options.max_size_px = max_image_size_px;
  return DetectSift(grey.data(), grey.width(), grey.height(), mask.data(), options);
}

namespace {

// Beside a file of features: how much of it is whole (Workspace::Keep).
fs::path NoteOf(const fs::path& file) { return file.string() + ".begun"; }

// Files in the workspace whose names begin so.
std::vector<fs::path> FilesCalled(const Workspace& workspace,
                                  std::initializer_list<std::string> beginnings) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(workspace.folder())) {
    const std::string name = entry.path().filename().string();
    for (const std::string& beginning : beginnings) {
      if (name.starts_with(beginning)) files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Features of photos, from wherever.
using FindFeatures = std::function<Features(size_t image)>;

// Adds those of `images` to a file, of which `kept` is there already.
void AddInBatches(Workspace& workspace, const fs::path& file, const std::vector<size_t>& images,
                  size_t kept, const ExtractionPlan& plan, const FindFeatures& find) {
  workspace.progress().Stage("features", static_cast<int>(images.size()));
  workspace.progress().Update(static_cast<int>(kept));
  std::atomic<int> done = static_cast<int>(kept);
  for (size_t begin = kept; begin < images.size(); begin += kPhotosPerBatch) {
    const size_t count = std::min(kPhotosPerBatch, images.size() - begin);
    const std::span batch = std::span(images).subspan(begin, count);
    std::vector<Features> features(count);
    workspace.RunHere([&] {
      ParallelFor(0, static_cast<int>(count), plan.threads, [&](int i) {
        workspace.progress().ThrowIfInterrupted();
        features[static_cast<size_t>(i)] = find(batch[static_cast<size_t>(i)]);
        workspace.progress().Update(++done);
      });
      FeatureFile::Add(file, batch, features);
    });
    workspace.Keep(NoteOf(file), begin + count);
  }
}

// How many photos a file has that an earlier call with this fingerprint made; else an empty one,
// and 0.
size_t KeptOrNew(Workspace& workspace, const fs::path& file) {
  const fs::path note = NoteOf(file);
  const size_t kept = fs::exists(file) ? workspace.Kept(note).value_or(0) : 0;
  if (kept > 0 && FeatureFile::CutAfter(file, kept)) return kept;
  // A note must never meet features of other photos: it goes before a new file comes.
  RemoveTree(note);
  SyncFolder(note.parent_path());
  FeatureFile::Create(file);
  return 0;
}

// What versions that had features and matches in databases left.
void RemoveDatabases(Workspace& workspace) {
  const auto found = FilesCalled(workspace, {"features.db", "database.db"});
  if (found.empty()) return;
  for (const fs::path& file : found) RemoveTree(file);
  workspace.progress().Note(
      "features and matches of another version or of COLMAP are removed: structure from motion "
      "begins again");
}

// What of `files`, of parts, has a note of the step that runs; what they cost is taken over, too.
std::vector<FeatureFile> WholeOf(Workspace& workspace, const std::vector<fs::path>& files) {
  std::vector<FeatureFile> whole;
  for (const fs::path& file : files) {
    if (!fs::exists(NoteOf(file))) continue;
    if (const auto kept = workspace.Kept(NoteOf(file))) whole.emplace_back(file, *kept);
  }
  return whole;
}

}  // namespace

void OwnFeatures(Workspace& workspace, const std::vector<CameraGroup>& groups,
                 const ExtractionPlan& plan, const std::optional<SfmPart>& part) {
  const fs::path all = workspace.folder() / kFeatureFile;
  const std::vector<size_t> images = InOrder(groups);
  const FindFeatures detect = [&](size_t image) {
    return FeaturesOf(workspace.FileOf(image), workspace.images()[image].mask_file,
                      plan.max_image_size_px, plan.max_features);
  };
  if (part && part->stage == SfmStage::kFeatures) {
    const std::vector<size_t> own(
        images.begin() + static_cast<std::ptrdiff_t>(part->part.Begin(images.size())),
        images.begin() + static_cast<std::ptrdiff_t>(part->part.End(images.size())));
    const fs::path file =
        fmt::format("{}{}_of_{}", all.string() + kPart, part->part.index, part->part.count);
    AddInBatches(workspace, file, own, KeptOrNew(workspace, file), plan, detect);
    return;
  }
  if (part && part->stage != SfmStage::kPairs) {
    throw Error("features: expected those of all photos, found none; run the stage pairs first");
  }
  RemoveDatabases(workspace);
  const auto files = FilesCalled(workspace, {kFeatureFile + std::string(kPart)});
  const std::vector<FeatureFile> parts = WholeOf(workspace, files);
  AddInBatches(workspace, all, images, KeptOrNew(workspace, all), plan, [&](size_t image) {
    for (const FeatureFile& file : parts) {
      if (file.Has(image)) return file.Of(image);
    }
    return detect(image);
  });
  for (const fs::path& file : files) RemoveTree(file);
}

void OwnMatches(Workspace& workspace, const PhotosToMatch& to_match, Matching matching,
                const SfmOptions& options, const std::optional<SfmPart>& part) {
  const FeatureFile features(workspace.folder() / kFeatureFile);
  const std::vector<CameraGroup>& groups = to_match.groups;
  const GroupLenses known = LensesOf(workspace, groups);
  std::vector<MatchPhoto> photos;
  std::vector<int> group_of(workspace.images().size());
  for (size_t g = 0; g < groups.size(); ++g) {
    for (const size_t i : groups[g].images) group_of[i] = static_cast<int>(g);
  }
  for (size_t i = 0; i < workspace.images().size(); ++i) {
    const SfmImageInput& image = workspace.images()[i];
    photos.push_back({image.name, image.width_px, image.height_px, group_of[i], {}});
    photos.back().features.keypoints = features.KeypointsOf(i);
  }
  MatchOptions match;
  match.seed = options.seed;
  match.lens_is_known.assign(known.lenses.size(), to_match.known_lenses);
  match.pairs = PairsFor(workspace.images(), matching, to_match.allowed);
  match.preselect = matching == Matching::kPreselected;
  match.load_descriptors = [&](int photo, size_t first) {
    return features.DescriptorsOf(static_cast<size_t>(photo), first);
  };
  match.descriptor_gb = kDescriptorShare * options.memory_gb;
  match.journal = workspace.folder() / "matches.begun";
  match.journal_inputs = workspace.fingerprint();
  match.progress = &workspace.progress();
  if (part) {
    MatchPhotos(photos, known.lenses, known.focal_is_known, match, MatchPartOf(*part));
    return;
  }
  workspace.RunHere([&] {
    MatchResult result = MatchPhotos(photos, known.lenses, known.focal_is_known, match);
    for (const std::string& note : result.notes) workspace.progress().Note(note);
    WriteMatches(workspace.folder() / kMatchFile, result.graph);
  });
  matching::PairJournal::Remove(match.journal);
}

ViewGraph ReadGraph(const Workspace& workspace) {
  return ReadMatches(workspace.folder() / kMatchFile,
                     FeatureFile(workspace.folder() / kFeatureFile), NamesOf(workspace));
}

MatchSummary SummaryOf(const Workspace& workspace) {
  const ViewGraph graph = ReadGraph(workspace);
  MatchSummary summary;
  for (const GraphImage& image : graph.images) {
    summary.features.push_back(static_cast<std::int64_t>(image.pixels.size()));
  }
  for (const PairGeometry& pair : graph.pairs) {
    const auto a = static_cast<size_t>(pair.image_a), b = static_cast<size_t>(pair.image_b);
    std::vector<double> moved_px;
    for (const auto& [in_a, in_b] : pair.matches) {
      moved_px.push_back((graph.images[a].pixels[in_a] - graph.images[b].pixels[in_b]).norm());
    }
    summary.pairs.push_back({a, b, static_cast<std::int64_t>(pair.matches.size()),
                             pair.kind == PairKind::kPlanar || pair.kind == PairKind::kRotation,
                             AreStill(moved_px, workspace.images()[a])});
  }
  return summary;
}

namespace {

// Gives the graph's images, by their own names, the stations of the workspace's.
void SetStations(const Workspace& workspace, ViewGraph* graph) {
  std::map<std::string, int> numbers;
  std::map<std::string, const SfmImageInput*> input_of;
  for (const SfmImageInput& input : workspace.images()) input_of[input.name] = &input;
  for (GraphImage& image : graph->images) {
    const SfmImageInput& input = *input_of.at(image.name);
    if (input.station.empty()) continue;
    image.station = numbers.emplace(input.station, static_cast<int>(numbers.size())).first->second;
    image.cam_from_station = input.cam_from_station;
  }
}

}  // namespace

GloballyMapped MapHere(Workspace& workspace, const SfmOptions& options,
                       const std::optional<GroupLenses>& fixed, bool focals_hold) {
  ViewGraph graph = ReadGraph(workspace);
  if (fixed) graph.cameras = fixed->lenses;
  SetStations(workspace, &graph);
  GloballyMapped result;
  workspace.RunHere([&] {
    Mapped mapped = MapGlobally(graph, {.seed = options.seed,
                                        .intrinsics_are_known = fixed.has_value(),
                                        .focals_are_known = focals_hold,
                                        .progress = &workspace.progress()});
    result.model = std::move(mapped.model);
    ColourPoints(workspace, result.model);
    result.why_not = std::move(mapped.why_not);
    for (const LeftOut& left_out : mapped.left_out) {
      result.why_without_camera[graph.images[static_cast<size_t>(left_out.image)].name] =
          left_out.why;
    }
  });
  return result;
}

}  // namespace dtr::sfm
