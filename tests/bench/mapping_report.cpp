// mapping_report [COUNT...]: what global mapping costs and how exact it is as photos become many
// (300 and 1200). Prints Markdown. Synthetic matches of exact scenes with noise of 0.4 px and wrong
// matches: a ring around a ball, where photos of a seventh of the ring see common points, and a
// closed walk along facades.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>
#include <vector>

#include "calib/sfm/mapping/global_mapper.h"
#include "dtr/base/machine.h"
#include "tests/calib/sfm/mapping/synthetic_graph.h"

namespace dtr::sfm::testing {
namespace {

constexpr int kFeatures = 1000;  // of a photo, about
constexpr int kNearest = 10;     // photos before and after that each is matched with
constexpr int kFarther = 10;     // and as many at random among those that see the same
constexpr double kTau = 2 * std::numbers::pi;

// How many photos in a row see a point.
int SpanOf(double share, int images) { return std::max(4, static_cast<int>(share * images)); }

struct Case {
  std::string name;
  Scene scene;
  GraphSpec spec{.outlier_share = 0.01};
  int span = 0;
};

Case RingCase(int images) {
  constexpr double kFacing = 0.7;  // features are found again within 45 degrees, which is a seventh
  constexpr double kSpan = 0.14;   // of the ring
  constexpr double kSeen = 0.047;  // of the points of the ball, in a photo
  Case ring{"ring",
            Ring(images, static_cast<int>(kFeatures / kSeen)),
            {.outlier_share = 0.01},
            SpanOf(kSpan, images)};
  ring.spec.min_facing = kFacing;
  return ring;
}

// Outside around a block of houses of 1 m between photos, 10 m away.
Case StreetCase(int images) {
  constexpr double kDistance = 10, kSeen = 13.7;  // m; of the facade in a photo
  const double radius = images / kTau, wall = radius + kDistance;
  Random random(5);
  Case street{"street", {{Lens()}, {}, {}, {}}, {.outlier_share = 0.01}, static_cast<int>(kSeen)};
  for (int i = 0; i < images; ++i) {
    const double a = kTau * i / images;
    const Eigen::Vector3d out(std::cos(a), 0, std::sin(a));
    const Eigen::Vector3d centre = radius * out + Eigen::Vector3d(0, 0.4 * std::sin(7 * a), 0);
    street.scene.cam_from_world.push_back(LookAt(centre, wall * out));
  }
  const int points = static_cast<int>(kFeatures * kTau * wall / kSeen);
  for (int i = 0; i < points; ++i) {
    const double a = random.Uniform(0, kTau), r = wall + random.Uniform(-1.5, 1.5);
    const double y = random.Uniform(-5, 5);
    street.scene.points.push_back(
        {{r * std::cos(a), y, r * std::sin(a)}, {-std::cos(a), 0, -std::sin(a)}});
  }
  return street;
}

ViewGraph GraphOf(const Case& of) {
  Random random(1);
  Seen seen = Photograph(of.scene, of.spec, &random);
  const int images = static_cast<int>(of.scene.images());
  for (int a = 0; a < images; ++a) {
    std::vector<int> others;
    for (int k = 1; k <= kNearest; ++k) others.push_back((a + k) % images);
    for (int k = 0; k < kFarther; ++k) {
      others.push_back((a + kNearest + 1 + random.Index(std::max(1, of.span - kNearest))) % images);
    }
    std::sort(others.begin(), others.end());
    others.erase(std::unique(others.begin(), others.end()), others.end());
    for (const int b : others) {
      if (a == b) continue;
      const int low = std::min(a, b), high = std::max(a, b);
      const Pose& from = of.scene.cam_from_world[low];
      PairGeometry pair =
          MatchPair(seen, low, high, seen.shows[high],
                    of.scene.cam_from_world[high] * from.Inverse(), of.spec, &random);
      if (static_cast<int>(pair.matches.size()) >= of.spec.min_matches) {
        seen.graph.pairs.push_back(std::move(pair));
      }
    }
  }
  SortPairs(&seen.graph);
  return std::move(seen.graph);
}

void Report(const Case& of) {
  const ViewGraph graph = GraphOf(of);
  const double before = ProcessCpuMilliseconds() / 1e3;
  const Mapped mapped = MapGlobally(graph, {});
  const double seconds = ProcessCpuMilliseconds() / 1e3 - before;
  if (!mapped.why_not.empty()) {
    fmt::print("| {} | {} | {:.1f} | refused: {} | | | |\n", of.name, of.scene.images(), seconds,
               mapped.why_not);
    return;
  }
  size_t observations = 0;
  for (const calib::SfmImage& image : mapped.model.images) observations += image.features.size();
  const MapErrors errors = Compare(mapped.model, of.scene);
  fmt::print("| {} | {} | {:.1f} | {:.0f} | {:.1f} | {:.4f} | {:.4f} |\n", of.name,
             of.scene.images(), seconds, 1e3 * seconds / static_cast<double>(of.scene.images()),
             static_cast<double>(observations) / static_cast<double>(mapped.model.points.size()),
             errors.rotation_deg, 100 * errors.position_share);
  std::fflush(stdout);
}

}  // namespace
}  // namespace dtr::sfm::testing

int main(int argc, char** argv) {
  std::vector<int> counts;
  for (int i = 1; i < argc; ++i) counts.push_back(std::atoi(argv[i]));
  if (counts.empty()) counts = {300, 1200};
  fmt::print(
      "| scene | photos | CPU s | ms per photo | features per point | median rotation error, deg | "
      "RMS position error, % of the spread |\n|---|---|---|---|---|---|---|\n");
  for (const auto make : {dtr::sfm::testing::RingCase, dtr::sfm::testing::StreetCase}) {
    for (const int count : counts) dtr::sfm::testing::Report(make(std::max(8, count)));
  }
}
