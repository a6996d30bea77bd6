// Calibrations, captures, and what a run keeps between its stages.
#include <nlohmann/json.hpp>

#include "calib/files/calibration.h"
#include "calib/files/opencv_yaml.h"
#include "calib/files/summary_json.h"
#include "calib/models/board_model.h"
#include "capture/capture_json.h"
#include "capture/photo.h"
#include "datasets/make.h"
#include "dtr/base/files.h"
#include "pipeline/core/depth/grid_files.h"
#include "tests/calib/solve/synthetic_views.h"
#include "tests/fuzz/readers.h"

namespace dtr::fuzz {
namespace {

namespace fs = std::filesystem;
constexpr std::uintmax_t kSeedLimitBytes = 1 << 20;

calib::Calibration SomeCalibration(calib::BoardModel model) {
  const calib::LensCamera camera = calib::testing::TypicalCamera(model);
  calib::Board board = calib::testing::kBoard;
  const auto exact = calib::testing::ExactViews(camera, 2, 4, 40, board);
  calib::Calibration calibration;
  calibration.board = board;
  const int n = calib::FreeParameterCount(model);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Constant(n, n, 1.0 / 3);
  covariance.diagonal().array() += 1.0 / 7;
  calibration.cameras.push_back({"left", model, camera, covariance, 0.187, 0.13});
  for (size_t i = 0; i < exact.views.size(); ++i) {
    calibration.views.push_back({exact.views[i], 0, 2 * i, exact.cam_from_board[i], {3, 8}});
  }
  calibration.left_out.push_back({"blurred.jpg", "expected the whole board"});
  calibration.models.push_back({model, true, 0.2, -0.01, 0.02, ""});
  return calibration;
}

Reader OpenCalibration(const fs::path& folder) {
  const fs::path file = folder / "calib.json";
  std::vector<std::string> seeds;
  for (const auto model : {calib::BoardModel::kBrown5, calib::BoardModel::kFisheye}) {
    calib::WriteCalibration(file, SomeCalibration(model));
    seeds.push_back(ReadFile(file, kSeedLimitBytes));
  }
  return {file, seeds, [=] { (void)calib::SummaryJson(calib::ReadCalibration(file)); }};
}

Reader OpenYaml(const fs::path& folder) {
  const fs::path file = folder / "camera.yml";
  std::vector<std::string> seeds;
  for (const auto model : {calib::BoardModel::kBrown5, calib::BoardModel::kFisheye}) {
    calib::WriteOpenCvYaml(file, calib::testing::TypicalCamera(model));
    seeds.push_back(ReadFile(file, kSeedLimitBytes));
  }
  seeds.push_back(  // as ROS writes it
      "image_width: 640\nimage_height: 480\ncamera_name: left\ncamera_matrix:\n  rows: 3\n  cols: "
      "3\n"
      "  data: [530, 0, 320, 0, 530, 240, 0, 0, 1]\ndistortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.3, 0.1, 0, 0, 0]\n");
  seeds.push_back(  // FileStorage as XML
      "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_size>640 480</image_size>\n"
      "<K type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt>\n"
      "<data>530. 0. 320. 0. 530. 240. 0. 0. 1.</data></K>\n"
      "<D type_id=\"opencv-matrix\"><data>-0.3 0.1 0. 0.</data></D>\n</opencv_storage>\n");
  return {file, seeds, [=] { calib::ReadOpenCvYaml(file); }};
}

Reader OpenCapture(const fs::path& folder) {
  const fs::path file = folder / "capture.json";
  capture::Capture capture;
  for (const char* id : {"a", "b"}) {
    capture::Photo photo;
    photo.id = id;
    photo.name = std::string("day one/") + id + ".JPG";
    photo.file = std::string("images/") + id + ".jpg";
    photo.width_px = 40;
    photo.height_px = 30;
    photo.focal_prior_px = 50;
    photo.focal_source = "exif-35mm";
    photo.camera_group = "maker|model|40x30|28";
    photo.date_time = "2026:01:02 03:04:05";
    photo.gps = io::GpsPosition{47.5, 8.5, 400.0};
    photo.source_sha256 = std::string(64, 'a');
    photo.screening =
        capture::Screening{0.5, 0.1, 0.2, "", {capture::Fault::kBlurred}, {"may be blurred"}, {}};
    photo.video_frame = capture::VideoFrame{"walk.mp4", 7, 0.28};
    photo.mask_file = std::string("masks/") + id + ".png";
    photo.mask_sha256 = std::string(64, 'b');
    capture.photos.push_back(photo);
  }
  capture.skipped.push_back({"notes.jpg", "no image"});
  return {file, {capture::CaptureToJson(capture)}, [=] {
            capture::CaptureFromJson(ReadFile(file, kSeedLimitBytes * 16), file.string());
          }};
}

Reader OpenGrids(const fs::path& folder) {
  const fs::path file = folder / "planes.bin";
  const Grid<float> grid(5, 4, 1, 1.5f);
  const Grid<float>* const grids[] = {&grid, &grid};
  pipeline::WriteGridFile(file, grids, 2.5);
  return {file, {ReadFile(file, kSeedLimitBytes)}, [=] {
            Grid<float> a, b;
            Grid<float>* const read[] = {&a, &b};
            pipeline::ReadGridFile(file, read);
          }};
}

Reader OpenDataset(const fs::path& folder) {
  const fs::path file = folder / "dataset.json";
  return {file, {datasets::FormatSpecJson({})}, [=] {
            datasets::ParseSpecJson(ReadFile(file, kSeedLimitBytes * 16), file.string());
          }};
}

constexpr ReaderKind kReaders[] = {
    {"calibration", OpenCalibration}, {"opencv-yaml", OpenYaml}, {"capture", OpenCapture},
    {"working-grids", OpenGrids},     {"dataset", OpenDataset},
};

}  // namespace

std::span<const ReaderKind> CalibReaders() { return kReaders; }

}  // namespace dtr::fuzz
