#include "calib/sfm/matching/vote_cameras.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "calib/models/fisheye.h"
#include "calib/sfm/matching/lens_vote.h"
#include "calib/sfm/matching/pair_kind.h"
#include "calib/sfm/matching/robust_fit.h"
#include "calib/sfm/matching/zoom_vote.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"

namespace dtr::sfm::matching {
namespace {

constexpr size_t kVoters = 40;         // pairs
constexpr size_t kCandidates = 80;     // pairs whose fundamental matrix is looked at
constexpr size_t kVotingMatches = 80;  // of a pair
constexpr size_t kFewestInliers = 30;  // of a pair that votes: more than chance gives
constexpr size_t kVotersOfPhoto = 4;   // at least, where every photo has a focal length of its own
constexpr size_t kMinZoomed = 3;       // photos; of two, either may be the zoomed one
constexpr double kSureDeviation = 0.1, kContradiction = 1.15, kClearlyLower = 0.9;
constexpr double kContradictionSigmas = 3;
// What the matches of a set have wrong in common (a lens that k1 alone does not describe, features
// that drift): of sets whose focal length is known, photos that face one way are off by up to 10 %.
constexpr double kSystematicDeviation = 0.033;

// Where the first radial term stands among a model's parameters; -1: it has none. Empty: a lens
// that this vote has no model for.
std::optional<int> RadialIndex(calib::CameraModel model) {
  switch (model) {
    case calib::CameraModel::kSimplePinhole:
    case calib::CameraModel::kPinhole:
      return -1;
    case calib::CameraModel::kSimpleRadial:
    case calib::CameraModel::kRadial:
    case calib::CameraModel::kSimpleRadialFisheye:
    case calib::CameraModel::kRadialFisheye:
      return 3;
    case calib::CameraModel::kOpenCvFisheye:
    case calib::CameraModel::kOpenCv:
    case calib::CameraModel::kFullOpenCv:
      return 4;
    default:
      return std::nullopt;
  }
}

double LongSide(const calib::LensCamera& camera) {
  return std::max(camera.width_px, camera.height_px);
}

// Offset from the principal point in long sides, as if pixels were square.
Eigen::Vector2d Centred(const calib::LensCamera& camera, const Keypoint& keypoint) {
  const auto focals = static_cast<size_t>(calib::FocalCount(camera.model));
  const double aspect = focals == 2 ? camera.params[0] / camera.params[1] : 1;
  return Eigen::Vector2d(keypoint.x_px - camera.params[focals],
                         (keypoint.y_px - camera.params[focals + 1]) * aspect) /
         LongSide(camera);
}

struct Candidate {
  VotePair pair;
  double weight = 0;    // matches, less those of pairs without parallax
  bool planar = false;  // one homography explains it: any focal length does
};

// The matches of a pair, and those of them that a fundamental matrix explains.
struct Explained {
  PointPairs points;         // as VotePair has them
  PointPairs on_plane;       // where `fundamental` is of them
  std::vector<int> inliers;  // indices into both
  Eigen::Matrix3d fundamental = Eigen::Matrix3d::Zero();
  double band = 0;  // on the plane
};

Explained ExplainedBy(PointPairs points, PointPairs on_plane, double band, std::uint64_t seed) {
  Explained explained{std::move(points), std::move(on_plane), {}, {}, band};
  if (const auto fit = FitFundamental(explained.on_plane, band, seed)) {
    explained.inliers = fit->inliers;
    explained.fundamental = fit->m;
  }
  return explained;
}

// No fundamental matrix is of a fisheye's photos. It is of what they become with the right focal
// length, and nearly so with one near it.
Explained ExplainedOfFisheye(const PointPairs& points, double band, std::uint64_t seed) {
  constexpr double kFocals[] = {0.25, 0.33, 0.45, 0.65};  // long sides
  Explained best;
  for (const double focal : kFocals) {
    PointPairs kept, on_plane;
    for (size_t i = 0; i < points.size(); ++i) {
      const auto p = Unbent({focal, 0, true}, points.a[i], nullptr);
      const auto q = Unbent({focal, 0, true}, points.b[i], nullptr);
      if (!p || !q) continue;
      kept.Add(points.a[i], points.b[i]);
      on_plane.Add(*p, *q);
    }
    Explained explained = ExplainedBy(std::move(kept), std::move(on_plane), band / focal, seed);
    if (explained.inliers.size() > best.inliers.size()) best = std::move(explained);
  }
  return best;
}

Candidate CandidateOf(const CoarsePair& coarse, std::span<const MatchPhoto> photos,
                      std::span<const calib::LensCamera> cameras, std::uint64_t seed) {
  PointPairs points;
  const MatchPhoto& photo_a = photos[static_cast<size_t>(coarse.a)];
  const MatchPhoto& photo_b = photos[static_cast<size_t>(coarse.b)];
  const calib::LensCamera& camera_a = cameras[static_cast<size_t>(photo_a.camera)];
  const calib::LensCamera& camera_b = cameras[static_cast<size_t>(photo_b.camera)];
  for (const CoarseMatch& m : coarse.matches) {
    const auto of_a = static_cast<size_t>(m.a), of_b = static_cast<size_t>(m.b);
    const Eigen::Vector2d p = Centred(camera_a, photo_a.features.keypoints[of_a]);
    const Eigen::Vector2d q = Centred(camera_b, photo_b.features.keypoints[of_b]);
    if (p.allFinite() && q.allFinite()) points.Add(p, q);
  }
  Candidate candidate;
  const double band = BandOf(std::min(LongSide(camera_a), LongSide(camera_b)));
  const Explained explained = calib::IsFisheye(camera_a.model)
                                  ? ExplainedOfFisheye(points, band, seed)
                                  : ExplainedBy(points, points, band, seed);
  if (explained.inliers.size() < kFewestInliers) return candidate;
  PointPairs inliers, on_plane;
  for (const int i : explained.inliers) {
    const auto at = static_cast<size_t>(i);
    inliers.Add(explained.points.a[at], explained.points.b[at]);
    on_plane.Add(explained.on_plane.a[at], explained.on_plane.b[at]);
  }
  const double parallax = MedianHomographyDistance(on_plane) / (2 * explained.band);
  candidate.weight =
      static_cast<double>(std::min<size_t>(inliers.size(), 200)) * std::clamp(parallax, 0.0, 1.0);
  const auto homography = FitHomography(on_plane, explained.band, HashOf(seed, 1));
  candidate.planar = homography && static_cast<double>(homography->inliers.size()) >=
                                       kPlanarShare * static_cast<double>(inliers.size());
  candidate.pair.fundamental = explained.fundamental;
  candidate.pair.photo_a = coarse.a;
  candidate.pair.photo_b = coarse.b;
  const size_t count = std::min(inliers.size(), kVotingMatches);
  for (size_t k = 0; k < count; ++k) {
    const size_t i = k * inliers.size() / count;
    candidate.pair.points.Add(inliers.a[i], inliers.b[i]);
  }
  return candidate;
}

struct Voters {
  std::vector<VotePair> pairs;
  bool on_focal = false;  // else they can vote on distortion alone
};

// The candidates of these pairs, those with the largest weight first; none without.
std::vector<Candidate> CandidatesOf(const std::vector<const CoarsePair*>& pairs,
                                    std::span<const MatchPhoto> photos,
                                    std::span<const calib::LensCamera> cameras,
                                    const MatchOptions& options) {
  std::vector<Candidate> candidates(pairs.size());
  ParallelFor(0, static_cast<int>(pairs.size()), [&](int i) {
    if (options.progress != nullptr) options.progress->ThrowIfInterrupted();
    const CoarsePair& pair = *pairs[static_cast<size_t>(i)];
    candidates[static_cast<size_t>(i)] =
        CandidateOf(pair, photos, cameras, HashOf(options.seed, 1, pair.a, pair.b));
  });
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& p, const Candidate& q) { return p.weight > q.weight; });
  std::erase_if(candidates, [](const Candidate& c) { return !(c.weight > 0); });
  return candidates;
}

