#include "calib/bundle/parts.h"

#include <algorithm>

namespace dtr::calib {
namespace {

constexpr int kShared = 10;        // points that an image must share with a part to join it
constexpr size_t kMinOfPart = 20;  // images; fewer are joined by those of other parts
constexpr int kUnknownsOfImage = 9;

// Which images see a point, and the points of an image.
struct ObservationsByTrack {
  std::vector<std::vector<int>> of_point, of_image;
  explicit ObservationsByTrack(const Bundle& bundle)
      : of_point(bundle.points.size()), of_image(bundle.images.size()) {
    for (const BundleObservation& o : bundle.observations) {
      of_point[static_cast<size_t>(o.point)].push_back(o.image);
      of_image[static_cast<size_t>(o.image)].push_back(o.point);
    }
  }
};

// A part that grows image by image.
class Part {
 public:
  Part(const Bundle& bundle, const ObservationsByTrack& observations)
      : bundle_(bundle),
        observations_(observations),
        wanted_(bundle.images.size()),
        lens_used_(bundle.lenses.size()),
        point_seen_(bundle.points.size()),
        shared_(bundle.images.size()) {}

  void Add(size_t image) {
    unknowns_ += Cost(image);
    wanted_[image] = true;
    ++size_;
    lens_used_[LensOf(image)] = true;
    for (const int point : observations_.of_image[image]) {
      const auto p = static_cast<size_t>(point);
      if (point_seen_[p]) continue;
      point_seen_[p] = true;
      for (const int other : observations_.of_point[p]) ++shared_[static_cast<size_t>(other)];
    }
  }

  // The image that shares most points with the part, among those that may join; none where none
  // shares enough, or where it would be too much.
  template <typename MayJoin>
  bool Grow(int max_unknowns, const MayJoin& may_join) {
    size_t best = wanted_.size();
    for (size_t i = 0; i < wanted_.size(); ++i) {
      if (wanted_[i] || !may_join(i) || shared_[i] < kShared) continue;
      if (best == wanted_.size() || shared_[i] > shared_[best]) best = i;
    }
    if (best == wanted_.size() || unknowns_ + Cost(best) > max_unknowns) return false;
    Add(best);
    return true;
  }

  const std::vector<bool>& wanted() const { return wanted_; }
  size_t size() const { return size_; }

 private:
  size_t LensOf(size_t image) const { return static_cast<size_t>(bundle_.images[image].lens); }
  int Cost(size_t image) const {
    const size_t lens = LensOf(image);
    return kUnknownsOfImage +
           (lens_used_[lens] ? 0 : static_cast<int>(bundle_.lenses[lens].params.size()));
  }

  const Bundle& bundle_;
  const ObservationsByTrack& observations_;
  std::vector<bool> wanted_, lens_used_, point_seen_;
  std::vector<int> shared_;
  int unknowns_ = 0;
  size_t size_ = 0;
};

}  // namespace

Bundle OnlyImages(const Bundle& bundle, const std::vector<bool>& wanted) {
  Bundle some;
  some.points = bundle.points;
  some.point_ids = bundle.point_ids;
  std::vector<int> image_at(bundle.images.size(), -1), lens_at(bundle.lenses.size(), -1);
  for (size_t i = 0; i < bundle.images.size(); ++i) {
    if (!wanted[i]) continue;
    image_at[i] = static_cast<int>(some.images.size());
    some.images.push_back(bundle.images[i]);
    int& lens = lens_at[static_cast<size_t>(bundle.images[i].lens)];
    if (lens < 0) {
      lens = static_cast<int>(some.lenses.size());
      some.lenses.push_back(bundle.lenses[static_cast<size_t>(bundle.images[i].lens)]);
    }
    some.images.back().lens = lens;
  }
  std::vector<int> seen_by(bundle.points.size());
  for (BundleObservation o : bundle.observations) {
    o.image = image_at[static_cast<size_t>(o.image)];
    if (o.image < 0) continue;
    some.observations.push_back(o);
    ++seen_by[static_cast<size_t>(o.point)];
  }
  std::erase_if(some.observations, [&](const BundleObservation& o) {
    return seen_by[static_cast<size_t>(o.point)] < 2;
  });
  return some;
}

Bundle WithoutWeakImages(const Bundle& bundle, int fewest) {
  std::vector<int> observations(bundle.images.size());
  for (const BundleObservation& o : bundle.observations)
    ++observations[static_cast<size_t>(o.image)];
  std::vector<bool> wanted;
  for (const int count : observations) wanted.push_back(count >= fewest);
  return OnlyImages(bundle, wanted);
}

int ValidationUnknowns(const Bundle& bundle) {
  int unknowns = kUnknownsOfImage * static_cast<int>(bundle.images.size());
  for (const LensCamera& lens : bundle.lenses) unknowns += static_cast<int>(lens.params.size());
  return unknowns;
}

std::vector<Bundle> PartsOf(const Bundle& bundle, int max_unknowns) {
  const ObservationsByTrack observations(bundle);
  std::vector<bool> taken(bundle.images.size());
  std::vector<Bundle> parts;
  for (size_t first = 0; first < taken.size(); ++first) {
    if (taken[first]) continue;
    Part part(bundle, observations);
    part.Add(first);
    while (part.Grow(max_unknowns, [&](size_t i) { return !taken[i]; })) {
    }
    while (part.size() < kMinOfPart && part.Grow(max_unknowns, [](size_t) { return true; })) {
    }
    for (size_t i = 0; i < taken.size(); ++i) taken[i] = taken[i] || part.wanted()[i];
    parts.push_back(OnlyImages(bundle, part.wanted()));
  }
  return parts;
}

}  // namespace dtr::calib
