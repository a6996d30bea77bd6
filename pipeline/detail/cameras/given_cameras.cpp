#include "pipeline/detail/cameras/given_cameras.h"

#include <fmt/format.h>

#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/io/json_fields.h"

namespace dtr::pipeline {
namespace {

// Photos that are matched without belief in their cameras: all of few, else neighbours by name, who
// most likely overlap, from the beginning, the middle and the end.
constexpr size_t kMaxMatchedPhotos = 18, kRuns = 3;

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

std::vector<colmap::PosedImage> ByName(std::vector<colmap::PosedImage> images) {
  std::sort(images.begin(), images.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  return images;
}

std::vector<calib::GivenCamera> CamerasOf(const std::vector<colmap::PosedImage>& images) {
  std::vector<calib::GivenCamera> cameras;
  for (const colmap::PosedImage& image : images) {
    cameras.push_back({image.name, image.camera, image.cam_from_world});
  }
  return cameras;
}

calib::ConventionReport TestAlone(const GivenPhotos& given,
                                  const std::vector<colmap::PosedImage>& images,
                                  Progress& progress) {
  const std::vector<size_t> some = SomeOf(images.size());
  std::vector<colmap::PosedImage> matched;
  for (const size_t i : some) matched.push_back(images[i]);
  progress.Note("the given cameras do not fit what the photos show; matching photos without them");
  std::vector<calib::MatchedPair> pairs = colmap::MatchWithoutCameras(
      given.workspace / "photos", matched, given.workspace / "conventions", given.sfm, progress);
  for (calib::MatchedPair& pair : pairs) {
    pair.a = static_cast<int>(some[static_cast<size_t>(pair.a)]);
    pair.b = static_cast<int>(some[static_cast<size_t>(pair.b)]);
  }
  return calib::TestConventions(CamerasOf(images), pairs);
}

bool AreDoubtful(const calib::ConventionReport& report) {
  return !report.tested() || report.given_px > report.limit_px;
}

}  // namespace

TriangulatedCameras TriangulateAndTest(const GivenPhotos& given, Progress& progress) {
  const std::vector<colmap::PosedImage> images = ByName(given.images);
  TriangulatedCameras out;
  try {
    colmap::SfmResult sfm = colmap::TriangulateWithPoses(
        given.workspace / "photos", images, given.workspace / "sfm", given.sfm, progress);
    out.conventions = calib::TestConventions(CamerasOf(images), sfm.matches);
    out.model = std::move(sfm.model);
  } catch (const Interrupted&) {
    throw;
  } catch (const UsageError&) {
    throw;
  } catch (const Error& error) {
    if (given.sfm.part) throw;  // what a part lacks says nothing of the cameras
    const calib::ConventionReport report = TestAlone(given, images, progress);
    if (report.found.empty()) throw;
    throw Error(std::string(error.what()) + "; " + calib::LineOf(report, given.file));
  }
  // COLMAP's matches are its own affair; its triangulation is tested by the set's points.
  const bool by_colmap = given.sfm.engine == colmap::SfmEngine::kColmap;
  if (!by_colmap && AreDoubtful(out.conventions)) {
    out.conventions = TestAlone(given, images, progress);
  }
  if (const std::string line = calib::LineOf(out.conventions, given.file); !line.empty()) {
    progress.Note(line);
  }
  return out;
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