// The first `most` items, and of those behind them the first `of_photo` of every photo.
template <typename Item, typename PairOf>
std::vector<Item> FirstOfAllAndOfEach(std::vector<Item> items, size_t most, size_t of_photo,
                                      const PairOf& pair_of) {
  std::map<int, size_t> taken;
  std::vector<Item> some;
  for (Item& item : items) {
    const auto [a, b] = pair_of(item);
    if (some.size() >= most && taken[a] >= of_photo && taken[b] >= of_photo) continue;
    ++taken[a];
    ++taken[b];
    some.push_back(std::move(item));
  }
  return some;
}

// The pairs that vote on a camera: the best of those with the most matches; where one homography
// explains every pair, these. `of_photo`: at least so many of every photo, too, where it has them.
Voters VotersOf(std::vector<const CoarsePair*> pairs, std::span<const MatchPhoto> photos,
                std::span<const calib::LensCamera> cameras, const MatchOptions& options,
                size_t of_photo = 0) {
  std::stable_sort(pairs.begin(), pairs.end(), [](const CoarsePair* p, const CoarsePair* q) {
    return p->matches.size() > q->matches.size();
  });
  pairs = FirstOfAllAndOfEach(std::move(pairs), kCandidates, 2 * of_photo,
                              [](const CoarsePair* p) { return std::pair(p->a, p->b); });
  std::vector<Candidate> candidates = CandidatesOf(pairs, photos, cameras, options);
  Voters voters;
  voters.on_focal = std::any_of(candidates.begin(), candidates.end(),
                                [](const Candidate& c) { return !c.planar; });
  std::erase_if(candidates, [&](const Candidate& c) { return c.planar && voters.on_focal; });
  candidates = FirstOfAllAndOfEach(
      std::move(candidates), kVoters, of_photo,
      [](const Candidate& c) { return std::pair(c.pair.photo_a, c.pair.photo_b); });
  for (Candidate& c : candidates) voters.pairs.push_back(std::move(c.pair));
  return voters;
}

