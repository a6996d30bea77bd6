#include "pipeline/core/depth/depth_priors.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"
#include "dtr/io/formats/depth_grid.h"
#include "dtr/io/formats/foreign_depth.h"
#include "dtr/io/formats/rgbd_capture.h"
#include "pipeline/core/cameras/camera_distortion.h"
#include "pipeline/core/depth/camera_depth.h"

namespace dtr::pipeline {
namespace {

using stereo::ViewPrior;

/// A scale that is known this well is well determined.
constexpr double kMaxScaleSigma = 0.01;
/// A scale that is not may be off by so much, which then counts as noise.
constexpr double kSmallScale = 0.02;
/// In a set in metres no depth camera is off by a factor of two.
constexpr double kMaxScale = 2;
/// What remains of one distance after correction of the scale, at most.
constexpr double kMaxBias = 0.1;
/// From this on a correction is worth a line of its own.
constexpr double kNamedScale = 0.01;
constexpr double kEndShare = 0.01;

struct Unit {
  double per_unit;  ///< numbers per scene unit
  const char* name;
};
constexpr Unit kUnits[] = {{1000, "millimetres"},
                           {100, "centimetres"},
                           {10000, "tenths of millimetres"},
                           {5000, "5000 to the metre, as in TUM's sequences"},
                           {3.2808, "feet"}};

/// The unit whose numbers are as many times too large, if there is one.
const Unit* SuspectedUnit(double scale) {
  constexpr double kLike = 0.3;  // relative
  for (const Unit& unit : kUnits) {
    if (std::abs(scale / unit.per_unit - 1) < kLike) return &unit;
  }
  return nullptr;
}

/// Of the measured depths but for the outermost per cent at either end; 0 where there are none.
stereo::DepthRange EndsOf(const DepthImage& depth) {
  const std::array<double, 2> shares{kEndShare, 1 - kEndShare};
  const std::vector<float> ends = QuantilesOfPositive(depth.grid().data(), shares);
  if (ends.empty()) return {};
  return {static_cast<double>(ends[0]), static_cast<double>(ends[1])};
}

double Percent(double share) { return 100 * share; }

/// A map of the same field of view on the pixels of a camera.
DepthImage OnGrid(const DepthImage& depth, const PinholeCamera& grid) {
  if (depth.width() == grid.width_px() && depth.height() == grid.height_px()) return depth;
  const Eigen::Array2d ratio(static_cast<double>(depth.width()) / grid.width_px(),
                             static_cast<double>(depth.height()) / grid.height_px());
  return io::Resampled(depth, grid.width_px(), grid.height_px(),
                       [&](const Eigen::Vector2d& pixel) -> std::optional<Eigen::Vector2d> {
                         return Eigen::Vector2d(pixel.array() * ratio);
                       });
}

/// Whole numbers are never scene units by themselves.
void RequireUnit(const std::filesystem::path& file, const DepthPriorChoice& choice) {
  if (choice.unit || !io::HoldsWholeNumbers(file)) return;
  throw UsageError(
      file.string() +
      ": expected `prior_unit` for a depth map of whole numbers, found none; give it, as "
      "0.001 for millimetres in a set in metres");
}

/// What a capture has of its photos.
struct MapsOfCapture {
  std::map<std::string, std::string> files;  ///< by the file names of the photos
  io::ConfidenceMaps confidence;
  std::string confidence_line;
  std::shared_ptr<const TemporaryFolder> unpacked;
};

/// Where the folder is a capture: its maps; folder and unit of the choice become theirs.
MapsOfCapture TakeCapture(DepthPriorChoice& choice) {
  const std::string format = io::RgbdFormatOf(choice.folder);
  if (format.empty()) return {};
  const io::RgbdCapture capture = io::ReadRgbdCapture(choice.folder, format);
  MapsOfCapture maps{{}, capture.confidence, capture.confidence_line, capture.unpacked};
  for (const io::NamedCamera& camera : capture.list.cameras) {
    if (camera.depth_file.empty()) continue;
    maps.files[std::filesystem::path(camera.name).filename().string()] = camera.depth_file;
  }
  choice.folder = capture.depth;
  if (!choice.unit) choice.unit = capture.depth_unit_m;
  return maps;
}

CameraDepthOptions OptionsOf(const DepthPriorChoice& choice, const io::ConfidenceMaps& confidence) {
  CameraDepthOptions options;
  options.depth_dir = choice.folder;
  options.confidence = confidence;
  options.depth_kind = choice.kind;
  options.depth_unit = choice.unit;
  return options;
}

}  // namespace

DepthPriors::DepthPriors(const DepthPriorChoice& choice, std::span<const View* const> views,
                         std::span<const stereo::StereoView> sources, const SparseScene& scene,
                         LengthUnit unit, const PhotoCameras& photos, Progress& progress)
    : asked_(choice.folder), choice_(choice) {
  MapsOfCapture maps_of_capture = TakeCapture(choice_);
  const std::map<std::string, std::string>& named = maps_of_capture.files;
  confidence_ = std::move(maps_of_capture.confidence);
  unpacked_ = std::move(maps_of_capture.unpacked);
  if (!maps_of_capture.confidence_line.empty()) Say(maps_of_capture.confidence_line, progress);
  const CameraDepthOptions options = OptionsOf(choice_, confidence_);
  for (const View* view : views) {
    io::NamedCamera camera;
    camera.name = view->name;
    camera.camera = view->camera;
    if (const auto photo = photos.find(view->name); photo != photos.end()) camera = photo->second;
    const std::string file_name = std::filesystem::path(view->name).filename().string();
    if (const auto file = named.find(file_name); file != named.end())
      camera.depth_file = file->second;
    const auto files = DepthFilesOf(camera, options);
    if (!files.empty()) RequireUnit(files.front(), choice_);
    has_map_.push_back(!files.empty());
    cameras_.push_back(std::move(camera));
    grids_.push_back(view->camera);
  }
  report_.photos = static_cast<int>(views.size());
  const auto maps = std::count(has_map_.begin(), has_map_.end(), true);
  if (maps == 0) {
    throw UsageError(fmt::format(
        "`depth_prior` {}: expected depth maps (.exr, .pfm, .png, .tif, .npy) named like the "
        "photos, "
        "as that of {}, found none; give the folder whose maps are named like the photos",
        asked_.string(), cameras_.empty() ? "a photo" : cameras_.front().name));
  }
  progress.Stage("depth prior", static_cast<int>(views.size()));
  int done = 0;
  ends_.resize(views.size());
  report_.agreement =
      stereo::MeasurePriors(sources, scene, [&](int source) -> std::optional<DepthImage> {
        progress.ThrowIfInterrupted();
        progress.Update(++done);
        if (!has_map_[static_cast<size_t>(source)]) return std::nullopt;
        DepthImage depth = Load(static_cast<size_t>(source));
        ends_[static_cast<size_t>(source)] = EndsOf(depth);
        return depth;
      });
  for (const ViewPrior& view : report_.agreement.views) {
    report_.names.push_back(cameras_[static_cast<size_t>(view.view)].name);
  }
  Validate(unit, progress);
  priors_.resize(views.size());
  for (size_t source = 0; source < views.size(); ++source) {
    priors_[source] = {[this, source] { return Load(source); }, report_.agreement.expected};
  }
}

DepthImage DepthPriors::Load(size_t source) const {
  const io::NamedCamera& camera = cameras_[source];
  std::unique_ptr<CameraDistortion> distortion;
  if (camera.distortion) distortion = DistortionOf(camera);
  std::string resampled;
  DepthImage depth =
      ReadCameraDepth(camera, OptionsOf(choice_, confidence_), distortion.get(), resampled);
  if (depth.width() > grids_[source].width_px()) depth = OnGrid(depth, grids_[source]);
  if (report_.divided_by == 1) return depth;
  for (float& z : depth.grid().data()) z = static_cast<float>(z / report_.divided_by);
  return depth;
}

void DepthPriors::Say(const std::string& line, Progress& progress) {
  report_.lines.push_back(line);
  progress.Note(line);
}

void DepthPriors::Validate(LengthUnit unit, Progress& progress) {
  const stereo::PriorAgreement& found = report_.agreement;
  const std::string where = "`depth_prior` " + asked_.string();
  if (found.points < stereo::kMinPriorPointsInAll) {
    throw Error(fmt::format(
        "{}: cannot be checked against the photos, their points on its maps are {} and must be {}; "
        "give maps of these photos, or leave it out",
        where, found.points, stereo::kMinPriorPointsInAll));
  }
  const bool unit_known = unit == LengthUnit::kMetre;
  const Unit* suspected = unit == LengthUnit::kArbitrary ? nullptr : SuspectedUnit(found.scale);
  if (suspected != nullptr ||
      (unit_known && std::abs(std::log(found.scale)) > std::log(kMaxScale))) {
    throw Error(fmt::format(
        "{}: its depth is {:.4g} times what the photos and their cameras say, at {} points: {}",
        where, found.scale, found.points,
        suspected != nullptr
            ? fmt::format("are its numbers {}? give `prior_unit` {:.4g}", suspected->name,
                          choice_.unit.value_or(1.0) / suspected->per_unit)
            : "its unit, or that of the cameras, is another; give `prior_unit`"));
  }
  if (!found.shift.isZero(0)) {
    const PinholeCamera& camera = cameras_.front().camera;
    throw Error(
        fmt::format("{}: its maps are shifted against the photos: moved by {:.1f}, {:.1f} px (of "
                    "photos of {} px "
                    "width) they fit best; give maps that are registered to the photos' camera",
                    where, found.shift.x() * camera.width_px(), found.shift.y() * camera.width_px(),
                    camera.width_px()));
  }
  if (found.noise > stereo::kMaxPriorNoise || found.outliers > stereo::kMaxPriorOutliers) {
    throw Error(
        fmt::format("{}: its maps do not show what the photos show: at {} points their depths "
                    "scatter by {:.1f} %, "
                    "and {:.0f} % of them are off by more than 10 %; give the maps of these "
                    "photos, neither rotated "
                    "nor mirrored, and as `prior_kind` says",
                    where, found.points, Percent(found.noise), Percent(found.outliers)));
  }
  const auto& bins = found.by_distance;
  const int maps = static_cast<int>(found.views.size());
  Say(fmt::format(
          "depth prior: {} of {} photos have a map; at {} points of the photos its depth is "
          "{:.4f} +- {:.4f} times theirs, with a noise of {:.1f} % at {:.3g} to {:.1f} % at {:.3g}",
          maps, report_.photos, found.points, found.scale, found.scale * found.scale_sigma,
          Percent(bins.front().noise), bins.front().near_z, Percent(bins.back().noise),
          bins.back().far_z),
      progress);
  LeaveOutWhatDiffers(progress);
  CorrectScale(unit, progress);
}

void DepthPriors::LeaveOutWhatDiffers(Progress& progress) {
  const stereo::PriorAgreement& found = report_.agreement;
  const int differ = found.Count(ViewPrior::Fit::kDiffers);
  const ViewPrior* first = nullptr;
  for (const ViewPrior& view : found.views) {
    if (view.fit != ViewPrior::Fit::kDiffers) continue;
    has_map_[static_cast<size_t>(view.view)] = false;
    if (first == nullptr) first = &view;
  }
  if (differ > 0) {
    Say(fmt::format(
            "depth prior: the maps of {} photos left out, first that of {}: {:.3f} times the "
            "photo's depth with a noise of {:.1f} % and {:.0f} % outliers, the others {:.3f} "
            "with {:.1f} % and {:.0f} %; is it of another photo?",
            differ, cameras_[static_cast<size_t>(first->view)].name, first->ratio,
            Percent(first->noise), Percent(first->outliers), found.scale, Percent(found.noise),
            Percent(found.outliers)),
        progress);
  }
  if (const int few = found.Count(ViewPrior::Fit::kFewPoints); few > 0) {
    Say(fmt::format(
            "depth prior: the maps of {} photos cannot be checked one by one, they have fewer "
            "than {} points",
            few, stereo::kMinPriorPoints),
        progress);
  }
}

void DepthPriors::CorrectScale(LengthUnit unit, Progress& progress) {
  stereo::PriorAgreement& found = report_.agreement;
  RequireOneScale();
  const double off = std::abs(std::log(found.scale));
  const bool well_determined = found.scale_sigma <= kMaxScaleSigma;
  if (!well_determined) {
    if (off > std::max(kSmallScale, 2 * found.scale_sigma)) {
      throw Error(
          fmt::format("`depth_prior` {}: its depth is {:.3f} times what the photos say, known to "
                      "{:.1f} % only: too "
                      "little to correct it by; give `prior_unit`, or maps of more photos",
                      asked_.string(), found.scale, Percent(found.scale_sigma)));
    }
    for (double& sigma : found.expected.sigma) sigma = std::hypot(sigma, off);
    return;
  }
  if (off <= 2 * found.scale_sigma) return;
  report_.divided_by = found.scale;
  if (off <= kNamedScale) return;
  Say(fmt::format("depth prior: divided by {:.4f}, so that it has the scale of the cameras{}",
                  found.scale,
                  unit == LengthUnit::kMetre ? ", which are in metres: one of the two is off" : ""),
      progress);
}

void DepthPriors::RequireOneScale() const {
  const auto& bins = report_.agreement.by_distance;
  const auto worst = std::max_element(bins.begin(), bins.end(), [](const auto& a, const auto& b) {
    return std::abs(a.bias) < std::abs(b.bias);
  });
  if (worst == bins.end() || std::abs(worst->bias) <= kMaxBias) return;
  throw Error(fmt::format(
      "`depth_prior` {}: its error depends on the distance, {:+.0f} % at {:.3g} to {:.3g} and "
      "{:+.0f} % "
      "at {:.3g} to {:.3g}, which no scale corrects; give depth, not disparity, and `prior_kind` "
      "ray "
      "where it is the distance from the camera",
      asked_.string(), Percent(bins.front().bias), bins.front().near_z, bins.front().far_z,
      Percent(bins.back().bias), bins.back().near_z, bins.back().far_z));
}

void DepthPriors::Attach(std::span<stereo::StereoView> sources) const {
  for (size_t i = 0; i < sources.size(); ++i) {
    if (has_map_[i]) sources[i].prior = &priors_[i];
  }
}

std::vector<stereo::DepthRange> DepthPriors::Widened(std::vector<stereo::DepthRange> ranges) const {
  for (size_t i = 0; i < ranges.size(); ++i) {
    if (!has_map_[i] || !(ends_[i].near_z > 0)) continue;
    ranges[i].near_z = std::min(ranges[i].near_z, ends_[i].near_z / report_.divided_by);
    ranges[i].far_z = std::max(ranges[i].far_z, ends_[i].far_z / report_.divided_by);
  }
  return ranges;
}

namespace {

class PriorEngine final : public stereo::Engine {
 public:
  std::string name() const override { return "prior"; }
  bool Searches() const override { return false; }
  std::uint64_t WorkBytes(std::span<const stereo::StereoView> views, int reference,
                          std::span<const int> /*neighbours*/) const override {
    constexpr std::uint64_t kBytesPerPixel = 8 + 4 + 4 + 4;  // the result, and maps on the way
    const PinholeCamera& camera = views[static_cast<size_t>(reference)].camera;
    return kBytesPerPixel * static_cast<std::uint64_t>(camera.width_px()) *
               static_cast<std::uint64_t>(camera.height_px()) +
           (1 << 18);
  }
  stereo::DepthEstimate Estimate(std::span<const stereo::StereoView> views, int reference,
                                 std::span<const int> /*neighbours*/,
                                 const stereo::DepthRange& /*range*/,
                                 const stereo::EngineOptions& /*options*/) const override {
    const stereo::StereoView& view = views[static_cast<size_t>(reference)];
    const int width = view.camera.width_px(), height = view.camera.height_px();
    stereo::DepthEstimate estimate{DepthImage(width, height), Grid<float>(width, height)};
    if (view.prior == nullptr) return estimate;
    estimate.depth = OnGrid(view.prior->load(), view.camera);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        float& z = estimate.depth(x, y);
        if (view.mask != nullptr && !view.mask->empty() && (*view.mask)(x, y) == 0) z = 0;
        if (DepthImage::IsHole(z)) continue;
        estimate.inverse_depth_sigma(x, y) = static_cast<float>(view.prior->noise.At(z) / z);
      }
    }
    return estimate;
  }
};

}  // namespace

std::unique_ptr<stereo::Engine> MakePriorEngine() { return std::make_unique<PriorEngine>(); }

}  // namespace dtr::pipeline
