// calib/sfm/run/sfm.h -- structure from motion by calib/sfm and the `colmap` program.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/matched_pair.h"
#include "calib/sfm_model.h"
#include "dtr/base/part.h"
#include "dtr/base/progress.h"

namespace dtr::sfm {

class ColmapSteps;  // colmap_steps.h

/// A photo to be calibrated: `images_dir / name`, upright (EXIF orientation already applied).
struct SfmImageInput {
  std::string name;
  int width_px = 0, height_px = 0;
  std::optional<double> focal_prior_px;  ///< empty: COLMAP's own guess from EXIF, else 1.2 w
  std::string camera_group = {};         ///< photos of one group and size share intrinsics
  std::filesystem::path mask_file = {};  ///< no features where this image is black; empty: none
  /// Photos of one station (views of a panorama) were taken from one point: without parallax they
  /// tell nothing of each other, and are not matched. Empty: of none.
  std::string station = {};
  Eigen::Matrix3d cam_from_station = Eigen::Matrix3d::Identity();  ///< of images with a station
  /// The camera, where it is known, of the photo's size: all photos of a group have the same.
  std::optional<calib::LensCamera> known_lens = {};
};

/// Which pairs of photos are matched in full.
enum class Matching {
  kAuto,         ///< exhaustive up to kExhaustiveLimit photos, preselected beyond
  kExhaustive,   ///< every pair
  kPreselected,  ///< pairs whose largest features match (calib/sfm/matching/pair_choice.h)
  kSequential,   ///< neighbours in the order of names: video
};

/// What finds features, matches and the first cameras.
enum class SfmEngine {
  kColmap,  ///< the `colmap` program alone
  kGlobal,  ///< calib/sfm alone: features, matches and the global mapper
  /// calib/sfm; where its model does not pass or leaves photos out, and COLMAP is installed,
  /// COLMAP's mapper works on the same matches, and the better of both models is taken
  kAuto,
};
/// "colmap", "global", "auto".
const char* NameOf(SfmEngine engine);

/// What calib/sfm calls itself in records; counts up when its results change.
inline constexpr char kOwnVersion[] = "dtr global structure from motion 1";

/// At 60 photos every pair (1770) takes some 15 minutes on 2 cores; the cost grows with the square.
inline constexpr int kExhaustiveLimit = 60;

/// COLMAP's own limit, which MatchingThreads (matching.h) counts on.
inline constexpr int kMaxFeatures = 8192;

/// What calib/sfm finds in a photo at most: COLMAP counts whole levels of scale, so that its limit
/// gives 8000 to 15000. The smallest features are the most precise: with 8192 of them the
/// rotations of fountain were 0.044 degrees off, with these 0.034 (docs/accuracy/CAMERAS.md).
inline constexpr int kMaxOwnFeatures = 14000;

/// The features of a photo that an engine takes at most.
constexpr int MaxFeaturesOf(SfmEngine engine) {
  return engine == SfmEngine::kColmap ? kMaxFeatures : kMaxOwnFeatures;
}

/// A stage of structure from motion by calib/sfm that several processes share, each with a part.
enum class SfmStage {
  kPhotos,        ///< the folder, with links to the photos; one process
  kFeatures,      ///< of a part of the photos
  kPairs,         ///< all features in one database, and which pairs are matched; one process
  kMatching,      ///< the largest features of a part of the pairs
  kVerification,  ///< relative poses and all features of a part of the pairs
};
struct SfmPart {
  SfmStage stage = SfmStage::kPhotos;
  Part part;
};

struct SfmOptions {
  const ColmapSteps* colmap = nullptr;  ///< needed with every engine: models have its format
  SfmEngine engine = SfmEngine::kAuto;
  Matching matching = Matching::kAuto;
  std::uint64_t seed = 0;     ///< of COLMAP's random choices, as far as it heeds it
  double memory_gb = 4;       ///< COLMAP stays below this many GB (1e9 bytes)
  int max_image_size_px = 0;  ///< long side for features; 0: from the memory
  int max_features = 0;       ///< max per photo, the largest; 0: kMaxFeatures, or kMaxOwnFeatures
  /// COLMAP's name. On the 11 photos of Sceaux castle (a compact camera), 8900 points each, the
  /// mean reprojection error is 0.613 px with SIMPLE_RADIAL, 0.532 with RADIAL, 0.522 with OPENCV,
  /// whose fx and fy then differ by 0.8 %: more freedom than a sensor of square pixels has.
  std::string lens_model = "RADIAL";
  bool share_intrinsics_within_group = true;
  /// Known lenses are exact and hold, or else the priors are, with no distortion (views made of
  /// panoramas): in matching, votes and mapping.
  bool intrinsics_are_known = false;
  /// Other processes work in the folder, which one that was alone has made: nothing of theirs is
  /// touched, and photos that have their size and time count as what they were.
  bool folder_is_shared = false;
};

/// "auto", "exhaustive", "preselected", "sequential".
const char* NameOf(Matching matching);

/// One run of the program: what was asked, how it ended, what it cost.
struct StepRecord {
  std::string name;               ///< "features", "matches", "mapping", ...
  std::vector<std::string> argv;  ///< as executed, no shell; empty: work of this program
  int exit_code = 0, signal = 0;
  double wall_s = 0, cpu_s = 0;
  long max_rss_kib = 0;
  std::filesystem::path log_file;
  bool from_checkpoint = false;  ///< run by an earlier call, whose figures these are
};

struct SfmReport {
  std::string version;  ///< COLMAP's first line about itself, or kOwnVersion
  std::vector<StepRecord> steps;
  Matching matching = Matching::kAuto;  ///< the one used
  int extraction_threads = 0;           ///< features.h: bounded by the memory
  int max_image_size_px = 0;
  std::vector<std::string> not_registered;                ///< names without a pose, sorted
  std::map<std::string, std::string> why_not_registered;  ///< a clause each, by name, from RunSfm
  std::vector<int> images_per_model;  ///< models COLMAP made, largest first; [0] was taken
  /// Half of the matched pairs or more show no parallax: a sentence with counts and what helps.
  std::string lack_of_parallax;
  /// Mapped with focal lengths of EXIF and no distortion, fixed: with free ones COLMAP made no
  /// model.
  bool fixed_intrinsics = false;
  bool forward_motion = false;  ///< mapped with the thresholds of a walk straight ahead
  /// Why the cameras are not sure, and what helps, as a clause; empty where tests pass.
  std::string doubt;
  double mean_reprojection_error_px = 0;  ///< over all observations, recomputed
};

struct SfmResult {
  calib::SfmModel model;
  SfmReport report;
  /// Of TriangulateWithPoses by calib/sfm: what was matched, whether or not the poses explain it;
  /// indices into model.images.
  std::vector<calib::MatchedPair> matches = {};
};

/// Features, matching and mapping in `workspace` (made when absent), on the CPU, headless.
/// The workspace keeps per step the arguments, log, exit code and cost (sfm_run.json, logs/), the
/// database and the frozen result (model/, COLMAP binary, original names). A second call with the
/// same photos (by content), options and COLMAP version returns the frozen result; an interrupted
/// one goes on after its last finished step. From scratch COLMAP is not repeatable:
/// two runs of 3.8 with one thread and one seed gave 1339 and 1371 points of the same four photos.
///
/// Throws UsageError on inputs that cannot be meant (fewer than two photos, names twice, an unknown
/// lens model), Interrupted when asked to stop (the program is ended), Error when COLMAP is
/// missing, fails (naming step, cause and log) or makes no model. With `part` (of kGlobal and
/// kAuto) only this is done and the result is empty; a call without one goes on with all of them.
SfmResult RunSfm(const std::filesystem::path& images_dir, std::span<const SfmImageInput> images,
                 const std::filesystem::path& workspace, const SfmOptions& options,
                 Progress& progress, const std::optional<SfmPart>& part = {});

/// Where RunSfm of the same arguments has finished, maps its matches again with focal lengths fixed
/// at the priors and no distortion, in `workspace`/fixed, with checkpoints as RunSfm's. Empty where
/// COLMAP makes no model so, or a photo has no prior. Throws as RunSfm does.
std::optional<SfmResult> MapWithFixedIntrinsics(const std::filesystem::path& images_dir,
                                                std::span<const SfmImageInput> images,
                                                const std::filesystem::path& workspace,
                                                const SfmOptions& options, Progress& progress);
/// The folder of its model in the workspace.
inline constexpr char kFixedModel[] = "fixed/model";

/// Where RunSfm of the same arguments has finished: a model of the photos with these cameras and
/// poses (by name; others are left out), unchanged, and all points that its matches then determine
/// (sfm/mapping/triangulate.h). `lens`: of all photos. Throws as RunSfm does, and Error where the
/// matches contradict it (sfm/mapping/model_check.h).
calib::SfmModel PointsOfMatches(const std::filesystem::path& images_dir,
                                std::span<const SfmImageInput> images,
                                const std::filesystem::path& workspace, const SfmOptions& options,
                                const calib::LensCamera& lens,
                                const std::map<std::string, Pose>& cam_from_world,
                                Progress& progress);

/// Mean distance (px) between features and their points' projections; 0 without observations.
double MeanReprojectionErrorPx(const calib::SfmModel& model);

}  // namespace dtr::sfm