// Cameras that vote together, by the first of them.
std::map<int, std::vector<int>> Groups(std::span<const MatchPhoto> photos, const ViewGraph& graph) {
  const int count = static_cast<int>(graph.cameras.size());
  std::vector<int> photos_of(graph.cameras.size(), 0);
  for (const MatchPhoto& photo : photos) ++photos_of[static_cast<size_t>(photo.camera)];
  std::map<int, std::vector<int>> groups;
  for (int c = 0; c < count; ++c) {
    const auto i = static_cast<size_t>(c);
    int first = c;
    for (int other = 0; other < c && photos_of[i] <= 1; ++other) {
      const auto o = static_cast<size_t>(other);
      const calib::LensCamera &p = graph.cameras[i], &q = graph.cameras[o];
      if (photos_of[o] <= 1 && p.model == q.model && p.width_px == q.width_px &&
          p.height_px == q.height_px && p.params == q.params &&
          graph.focal_is_known[i] == graph.focal_is_known[o]) {
        first = other;
        break;
      }
    }
    groups[first].push_back(c);
  }
  return groups;
}

void Write(const VoteLens& lens, calib::LensCamera& camera) {
  const double aspect =
      calib::FocalCount(camera.model) == 2 ? camera.params[1] / camera.params[0] : 1;
  camera.params[0] = lens.focal * LongSide(camera);
  if (calib::FocalCount(camera.model) == 2) camera.params[1] = camera.params[0] * aspect;
  const int radial = *RadialIndex(camera.model);
  if (radial >= 0) camera.params[static_cast<size_t>(radial)] = lens.k1;
}

struct Decision {
  VoteLens lens;
  bool known = false, changed = false;
  double deviation = 0;
};

std::optional<Decision> Decide(const Voters& voters, VoteOptions vote, bool known) {
  vote.focal_is_fixed = !voters.on_focal;
  const auto free = VoteOnLens(voters.pairs, vote);
  if (!free) return std::nullopt;
  if (!voters.on_focal) return Decision{free->lens, known, false, 0};
  const bool sure = free->log_focal_deviation < kSureDeviation;
  const double deviation = std::hypot(free->log_focal_deviation, kSystematicDeviation);
  Decision decision{free->lens, sure, sure, deviation};
  if (sure && !known) return decision;
  vote.focal_is_fixed = true;
  const auto fixed = VoteOnLens(voters.pairs, vote);
  const double factor = std::abs(std::log(free->lens.focal / vote.prior_focal));
  if (known && sure && factor > std::log(kContradiction) &&
      factor > kContradictionSigmas * deviation && free->cost < kClearlyLower * fixed->cost) {
    return decision;
  }
  return Decision{fixed->lens, known, false, deviation};
}

VoteOptions VoteOptionsFor(const calib::LensCamera& prior, const MatchOptions& options) {
  VoteOptions vote;
  vote.prior_focal = prior.params[0] / LongSide(prior);
  vote.k1_is_fixed = *RadialIndex(prior.model) < 0;
  vote.fisheye = calib::IsFisheye(prior.model);
  vote.progress = options.progress;
  return vote;
}

bool IsKnown(const MatchOptions& options, int camera) {
  const auto c = static_cast<size_t>(camera);
  return c < options.lens_is_known.size() && options.lens_is_known[c];
}

