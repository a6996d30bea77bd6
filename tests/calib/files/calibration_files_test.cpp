#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>

#include "calib/colmap/model_io.h"
#include "calib/files/calibration.h"
#include "calib/files/opencv_yaml.h"
#include "calib/lens_map.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "tests/calib/solve/synthetic_views.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"

namespace dtr::calib {
namespace {

using testing::ExactViews;
using testing::kBoard;
using testing::TypicalCamera;
constexpr double kSamePixelPx = 1e-9;  // the same formula in double; half a pixel is 5e8 of it

Calibration Example(BoardModel model) {
  const LensCamera camera = TypicalCamera(model);
  const auto exact = ExactViews(camera, 3, 4);
  Calibration calibration;
  calibration.board = kBoard;
  const int n = FreeParameterCount(model);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Constant(n, n, 1.0 / 3);
  covariance.diagonal().array() += 1.0 / 7;
  calibration.cameras.push_back({"left", model, camera, covariance, 0.187, 0.13});
  for (size_t i = 0; i < exact.views.size(); ++i) {
    calibration.views.push_back({exact.views[i], 0, 2 * i, exact.cam_from_board[i], {3, 8}});
  }
  calibration.views[0].seen.noise_px = std::nan("");
  calibration.views[1].seen.rotation = PhotoRotation::kCounterclockwise;
  calibration.left_out.push_back({"blurred.jpg", "expected the whole board"});
  calibration.models.push_back({model, true, 0.2, -0.01, 0.02, ""});
  calibration.models.push_back({BoardModel::kBrown8, false, {}, 0, 0, "folds back"});
  return calibration;
}

TEST(CalibrationFile, EverythingSurvivesWritingAndReading) {
  const dtr::testing::TemporaryFolder folder;
  for (const BoardModel model : kBoardModels) {
    const Calibration written = Example(model);
    WriteCalibration(folder / "calib.json", written);
    const Calibration read = ReadCalibration(folder / "calib.json");
    EXPECT_EQ(read.board, written.board);
    ASSERT_EQ(read.cameras.size(), 1u);
    EXPECT_EQ(read.cameras[0].name, "left");
    EXPECT_EQ(read.cameras[0].model, model);
    EXPECT_EQ(read.cameras[0].camera.params, written.cameras[0].camera.params);
    EXPECT_EQ(read.cameras[0].covariance, written.cameras[0].covariance);
    EXPECT_EQ(read.cameras[0].sigma_px, 0.13);
    ASSERT_EQ(read.views.size(), 3u);
    EXPECT_TRUE(std::isnan(read.views[0].seen.noise_px));
    for (size_t i = 0; i < read.views.size(); ++i) {
      EXPECT_EQ(read.views[i].outliers, written.views[i].outliers);
      EXPECT_EQ(read.views[i].frame, 2 * i);
      EXPECT_EQ(read.views[i].seen.rotation, written.views[i].seen.rotation);
      EXPECT_LT(
          (read.views[i].cam_from_board.translation - written.views[i].cam_from_board.translation)
              .norm(),
          1e-15);
      EXPECT_LT(read.views[i].cam_from_board.rotation.angularDistance(
                    written.views[i].cam_from_board.rotation),
                1e-14);
      ASSERT_EQ(read.views[i].seen.corners.size(), 54u);
      EXPECT_EQ(read.views[i].seen.corners[7].pixel, written.views[i].seen.corners[7].pixel);
    }
    EXPECT_EQ(read.left_out[0].reason, "expected the whole board");
    EXPECT_EQ(read.models[0].held_out_rms_px, 0.2);
    EXPECT_EQ(read.models[1].refused, "folds back");
    EXPECT_FALSE(read.models[1].held_out_rms_px);
  }
}

TEST(CalibrationFile, ARigSurvivesToo) {
  const dtr::testing::TemporaryFolder folder;
  Calibration written = Example(BoardModel::kBrown4);
  written.lenses_given = true;
  written.cameras[0].covariance.setZero();
  written.cameras.push_back(written.cameras[0]);
  written.cameras[1].name = "right";
  written.cameras[1].cam_from_rig = written.views[0].cam_from_board;
  written.cameras[1].place_covariance = 2 * Eigen::MatrixXd::Identity(6, 6);
  written.cameras[1].delay = KeptDelay{-0.7071, 0.012, true};
  written.views[1].camera = 1;
  WriteCalibration(folder / "rig.json", written);
  const Calibration read = ReadCalibration(folder / "rig.json");
  EXPECT_TRUE(read.lenses_given);
  ASSERT_EQ(read.cameras.size(), 2u);
  EXPECT_EQ(read.cameras[0].place_covariance.size(), 0);
  EXPECT_EQ(read.cameras[1].place_covariance, written.cameras[1].place_covariance);
  EXPECT_EQ(read.cameras[1].cam_from_rig.translation, written.cameras[1].cam_from_rig.translation);
  EXPECT_TRUE(read.cameras[0].covariance.isZero(0));
  EXPECT_FALSE(read.cameras[0].delay);
  ASSERT_TRUE(read.cameras[1].delay);
  EXPECT_EQ(read.cameras[1].delay->frames, -0.7071);
  EXPECT_EQ(read.cameras[1].delay->sigma, 0.012);
  EXPECT_TRUE(read.cameras[1].delay->corners_moved);
}

TEST(CalibrationFile, EveryPrefixIsAnError) {
  const dtr::testing::TemporaryFolder folder;
  WriteCalibration(folder / "calib.json", Example(BoardModel::kBrown4));
  // The file ends in "}\n": the line break alone may go.
  const std::string whole = ReadFile(folder / "calib.json", 1 << 20);
  WriteFileAtomically(folder / "calib.json", whole.substr(0, whole.size() - 1));
  dtr::testing::ExpectEveryPrefixIsAnError(folder / "calib.json", 97,
                                           [&] { ReadCalibration(folder / "calib.json"); });
}

TEST(CalibrationFile, WrongFieldsAreNamed) {
  const dtr::testing::TemporaryFolder folder;
  const auto file = folder / "calib.json";
  WriteCalibration(file, Example(BoardModel::kBrown4));
  const std::string good = ReadFile(file, 1 << 20);
  const std::tuple<const char*, const char*, const char*> spoiled[] = {
      {"\"dtr-calibration\"", "\"other\"", "format"},
      {"\"version\": 1", "\"version\": 2", "version"},
      {"chessboard:9x6", "chessboard:9x99999", "board"},
      {"\"brown4\"", "\"brown6\"", "model"},
      {"\"fx_px\": ", "\"fx_px\": -", "focal"},
      {"\"width_px\": 640", "\"width_px\": 2000000000", "width_px"},
      {"\"sigma_px\": 0.13", "\"sigma_px\": 0", "sigma_px"},
      {"[0.476", "[-0.476", "covariance"},
      {"\"camera\": 0", "\"camera\": 7", "camera"},
      {"[0, ", "[54, ", "corners"},
      {"[1, ", "[0, ", "corners"},
      {"\"outliers\": [3, 8]", "\"outliers\": [8, 3]", "outliers"},
      {"\"outliers\": [3, 8]", "\"outliers\": [3, 800]", "outliers"},
      {"\"outliers\": [3, 8]", "\"outliers\": 5", "outliers"},
      {"\"photo_rotation_deg\": 270", "\"photo_rotation_deg\": 180", "photo_rotation_deg"}};
  for (const auto& [from, to, named] : spoiled) {
    const size_t at = good.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    std::string bad = good;
    WriteFileAtomically(file, bad.replace(at, std::string(from).size(), to));
    try {
      ReadCalibration(file);
      ADD_FAILURE() << "read: " << to;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(named)) << to;
    }
  }
}

// Points in front of the camera, some far off the axis.
std::vector<cv::Point3d> Points() {
  std::vector<cv::Point3d> points;
  for (double x = -0.5; x <= 0.5; x += 0.25) {
    for (double y = -0.4; y <= 0.4; y += 0.2) points.emplace_back(x, y, 1.0);
  }
  return points;
}

TEST(OpenCvYaml, OpenCvReadsItAndProjectsToTheSamePixels) {
  const dtr::testing::TemporaryFolder folder;
  for (const BoardModel model : kBoardModels) {
    const LensCamera camera = TypicalCamera(model);
    WriteOpenCvYaml(folder / "camera.yml", camera);
    cv::FileStorage storage((folder / "camera.yml").string(), cv::FileStorage::READ);
    cv::Mat k, distortion;
    storage["camera_matrix"] >> k;
    storage["distortion_coefficients"] >> distortion;
    ASSERT_EQ(static_cast<int>(storage["image_width"]), 640);
    const auto points = Points();
    std::vector<cv::Point2d> pixels;
    const cv::Vec3d zero(0, 0, 0);
    if (model == BoardModel::kFisheye) {
      ASSERT_EQ(static_cast<int>(storage["fisheye_model"]), 1);
      cv::fisheye::projectPoints(points, pixels, zero, zero, k, distortion);
    } else {
      cv::projectPoints(points, zero, zero, k, distortion, pixels);
    }
    for (size_t i = 0; i < points.size(); ++i) {
      const auto ours = camera.PixelFromCam({points[i].x, points[i].y, points[i].z});
      ASSERT_TRUE(ours);
      // OpenCV has the centre of the first pixel at (0, 0), we at (0.5, 0.5).
      EXPECT_NEAR(pixels[i].x + 0.5, ours->x(), kSamePixelPx) << NameOf(model);
      EXPECT_NEAR(pixels[i].y + 0.5, ours->y(), kSamePixelPx) << NameOf(model);
    }
  }
}

TEST(OpenCvYaml, AStereoFileProjectsToTheSamePixelsInBothCameras) {
  const dtr::testing::TemporaryFolder folder;
  const std::string file = (folder / "rig.yml").string();
  Pose second_from_first;
  second_from_first.rotation = Eigen::AngleAxisd(0.1, Eigen::Vector3d(0.2, 1, -0.3).normalized());
  second_from_first.translation = {-0.2, 0.01, 0.03};
  for (const BoardModel model : kBoardModels) {
    const LensCamera first = TypicalCamera(model);
    LensCamera second = first;
    second.params[0] *= 1.1;
    WriteOpenCvStereoYaml(file, first, second, second_from_first);
    cv::FileStorage storage(file, cv::FileStorage::READ);
    cv::Mat k[2], d[2], r, t, turn;
    storage["M1"] >> k[0];
    storage["D1"] >> d[0];
    storage["M2"] >> k[1];
    storage["D2"] >> d[1];
    storage["R"] >> r;
    storage["T"] >> t;
    ASSERT_EQ(static_cast<int>(storage["image_width"]), 640);
    ASSERT_EQ(static_cast<int>(storage["image_height"]), 480);
    const bool fisheye = model == BoardModel::kFisheye;
    ASSERT_EQ(static_cast<int>(storage["fisheye_model"]), fisheye ? 1 : 0);
    cv::Rodrigues(r, turn);
    const auto points = Points();
    for (int c = 0; c < 2; ++c) {
      const cv::Mat none = cv::Mat::zeros(3, 1, CV_64F);
      const cv::Mat &rotation = c == 0 ? none : turn, &shift = c == 0 ? none : t;
      std::vector<cv::Point2d> pixels;
      if (fisheye) {
        cv::fisheye::projectPoints(points, pixels, rotation, shift, k[c], d[c]);
      } else {
        cv::projectPoints(points, rotation, shift, k[c], d[c], pixels);
      }
      for (size_t i = 0; i < points.size(); ++i) {
        const Eigen::Vector3d p(points[i].x, points[i].y, points[i].z);
        const auto ours =
            c == 0 ? first.PixelFromCam(p) : second.PixelFromCam(second_from_first * p);
        ASSERT_TRUE(ours);
        EXPECT_NEAR(pixels[i].x + 0.5, ours->x(), kSamePixelPx) << NameOf(model) << c;
        EXPECT_NEAR(pixels[i].y + 0.5, ours->y(), kSamePixelPx) << NameOf(model) << c;
      }
    }
  }
}

TEST(OpenCvYaml, AStereoFileOfTwoSizesOrKindsIsRejected) {
  const dtr::testing::TemporaryFolder folder;
  const LensCamera pinhole = TypicalCamera(BoardModel::kBrown4);
  LensCamera larger = pinhole;
  larger.width_px = 1280;
  const auto refused = [&](const LensCamera& second, const char* words) {
    EXPECT_THAT([&] { WriteOpenCvStereoYaml(folder / "rig.yml", pinhole, second, {}); },
                ::testing::ThrowsMessage<Error>(::testing::HasSubstr(words)));
    EXPECT_FALSE(std::filesystem::exists(folder / "rig.yml"));
  };
  refused(larger,
          "expected two cameras of one size, as OpenCV's stereo files have it, found "
          "640x480 and 1280x480");
  refused(TypicalCamera(BoardModel::kFisheye), "expected two fisheyes or none");
}

TEST(OpenCvYaml, WhatOpenCvWritesIsReadToTheSamePixels) {
  const dtr::testing::TemporaryFolder folder;
  const std::string file = (folder / "camera.yml").string();
  const cv::Matx33d k(530, 0, 321.5, 0, 532, 235.5, 0, 0, 1);
  for (const int count : {4, 5, 8, 14}) {
    cv::Mat distortion = cv::Mat::zeros(1, count, CV_64F);
    const double values[] = {-0.28, 0.08, 1e-3, -5e-4, 0.03, 0.01, 0.02, 0.003};
    for (int i = 0; i < std::min(count, 8); ++i) distortion.at<double>(i) = values[i];
    {
      cv::FileStorage storage(file, cv::FileStorage::WRITE);
      storage << "calibration_time"
              << "Sat 21 Nov 2026 10:00:00"
              << "nframes" << 13 << "image_width" << 640 << "image_height" << 480 << "camera_matrix"
              << cv::Mat(k) << "distortion_coefficients" << distortion << "avg_reprojection_error"
              << 0.19;
    }
    const LensCamera camera = ReadOpenCvYaml(file);
    const auto points = Points();
    std::vector<cv::Point2d> pixels;
    const cv::Vec3d zero(0, 0, 0);
    cv::projectPoints(points, zero, zero, k, distortion, pixels);
    for (size_t i = 0; i < points.size(); ++i) {
      const auto ours = camera.PixelFromCam({points[i].x, points[i].y, points[i].z});
      ASSERT_TRUE(ours);
      EXPECT_NEAR(pixels[i].x + 0.5, ours->x(), kSamePixelPx) << count;
      EXPECT_NEAR(pixels[i].y + 0.5, ours->y(), kSamePixelPx) << count;
    }
  }
}

TEST(OpenCvYaml, RosFilesAreRead) {
  const dtr::testing::TemporaryFolder folder;
  WriteFileAtomically(folder / "ros.yaml",
                      "image_width: 640\nimage_height: 480\ncamera_name: left\n"
                      "camera_matrix:\n  rows: 3\n  cols: 3\n"
                      "  data: [530., 0, 321.5, 0, 532, 235.5,\n         0, 0, 1]\n"
                      "distortion_model: equidistant\n"
                      "distortion_coefficients:\n  rows: 1\n  cols: 4\n  data: [0.1, 0, 0, 0]\n");
  const LensCamera camera = ReadOpenCvYaml(folder / "ros.yaml");
  EXPECT_EQ(camera.model, CameraModel::kOpenCvFisheye);
  EXPECT_EQ(camera.params, (std::vector<double>{530, 532, 322, 236, 0.1, 0, 0, 0}));
}

TEST(OpenCvYaml, WhatIsNoCameraIsAnError) {
  const dtr::testing::TemporaryFolder folder;
  const auto file = folder / "camera.yml";
  WriteOpenCvYaml(file, TypicalCamera(BoardModel::kBrown5));
  const std::string good = ReadFile(file, 1 << 16);
  // Whole but for blanks after the last bracket.
  WriteFileAtomically(file, good.substr(0, good.rfind(']') + 1));
  dtr::testing::ExpectEveryPrefixIsAnError(file, 1, [&] { ReadOpenCvYaml(file); });
  const std::pair<const char*, const char*> spoiled[] = {{"image_width: 640", "image_width: 0"},
                                                         {"image_width: 640", "image_width: 1e300"},
                                                         {"[ 530", "[ -530"},
                                                         {"[ 530, 0", "[ 530, 0.1"},
                                                         {"[ 530", "[ nan"},
                                                         {"[ -0.28", "[ -0.28, 1e999"},
                                                         {"camera_matrix", "matrix"},
                                                         {"[ -0.28, 0.08", "[ -0.28, , 0.08"}};
  for (const auto& [from, to] : spoiled) {
    std::string bad = good;
    const size_t at = bad.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    WriteFileAtomically(file, bad.replace(at, std::string(from).size(), to));
    EXPECT_THROW(ReadOpenCvYaml(file), Error) << to;
  }
}

// A camera as FileStorage writes it, with other names of its fields.
void WriteStorage(const std::string& file, const char* k_name, const char* d_name) {
  cv::FileStorage storage(file, cv::FileStorage::WRITE);
  storage << "image_width" << 640 << "image_height" << 480 << k_name
          << cv::Mat(cv::Matx33d(530, 0, 321.5, 0, 532, 235.5, 0, 0, 1)) << d_name
          << cv::Mat(cv::Matx14d(-0.28, 0.08, 1e-3, -5e-4));
}

TEST(OpenCvYaml, OtherNamesOfTheMatricesAndXmlGiveTheSameCamera) {
  const dtr::testing::TemporaryFolder folder;
  const std::vector<double> params = {530, 532, 322, 236, -0.28, 0.08, 1e-3, -5e-4};
  for (const auto& [k, d] : {std::pair("camera_matrix", "distortion_coefficients"),
                             std::pair("cameraMatrix", "distCoeffs"),
                             std::pair("Camera_Matrix", "Distortion_Coefficients"),
                             std::pair("K", "D"), std::pair("mtx", "dist")}) {
    for (const char* name : {"a.yml", "a.xml"}) {
      WriteStorage((folder / name).string(), k, d);
      const LensCamera camera = ReadOpenCvYaml(folder / name);
      EXPECT_EQ(camera.model, CameraModel::kOpenCv) << k << name;
      EXPECT_EQ(camera.params, params) << k << name;
      EXPECT_EQ(camera.width_px, 640);
      EXPECT_EQ(camera.height_px, 480);
    }
  }
}

TEST(OpenCvYaml, TheSizeMayBeOnePairAndMatricesLists) {
  const dtr::testing::TemporaryFolder folder;
  WriteFileAtomically(folder / "a.yml",
                      "image_size: [640, 480]\nK: [[530.0, 0, 321.5], [0, 532, 235.5], [0, 0, 1]]\n"
                      "dist: [[-0.28, 0.08, 0.001, -0.0005]]\n");
  EXPECT_EQ(ReadOpenCvYaml(folder / "a.yml").params,
            (std::vector<double>{530, 532, 322, 236, -0.28, 0.08, 1e-3, -5e-4}));
}

TEST(OpenCvYaml, WhatMayBeMeantTwiceOrNotAtAllIsSaidWithTheNames) {
  const dtr::testing::TemporaryFolder folder;
  const auto error = [&](const std::string& text, const char* name = "a.yml") -> std::string {
    WriteFileAtomically(folder / name, text);
    try {
      ReadOpenCvYaml(folder / name);
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  };
  const auto has = [](const char* words) { return ::testing::HasSubstr(words); };
  EXPECT_THAT(error("K: [1]\nmtx: [1]\n"), has("K and mtx may both be the camera matrix"));
  EXPECT_THAT(error("a: 1\nb: 2\n"), has("looked for camera_matrix, K, mtx"));
  EXPECT_THAT(error("a: 1\nb: 2\n"), has("the file has a, b; write image_width"));
  EXPECT_THAT(error("cam0:\n  intrinsics: [1, 2, 3, 4]\n"), has("camera chain of Kalibr"));
  EXPECT_THAT(error("Camera1.fx: 420\n"), has("settings of ORB-SLAM"));
  EXPECT_THAT(error("M1: [1]\nM2: [1]\n"), has("two cameras of a stereo pair"));
  EXPECT_THAT(error("<?xml version=\"1.0\"?>\n<html></html>"), has("found other XML"));
  EXPECT_THAT(error("<opencv_storage><K>1</K><K>2</K></opencv_storage>"), has("'K' stands twice"));
  WriteStorage((folder / "a.xml").string(), "K", "D");
  const std::string good = ReadFile(folder / "a.xml", 1 << 16);
  WriteFileAtomically(folder / "b.xml", good.substr(0, good.rfind('>') + 1));
  dtr::testing::ExpectEveryPrefixIsAnError(folder / "b.xml", 1,
                                           [&] { ReadOpenCvYaml(folder / "b.xml"); });
}

TEST(OpenCvYaml, FilesOfOtherProgramsAreReadOrNamed) {
  const auto folder = dtr::testing::DataFolder() / "field/lens_files";
  DTR_REQUIRE_DATA(folder);
  for (const char* name : {"K_D.yml", "cameraMatrix.yml", "Camera_Matrix.yml", "mtx.xml"}) {
    const LensCamera camera = ReadOpenCvYaml(folder / name);
    EXPECT_EQ(camera.params,
              (std::vector<double>{420, 420, 240, 180, 0.0015, 0.0004, -3e-5, 0.0004, 0, 0, 0, 0}))
        << name;
  }
  for (const auto& [name, words] :
       {std::pair("kalibr-camchain.yaml", "Kalibr"), std::pair("orbslam.yaml", "ORB-SLAM")}) {
    const auto file = folder / name;
    EXPECT_THAT([&] { ReadOpenCvYaml(file); },
                ::testing::ThrowsMessage<Error>(::testing::HasSubstr(words)));
  }
}

TEST(OpenCvYaml, WhatIsFoundIsSaidInOneLine) {
  const dtr::testing::TemporaryFolder folder;
  const auto file = folder / "camera.yml";
  WriteFileAtomically(file, "image_width: 640\n  and more\nimage_height: 480\nK: [1]\nD: [1]\n");
  try {
    ReadOpenCvYaml(file);
    ADD_FAILURE() << "read";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("found '640 and more'"));
  }
}

TEST(ColmapCameras, SurviveWritingAndReading) {
  const dtr::testing::TemporaryFolder folder;
  std::map<std::uint32_t, LensCamera> cameras;
  for (const BoardModel model : kBoardModels) {
    cameras.emplace(static_cast<std::uint32_t>(cameras.size() + 1), TypicalCamera(model));
  }
  colmap::WriteCamerasText(folder / "cameras.txt", cameras);
  const auto read = colmap::ReadCamerasText(folder / "cameras.txt");
  ASSERT_EQ(read.size(), cameras.size());
  for (const auto& [id, camera] : cameras) {
    EXPECT_EQ(read.at(id).model, camera.model);
    EXPECT_EQ(read.at(id).params, camera.params);
    // COLMAP counts from the outer corner of the first pixel as we do: no shift.
    EXPECT_EQ(read.at(id).params[2], camera.params[2]);
  }
}

}  // namespace
}  // namespace dtr::calib
