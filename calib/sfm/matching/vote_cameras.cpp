#include "calib/sfm/matching/vote_cameras.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "calib/models/fisheye.h"
#include "calib/sfm/matching/lens_vote.h"
#include "calib/sfm/matching/pair_kind.h"
#include "calib/sfm/matching/robust_fit.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"

namespace dtr::sfm::matching {
namespace {

constexpr size_t kVoters = 40;         // pairs
constexpr size_t kCandidates = 80;     // pairs whose fundamental matrix is looked at
constexpr size_t kVotingMatches = 80;  // of a pair
constexpr size_t kFewestInliers = 30;  // of a pair that votes: more than chance gives
constexpr double kSureDeviation = 0.1, kContradiction = 1.15, kClearlyLower = 0.9;
constexpr double kContradictionSigmas = 3;

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
                      const calib::LensCamera& camera, std::uint64_t seed) {
  PointPairs points;
  const auto& a = photos[static_cast<size_t>(coarse.a)].features.keypoints;
  const auto& b = photos[static_cast<size_t>(coarse.b)].features.keypoints;
  for (const CoarseMatch& m : coarse.matches) {
    const Eigen::Vector2d p = Centred(camera, a[static_cast<size_t>(m.a)]);
    const Eigen::Vector2d q = Centred(camera, b[static_cast<size_t>(m.b)]);
    if (p.allFinite() && q.allFinite()) points.Add(p, q);
  }
  Candidate candidate;
  const double band = BandOf(LongSide(camera));
  const Explained explained = calib::IsFisheye(camera.model)
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

// The pairs that vote on a camera: the best of those with the most matches; where one homography
// explains every pair, these.
Voters VotersOf(std::vector<const CoarsePair*> pairs, std::span<const MatchPhoto> photos,
                const calib::LensCamera& camera, const MatchOptions& options) {
  std::stable_sort(pairs.begin(), pairs.end(), [](const CoarsePair* p, const CoarsePair* q) {
    return p->matches.size() > q->matches.size();
  });
  pairs.resize(std::min(pairs.size(), kCandidates));
  std::vector<Candidate> candidates(pairs.size());
  ParallelFor(0, static_cast<int>(pairs.size()), options.threads, [&](int i) {
    if (options.progress != nullptr) options.progress->ThrowIfInterrupted();
    const CoarsePair& pair = *pairs[static_cast<size_t>(i)];
    candidates[static_cast<size_t>(i)] =
        CandidateOf(pair, photos, camera, HashOf(options.seed, 1, pair.a, pair.b));
  });
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& p, const Candidate& q) { return p.weight > q.weight; });
  std::erase_if(candidates, [](const Candidate& c) { return !(c.weight > 0); });
  Voters voters;
  voters.on_focal = std::any_of(candidates.begin(), candidates.end(),
                                [](const Candidate& c) { return !c.planar; });
  for (Candidate& c : candidates) {
    if (c.planar && voters.on_focal) continue;
    if (voters.pairs.size() < kVoters) voters.pairs.push_back(std::move(c.pair));
  }
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
  Decision decision{free->lens, sure, sure, free->log_focal_deviation};
  if (sure && !known) return decision;
  vote.focal_is_fixed = true;
  const auto fixed = VoteOnLens(voters.pairs, vote);
  const double factor = std::abs(std::log(free->lens.focal / vote.prior_focal));
  if (known && sure && factor > std::log(kContradiction) &&
      factor > kContradictionSigmas * free->log_focal_deviation &&
      free->cost < kClearlyLower * fixed->cost) {
    return decision;
  }
  return Decision{fixed->lens, known, false, free->log_focal_deviation};
}

}  // namespace

void VoteOnCameras(std::span<const MatchPhoto> photos, std::span<const CoarsePair> pairs,
                   const MatchOptions& options, ViewGraph& graph, std::vector<std::string>& notes) {
  const auto is_known = [&](int camera) {
    const auto c = static_cast<size_t>(camera);
    return c < options.lens_is_known.size() && options.lens_is_known[c];
  };
  for (auto [first, members] : Groups(photos, graph)) {
    std::erase_if(members, is_known);
    if (members.empty()) continue;
    const auto is_member = [&, &group = members](int photo) {
      const int camera = photos[static_cast<size_t>(photo)].camera;
      return std::find(group.begin(), group.end(), camera) != group.end();
    };
    const calib::LensCamera prior = graph.cameras[static_cast<size_t>(members.front())];
    const bool known = graph.focal_is_known[static_cast<size_t>(members.front())];
    const auto radial = RadialIndex(prior.model);
    if (!radial) continue;
    std::vector<const CoarsePair*> own;
    for (const CoarsePair& pair : pairs) {
      if (is_member(pair.a) && is_member(pair.b)) own.push_back(&pair);
    }
    VoteOptions vote;
    vote.prior_focal = prior.params[0] / LongSide(prior);
    vote.k1_is_fixed = *radial < 0;
    vote.fisheye = calib::IsFisheye(prior.model);
    vote.threads = options.threads;
    vote.progress = options.progress;
    const auto voters = VotersOf(std::move(own), photos, prior, options);
    auto decision = Decide(voters, vote, known);
    if (!decision && known) continue;
    if (!decision) decision = Decision{{vote.prior_focal, 0}, false, false, 0};
    for (const int c : members) {
      Write(decision->lens, graph.cameras[static_cast<size_t>(c)]);
      graph.focal_is_known[static_cast<size_t>(c)] = decision->known;
    }
    const double focal_px = decision->lens.focal * LongSide(prior);
    if (decision->changed) {
      notes.push_back(fmt::format(
          "camera {}: focal length {:.1f} px (+-{:.1f} %) and k1 {:.3f} by {} pairs{}", first + 1,
          focal_px, 100 * decision->deviation, decision->lens.k1, voters.pairs.size(),
          known ? fmt::format("; EXIF's {:.1f} px contradict them", prior.params[0]) : ""));
    } else if (!known) {
      notes.push_back(
          fmt::format("camera {}: {} pairs do not determine the focal length; {:.1f} px is assumed",
                      first + 1, voters.pairs.size(), focal_px));
    }
  }
}

}  // namespace dtr::sfm::matching