std::vector<const CoarsePair*> PairsWithin(std::span<const CoarsePair> pairs,
                                           std::span<const MatchPhoto> photos,
                                           const std::vector<int>& cameras) {
  const auto is_member = [&](int photo) {
    const int camera = photos[static_cast<size_t>(photo)].camera;
    return std::find(cameras.begin(), cameras.end(), camera) != cameras.end();
  };
  std::vector<const CoarsePair*> within;
  for (const CoarsePair& pair : pairs) {
    if (is_member(pair.a) && is_member(pair.b)) within.push_back(&pair);
  }
  return within;
}

// One vote of cameras that share their priors; returns the note on it, if there is something to
// say.
std::string VoteTogether(const std::vector<int>& members, std::span<const MatchPhoto> photos,
                         std::span<const CoarsePair> pairs, const MatchOptions& options,
                         ViewGraph& graph) {
  const int first = members.front();
  const calib::LensCamera prior = graph.cameras[static_cast<size_t>(first)];
  const bool known = graph.focal_is_known[static_cast<size_t>(first)];
  const VoteOptions vote = VoteOptionsFor(prior, options);
  const auto voters = VotersOf(PairsWithin(pairs, photos, members), photos, graph.cameras, options);
  auto decision = Decide(voters, vote, known);
  if (!decision && known) return "";
  if (!decision) decision = Decision{{vote.prior_focal, 0}, false, false, 0};
  for (const int c : members) {
    Write(decision->lens, graph.cameras[static_cast<size_t>(c)]);
    graph.focal_is_known[static_cast<size_t>(c)] = decision->known;
  }
  const double focal_px = decision->lens.focal * LongSide(prior);
  if (decision->changed) {
    return fmt::format(
        "camera {}: focal length {:.1f} px (+-{:.1f} %) and k1 {:.3f} by {} pairs{}", first + 1,
        focal_px, 100 * decision->deviation, decision->lens.k1, voters.pairs.size(),
        known ? fmt::format("; EXIF's {:.1f} px contradict them", prior.params[0]) : "");
  }
  if (known) return "";
  return fmt::format("camera {}: {} pairs do not determine the focal length; {:.1f} px is assumed",
                     first + 1, voters.pairs.size(), focal_px);
}

// Cameras of one photo each, of one model, whose intrinsics are not given: any of them may be
// zoomed. Sorted.
std::vector<std::vector<int>> ZoomGroups(std::span<const MatchPhoto> photos,
                                         const MatchOptions& options, const ViewGraph& graph) {
  std::vector<int> photos_of(graph.cameras.size(), 0);
  for (const MatchPhoto& photo : photos) ++photos_of[static_cast<size_t>(photo.camera)];
  std::map<calib::CameraModel, std::vector<int>> groups;
  for (size_t c = 0; c < photos_of.size(); ++c) {
    const calib::CameraModel model = graph.cameras[c].model;
    const auto camera = static_cast<int>(c);
    if (photos_of[c] == 1 && !IsKnown(options, camera) && RadialIndex(model)) {
      groups[model].push_back(camera);
    }
  }
  std::vector<std::vector<int>> large;
  for (auto& [model, cameras] : groups) {
    if (cameras.size() >= kMinZoomed) large.push_back(std::move(cameras));
  }
  return large;
}

// The median, and the cameras that differ from it, a few by the names of their photos.
std::string NoteOnZoom(const std::map<int, double>& focals_px, const std::string& deviation,
                       size_t pairs, std::span<const MatchPhoto> photos) {
  constexpr double kSameFocal = 0.03;
  constexpr size_t kNamed = 4;
  std::vector<double> values;
  for (const auto& [photo, focal_px] : focals_px) values.push_back(focal_px);
  const double median = UpperMedian(values);
  std::vector<std::string> others;
  for (const auto& [photo, focal_px] : focals_px) {
    if (std::abs(std::log(focal_px / median)) <= kSameFocal) continue;
    others.push_back(fmt::format("{} {:.1f}", photos[static_cast<size_t>(photo)].name, focal_px));
  }
  std::string note = fmt::format(
      "{} photos with a camera each: focal length {:.1f} px ({}) by {} "
      "pairs",
      focals_px.size(), median, deviation, pairs);
  if (others.empty()) return note;
  const size_t more = others.size() - std::min(others.size(), kNamed);
  others.resize(others.size() - more);
  note += fmt::format("; zoomed: {}", fmt::join(others, ", "));
  return more > 0 ? note + fmt::format(" and {} more", more) : note;
}

