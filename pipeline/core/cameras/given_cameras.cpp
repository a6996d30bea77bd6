#include "pipeline/core/cameras/given_cameras.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "dtr/base/error.h"
#include "dtr/io/json_fields.h"

namespace dtr::pipeline {
namespace {

// Photos that are matched without belief in their cameras: all of few, else neighbours by name, who
// most likely overlap, from the beginning, the middle and the end.
constexpr size_t kMaxMatchedPhotos = 18, kRuns = 3;

constexpr char kNotFitting[] =
    "the given cameras do not fit what the photos show; matching photos without them";

std::vector<size_t> SomeOf(size_t photos) {
  std::vector<size_t> some;
  const size_t length = kMaxMatchedPhotos / kRuns;
  for (size_t i = 0; i < photos; ++i) {
    bool in_run = photos <= kMaxMatchedPhotos;
    for (size_t run = 0; run < kRuns; ++run) {
      const size_t begin = run * (photos - std::min(photos, length)) / (kRuns - 1);
      in_run = in_run || (i >= begin && i < begin + length);
    }
    if (in_run) some.push_back(i);
  }
  return some;
}

std::vector<sfm::PosedImage> ByName(std::vector<sfm::PosedImage> images) {
  std::sort(images.begin(), images.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  return images;
}

std::vector<calib::GivenCamera> CamerasOf(const std::vector<sfm::PosedImage>& images) {
  std::vector<calib::GivenCamera> cameras;
  for (const sfm::PosedImage& image : images) {
    cameras.push_back({image.name, image.camera, image.cam_from_world});
  }
  return cameras;
}

// What matching without cameras says of its own guesses is nobody's camera.
class WithoutNotes final : public Progress {
 public:
  explicit WithoutNotes(Progress& listener) : listener_(listener) {}
  void Stage(const std::string& name, int total) override { listener_.Stage(name, total); }
  void Update(int done) override { listener_.Update(done); }
  void Note(const std::string&) override {}
  bool StopRequested() const override { return listener_.StopRequested(); }
  std::string InterruptedLine() const override { return listener_.InterruptedLine(); }

 private:
  Progress& listener_;
};

calib::ConventionReport TestAlone(const GivenPhotos& given,
                                  const std::vector<sfm::PosedImage>& images,
                                  const std::vector<size_t>& some, Progress& progress) {
  std::vector<sfm::PosedImage> matched;
  for (const size_t i : some) matched.push_back(images[i]);
  WithoutNotes quiet(progress);
  std::vector<calib::MatchedPair> pairs = sfm::MatchWithoutCameras(
      given.workspace / "photos", matched, given.workspace / "conventions", given.sfm, quiet);
  for (calib::MatchedPair& pair : pairs) {
    pair.a = static_cast<int>(some[static_cast<size_t>(pair.a)]);
    pair.b = static_cast<int>(some[static_cast<size_t>(pair.b)]);
  }
  return calib::TestConventions(CamerasOf(images), pairs);
}

// Matches that the points of a model say there are: of each, neighbours in the order of images.
std::vector<calib::MatchedPair> ObservedPairs(const calib::SfmModel& model) {
  struct Seen {
    size_t image = 0;
    Eigen::Vector2d pixel;
  };
  std::map<std::uint64_t, Seen> last;  // by point
  std::map<std::pair<size_t, size_t>, calib::MatchedPair> pairs;
  for (size_t i = 0; i < model.images.size(); ++i) {
    for (const calib::SfmFeature& feature : model.images[i].features) {
      if (feature.point_id == calib::SfmFeature::kNoPoint) continue;
      const auto [seen, is_first] = last.try_emplace(feature.point_id, Seen{i, feature.pixel});
      if (is_first || seen->second.image == i) continue;
      calib::MatchedPair& pair = pairs[{seen->second.image, i}];
      pair.pixels.emplace_back(seen->second.pixel, feature.pixel);
      seen->second = {i, feature.pixel};
    }
  }
  std::vector<calib::MatchedPair> list;
  for (auto& [images, pair] : pairs) {
    pair.a = static_cast<int>(images.first);
    pair.b = static_cast<int>(images.second);
    list.push_back(std::move(pair));
  }
  return list;
}

// How many points every two images share.
std::map<std::pair<size_t, size_t>, int> SharedPoints(const calib::SfmModel& model,
                                                      const std::vector<bool>& may) {
  std::map<std::uint64_t, std::vector<size_t>> seen_by;
  for (size_t i = 0; i < model.images.size(); ++i) {
    for (const calib::SfmFeature& feature : model.images[i].features) {
      if (!may[i] || feature.point_id == calib::SfmFeature::kNoPoint) continue;
      std::vector<size_t>& images = seen_by[feature.point_id];
      if (images.empty() || images.back() != i) images.push_back(i);
    }
  }
  constexpr size_t kMaxTrack = 30;  // long tracks would cost their square
  std::map<std::pair<size_t, size_t>, int> shared;
  for (const auto& [id, images] : seen_by) {
    const size_t count = std::min(images.size(), kMaxTrack);
    for (size_t a = 0; a < count; ++a) {
      for (size_t b = a + 1; b < count; ++b) ++shared[{images[a], images[b]}];
    }
  }
  return shared;
}

bool AreDoubtful(const calib::ConventionReport& report) {
  return !report.tested() || report.given_px > report.limit_px;
}

// What a full disk left undone says nothing of photos or cameras: the run must end, so that the
// same command does it once there is room.
bool IsOfFullDisk(const Error& error) {
  const std::string what = error.what();
  return what.find("No space left") != std::string::npos ||
         what.find("disk is full") != std::string::npos;
}

}  // namespace

TriangulatedCameras TriangulateAndTest(const GivenPhotos& given, Progress& progress) {
  const std::vector<sfm::PosedImage> images = ByName(given.images);
  TriangulatedCameras out;
  try {
    sfm::SfmResult sfm = sfm::TriangulateWithPoses(given.workspace / "photos", images,
                                                   given.workspace / "sfm", given.sfm, progress);
    out.conventions = calib::TestConventions(CamerasOf(images), sfm.matches);
    out.model = std::move(sfm.model);
  } catch (const Interrupted&) {
    throw;
  } catch (const UsageError&) {
    throw;
  } catch (const Error& error) {
    progress.Note(kNotFitting);
    const calib::ConventionReport report =
        TestAlone(given, images, SomeOf(images.size()), progress);
    if (report.found.empty()) throw;
    throw CamerasContradicted(std::string(error.what()) + "; " + calib::LineOf(report, given.file));
  }
  // COLMAP's matches are its own affair; its triangulation is tested by the set's points.
  const bool by_colmap = given.sfm.engine == sfm::SfmEngine::kColmap;
  if (!by_colmap && AreDoubtful(out.conventions)) {
    progress.Note(kNotFitting);
    out.conventions = TestAlone(given, images, SomeOf(images.size()), progress);
  }
  if (const std::string line = calib::LineOf(out.conventions, given.file); !line.empty()) {
    progress.Note(line);
  }
  return out;
}

std::vector<size_t> ImagesToTest(const calib::SfmModel& model, const std::vector<bool>& may) {
  constexpr size_t kClusters = 2, kPerCluster = 4;
  const auto shared = SharedPoints(model, may);
  std::set<size_t> chosen;
  for (size_t k = 0; k < kClusters; ++k) {
    // Begins with the pair that shares most, then the image that shares most with the cluster.
    std::set<size_t> cluster;
    while (cluster.size() < kPerCluster) {
      std::map<size_t, int> gain;
      for (const auto& [pair, count] : shared) {
        const auto [a, b] = pair;
        if (chosen.contains(a) || chosen.contains(b)) continue;
        const bool has_a = cluster.contains(a), has_b = cluster.contains(b);
        if (cluster.empty() || (has_b && !has_a)) gain[a] = std::max(gain[a], count);
        if (has_a && !has_b) gain[b] = std::max(gain[b], count);
      }
      const auto best =
          std::max_element(gain.begin(), gain.end(),
                           [](const auto& p, const auto& q) { return p.second < q.second; });
      if (best == gain.end()) break;
      cluster.insert(best->first);
    }
    chosen.insert(cluster.begin(), cluster.end());
  }
  return {chosen.begin(), chosen.end()};
}

calib::ConventionReport TestWithPoints(const calib::SfmModel& model, const GivenPhotos& given,
                                       const std::vector<size_t>& some, Progress& progress) {
  calib::ConventionReport report =
      calib::TestConventions(CamerasOf(given.images), ObservedPairs(model));
  if ((!report.tested() || report.fits()) && some.size() >= 2) {
    try {
      const calib::ConventionReport by_photos = TestAlone(given, given.images, some, progress);
      if (by_photos.tested()) report = by_photos;
    } catch (const Interrupted&) {
      throw;
    } catch (const UsageError&) {
      throw;
    } catch (const Error& error) {
      if (IsOfFullDisk(error)) throw;
      // Photos without common features say nothing of their cameras.
      progress.Note(fmt::format("{}: its cameras are not tested with features of the photos: {}",
                                given.file, error.what()));
    }
  }
  if (const std::string line = calib::LineOf(report, given.file); !line.empty()) {
    progress.Note(line);
  }
  return report;
}

calib::RefineReport RefineGiven(calib::SfmModel& model, const RefineGivenOptions& given,
                                Progress& progress) {
  progress.Stage("bundle adjustment", 0);
  calib::RefineOptions options;
  options.seed = given.seed;
  options.progress = &progress;
  calib::Refined refined = given.are_independent ? calib::RefineIndependent(model, options)
                                                 : calib::Refine(model, options);
  progress.Note(refined.changed
                    ? fmt::format("given cameras are adjusted: held-out observations lie {:.3g} px "
                                  "from where they are predicted, {:.3g} px with the given ones",
                                  refined.adjusted_px, refined.given_px)
                    : "given cameras stay as they are: " + refined.reason);
  model = std::move(refined.model);
  return refined;
}

std::optional<Check> GivenCamerasCheck(const DtrSet& set) {
  constexpr char kName[] = "given_cameras_px", kProvenance[] = "provenance";
  const io::Json provenance = io::ParseJson(set.provenance_json, kProvenance);
  if (!provenance.is_object() || !provenance.contains("calibration")) return std::nullopt;
  const io::Json& calibration = provenance["calibration"];
  if (!calibration.is_object() || !calibration.contains("given_cameras")) return std::nullopt;
  const io::JsonObject object(calibration["given_cameras"], kProvenance,
                              "calibration.given_cameras");
  const io::Json& given = calibration["given_cameras"];
  if (!given.contains("residual_px") || given["residual_px"].is_null()) {
    return NotTested(kName, 0, "too few matched features to test the given cameras with");
  }
  Check check = AtMost(kName, object.Number("residual_px"), object.Number("limit_px"),
                       "distance of matched features from the epipolar lines of the given cameras, "
                       "median");
  for (size_t i = 0; i < object.Array("found").size(); ++i) {
    const io::JsonObject found = object.Item("found", i);
    check.passed = false;
    check.reason += fmt::format("; {:.2g} px with {}: {}", found.Number("residual_px"),
                                found.String("name"), found.String("advice"));
  }
  return check;
}

}  // namespace dtr::pipeline