// What was known of cameras before any vote.
struct Priors {
  std::vector<calib::LensCamera> cameras;
  std::vector<bool> focal_is_known;
};

// Whether EXIF's focal length of a photo is not its own.
bool ContradictsPrior(const PhotoFocal& found, double prior_focal) {
  const double factor = std::abs(std::log(found.focal / prior_focal));
  return factor > std::log(kContradiction) && factor > kContradictionSigmas * found.log_deviation;
}

// Every photo's own focal length, where they explain the matches clearly better than those that
// the cameras have by now; returns the note on it, empty where they do not.
std::string VoteApart(const std::vector<int>& members, std::span<const MatchPhoto> photos,
                      std::span<const CoarsePair> pairs, const MatchOptions& options,
                      const Priors& priors, ViewGraph& graph) {
  const auto voters =
      VotersOf(PairsWithin(pairs, photos, members), photos, graph.cameras, options, kVotersOfPhoto);
  if (!voters.on_focal) return "";
  const VoteOptions vote =
      VoteOptionsFor(graph.cameras[static_cast<size_t>(members.front())], options);
  std::map<int, double> focals;
  for (size_t i = 0; i < photos.size(); ++i) {
    const calib::LensCamera& camera = graph.cameras[static_cast<size_t>(photos[i].camera)];
    focals[static_cast<int>(i)] = camera.params[0] / LongSide(camera);
  }
  const auto together = CostOfFocals(voters.pairs, focals, vote);
  const auto apart = VoteOnZoom(voters.pairs, vote);
  if (!apart || !(apart->cost < kClearlyLower * together->cost)) return "";
  std::vector<double> sure, deviations;
  for (const auto& [photo, focal] : apart->photos) {
    if (!(focal.log_deviation < kSureDeviation)) continue;
    sure.push_back(focal.focal);
    deviations.push_back(focal.log_deviation);
  }
  if (sure.size() < kMinZoomed) return "";
  const double usual = UpperMedian(sure);
  std::map<int, double> focals_px;
  for (size_t i = 0; i < photos.size(); ++i) {
    const auto photo = static_cast<int>(i);
    const auto c = static_cast<size_t>(photos[i].camera);
    if (std::find(members.begin(), members.end(), photos[i].camera) == members.end()) continue;
    calib::LensCamera& camera = graph.cameras[c];
    const auto found = apart->photos.find(photo);
    const bool is_sure =
        found != apart->photos.end() && found->second.log_deviation < kSureDeviation;
    const double prior = priors.cameras[c].params[0] / LongSide(camera);
    const bool by_prior =
        priors.focal_is_known[c] && !(is_sure && ContradictsPrior(found->second, prior));
    Write({by_prior  ? prior
           : is_sure ? found->second.focal
                     : usual,
           apart->k1, vote.fisheye},
          camera);
    graph.focal_is_known[c] = by_prior || is_sure;
    focals_px[photo] = camera.params[0];
  }
  return NoteOnZoom(focals_px, fmt::format("+-{:.1f} %", 100 * UpperMedian(deviations)),
                    voters.pairs.size(), photos);
}

}  // namespace

void VoteOnCameras(std::span<const MatchPhoto> photos, std::span<const CoarsePair> pairs,
                   const MatchOptions& options, ViewGraph& graph, std::vector<std::string>& notes) {
  const Priors priors{graph.cameras, graph.focal_is_known};
  std::map<int, std::string> note_of;  // by the first of the cameras
  std::map<int, int> first_of;         // of the cameras that vote together
  for (auto [first, members] : Groups(photos, graph)) {
    std::erase_if(members, [&](int camera) { return IsKnown(options, camera); });
    if (members.empty() || !RadialIndex(graph.cameras[static_cast<size_t>(first)].model)) continue;
    note_of[members.front()] = VoteTogether(members, photos, pairs, options, graph);
    for (const int c : members) first_of[c] = members.front();
  }
  for (const std::vector<int>& members : ZoomGroups(photos, options, graph)) {
    const std::string note = VoteApart(members, photos, pairs, options, priors, graph);
    if (note.empty()) continue;
    for (const int c : members) note_of[first_of.at(c)].clear();
    note_of[first_of.at(members.front())] = note;
  }
  for (const auto& [first, note] : note_of) {
    if (!note.empty()) notes.push_back(note);
  }
}

}  // namespace dtr::sfm::matching
