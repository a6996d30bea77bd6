// Cameras of other programs: each format recognised by its content, and every point where the
// program that wrote the file puts it.
#include "pipeline/core/cameras/camera_formats.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "calib/lens_map.h"
#include "calib/sparse_from_sfm.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/temporary_folder.h"
#include "dtr/io/image_io.h"
#include "pipeline/core/camera_file.h"
#include "pipeline/core/cameras/camera_distortion.h"
#include "pipeline/core/cameras/foreign_cameras.h"
#include "pipeline/import/detail/camera_files.h"
#include "tests/pipeline/source_programs.h"
#include "tests/support/message_of.h"
#include "tests/support/truncation.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using dtr::testing::Fault;
using dtr::testing::MessageOf;
using dtr::testing::SourceProgram;
using dtr::testing::TrueCapture;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kResidualPx = 1e-3;  // files have full doubles; the worst of all is near 1e-9

io::SizedImage PhotoOf(const std::string& name) {
  return {name, TrueCapture::kWidth, TrueCapture::kHeight};
}

PhotoNames NamesIn(const TrueCapture& capture) {
  std::vector<std::string> names;
  for (const auto& camera : capture.cameras) names.push_back(camera.name);
  names.push_back("off.jpg");
  names.push_back("lost.jpg");
  return PhotoNames(names);
}

PlacedCameras Placed(const SourceProgram& program, const TrueCapture& capture) {
  const CameraFormat format = FormatOf(program.file, "", "`cameras`");
  return PlaceCameras(format.read(program.file), program.file.string(), NamesIn(capture), PhotoOf);
}

// Largest distance between where our camera and the program put the points; infinite where one is
// not seen.
double LargestResidual(const SourceProgram& program, const TrueCapture& capture,
                       const io::CameraList& list) {
  std::map<std::string, const dtr::testing::TrueCamera*> truth;
  for (const auto& camera : capture.cameras) truth[camera.name] = &camera;
  double largest = list.cameras.size() == capture.cameras.size() ? 0 : INFINITY;
  for (const io::NamedCamera& named : list.cameras) {
    const calib::LensMap lens(CameraModelOf(named));
    for (const Eigen::Vector3d& p : capture.points) {
      const auto ours = lens.PixelFromCam(named.cam_from_world * (p - list.world_origin));
      const Eigen::Vector2d theirs = program.project(truth.at(named.name)->InCamera(p));
      largest = std::max(largest, ours ? (*ours - theirs).norm() : INFINITY);
    }
  }
  return largest;
}

TEST(CameraFormats, EveryPointIsWhereTheProgramPutsIt) {
  const TemporaryFolder folder;
  const TrueCapture capture;
  std::set<std::string> formats;
  for (const SourceProgram& program : WriteAllPrograms(capture, folder.path())) {
    SCOPED_TRACE(program.format + " " + program.variant);
    formats.insert(program.format);
    ASSERT_EQ(FormatOf(program.file, "", "`cameras`").name, program.format);
    const PlacedCameras placed = Placed(program, capture);
    EXPECT_LT(LargestResidual(program, capture, placed.list), kResidualPx);
    EXPECT_EQ(placed.model.has_value(), program.points);
  }
  EXPECT_EQ(formats.size(), 9u);
}

// What a reader could get wrong shows: in the file it moves points by more than the tolerance.
TEST(CameraFormats, HalfPixelsFlippedAxesAndSwappedTermsShow) {
  constexpr double kShows = 100 * kResidualPx;
  const TrueCapture capture;
  for (const Fault fault : {Fault::kHalfPixel, Fault::kFlippedAxis, Fault::kSwappedTangential}) {
    const TemporaryFolder folder;
    for (const SourceProgram& program : WriteAllPrograms(capture, folder.path(), fault)) {
      SCOPED_TRACE(program.format + " " + program.variant);
      const bool tangential = program.variant == "frame" || program.variant == "affine" ||
                              program.variant == "brown" || program.variant == "older" ||
                              program.variant == "pinhole_brown_t2" ||
                              program.variant == "opencv" || program.variant == "brown_11";
      const bool centred = program.format == "bundler" || program.format == "nvm" ||
                           program.variant == "perspective" ||
                           (program.format == "opensfm" && program.variant == "fisheye");
      if (fault == Fault::kSwappedTangential && !tangential) continue;
      if (fault == Fault::kHalfPixel && centred) continue;  // no principal point in the file
      if (fault == Fault::kFlippedAxis &&
          (program.format == "bundler" || program.format == "nvm")) {
        continue;  // their points say so (point_conventions_test.cpp)
      }
      EXPECT_GT(LargestResidual(program, capture, Placed(program, capture).list), kShows);
    }
  }
}

TEST(CameraFormats, PointsAndWhatPhotosShowOfThemAreThoseOfTheFile) {
  const TemporaryFolder folder;
  const TrueCapture capture;
  int with_points = 0;
  for (const SourceProgram& program : WriteAllPrograms(capture, folder.path())) {
    if (!program.points) continue;
    SCOPED_TRACE(program.format + " " + program.variant);
    ++with_points;
    const PlacedCameras placed = Placed(program, capture);
    ASSERT_TRUE(placed.model);
    ASSERT_EQ(placed.model->points.size(), capture.points.size());
    size_t observations = 0;
    for (const calib::SfmImage& image : placed.model->images) {
      const calib::LensMap lens(placed.model->cameras.at(image.camera_id));
      for (const calib::SfmFeature& feature : image.features) {
        const auto pixel = lens.PixelFromCam(image.cam_from_world *
                                             placed.model->points.at(feature.point_id).p_in_world);
        ASSERT_TRUE(pixel);
        EXPECT_LT((*pixel - feature.pixel).norm(), kResidualPx);
        ++observations;
      }
    }
    EXPECT_EQ(observations, capture.points.size() * capture.cameras.size());
  }
  EXPECT_GE(with_points, 10);
}

TEST(CameraFormats, PhotosWithoutCameraAreNamedWithTheReason) {
  const TemporaryFolder folder;
  const TrueCapture capture;
  for (const SourceProgram& program : WriteAllPrograms(capture, folder.path())) {
    SCOPED_TRACE(program.format + " " + program.variant);
    const auto left_out = Placed(program, capture).left_out;
    if (program.format == "metashape") {
      ASSERT_EQ(left_out.size(), 2u);
      EXPECT_EQ(left_out[0].first, "off.jpg");
      EXPECT_THAT(left_out[0].second, HasSubstr("disabled"));
      EXPECT_THAT(left_out[1].second, HasSubstr("not aligned"));
    }
    if (program.format == "openmvg" || program.format == "alicevision" ||
        program.format == "bundler") {
      EXPECT_EQ(left_out.size(), 1u);
    }
  }
}

TEST(CameraFormats, OneCaptureGivesTheSameCamerasWhicheverProgramWroteIt) {
  constexpr double kSame = 1e-6;
  const TemporaryFolder folder;
  const TrueCapture capture;
  const fs::path photos = folder.path() / "photos";
  fs::create_directories(photos);
  for (const auto& camera : capture.cameras) {
    io::WriteImage(photos / camera.name, ImageRgb8(TrueCapture::kWidth, TrueCapture::kHeight, 3));
  }
  const std::vector<SourceProgram> programs = WritePlainPrograms(capture, folder.path());
  ASSERT_EQ(programs.size(), 8u);
  for (const SourceProgram& program : programs) {
    SCOPED_TRACE(program.format);
    CameraFileFolders folders;
    folders.images = photos;
    const CamerasFromFile read = ReadCameraFile(program.file, "", folders);
    ASSERT_EQ(read.list.cameras.size(), capture.cameras.size());
    std::map<std::string, io::NamedCamera> by_name;
    for (const io::NamedCamera& named : read.list.cameras) by_name[named.name] = named;
    for (const auto& camera : capture.cameras) {
      const io::NamedCamera& named = by_name.at(camera.name);
      EXPECT_FALSE(named.distortion);
      EXPECT_LT((named.cam_from_world.rotation.toRotationMatrix() - camera.rotation).norm(), kSame);
      EXPECT_LT((named.cam_from_world.TargetOriginInSource() - camera.centre).norm(), kSame);
      EXPECT_NEAR(named.camera.fx_px(), 500, kSame);
      EXPECT_NEAR(named.camera.fy_px(), 500, kSame);
      EXPECT_NEAR(named.camera.cx_px(), 324, kSame);
      EXPECT_NEAR(named.camera.cy_px(), 236, kSame);
    }
  }
}

TEST(CameraFormats, PhotosOfAnotherSizeScaleTheirCameras) {
  const TemporaryFolder folder;
  const TrueCapture capture;
  for (SourceProgram& program : WriteAllPrograms(capture, folder.path())) {
    if (program.format == "mvsnet") continue;  // has absolute pixels without a size
    if (program.format == "bundler" || program.format == "nvm") continue;
    if (program.variant == "opencv") continue;
    SCOPED_TRACE(program.format + " " + program.variant);
    const PlacedCameras placed = PlaceCameras(
        FormatOf(program.file, "", "x").read(program.file), "file", NamesIn(capture),
        [](const std::string& name) {
          return io::SizedImage{name, TrueCapture::kWidth / 2, TrueCapture::kHeight / 2};
        });
    const auto full = program.project;
    program.project = [full](const Eigen::Vector3d& p) { return Eigen::Vector2d(full(p) / 2); };
    EXPECT_LT(LargestResidual(program, capture, placed.list), kResidualPx);
  }
}

// Cut anywhere, a file is rejected by an Error.
TEST(CameraFormats, EveryPrefixOfAFileIsAnError) {
  const TemporaryFolder folder;
  const TrueCapture capture;
  for (const SourceProgram& program : WriteAllPrograms(capture, folder.path())) {
    if (program.format == "mvsnet") continue;  // behind the cameras stands what is not used
    SCOPED_TRACE(program.format + " " + program.variant);
    const CameraFormat format = FormatOf(program.file, "", "x");
    std::string text = ReadFile(program.file, 1 << 24);
    if (program.format == "nvm") {  // what stands behind the points may be absent
      text.erase(text.find("\n0\n\n#"));
    }
    text.erase(text.find_last_not_of(" \n") + 1);  // the last line may lack its end
    if (std::isdigit(static_cast<unsigned char>(text.back()))) {
      // A number cut in its middle passes for a shorter one, where it is the last.
      text = text.substr(0, text.find_last_of(" ,") + 1) + "7";
    }
    WriteFileAtomically(program.file, text);
    // A table without the number of its rows may end behind any of them.
    dtr::testing::ExpectEveryPrefixIsAnError(program.file, 97, [&] {
      if (format.read(program.file).cameras.size() < capture.cameras.size()) throw Error("fewer");
    });
  }
}

std::string Replaced(const std::string& text, const std::string& line_end) {
  std::string replaced;
  for (const char c : text) replaced += c == '\n' ? line_end : std::string(1, c);
  return replaced;
}

// UTF-16 of ASCII, little endian, with its mark.
std::string Utf16(const std::string& text) {
  std::string units = "\xff\xfe";
  for (const char c : text) units += std::string{c, '\0'};
  return units;
}

TEST(CameraFormats, LineEndsMarksAndEncodingsMakeNoDifference) {
  using Rewrite = std::string (*)(const std::string&);
  const std::pair<const char*, Rewrite> rewrites[] = {
      {"CRLF", [](const std::string& text) { return Replaced(text, "\r\n"); }},
      {"CR", [](const std::string& text) { return Replaced(text, "\r"); }},
      {"mark", [](const std::string& text) { return "\xef\xbb\xbf" + text; }},
      {"UTF-16", Utf16},
      {"no last end",
       [](const std::string& text) { return text.substr(0, text.find_last_not_of('\n') + 1); }},
      {"blanks", [](const std::string& text) { return Replaced(text, "  \n"); }}};
  for (const auto& [name, rewrite] : rewrites) {
    const TemporaryFolder folder;
    const TrueCapture capture;
    for (const SourceProgram& program : WriteAllPrograms(capture, folder.path())) {
      SCOPED_TRACE(program.format + " " + program.variant + ", " + name);
      const fs::path inside =
          fs::is_directory(program.file) ? program.file : program.file.parent_path();
      for (const auto& entry : fs::recursive_directory_iterator(inside)) {
        if (!entry.is_regular_file()) continue;
        WriteFileAtomically(entry.path(), rewrite(ReadFile(entry.path(), 1 << 24)));
      }
      ASSERT_EQ(FormatOf(program.file, "", "`cameras`").name, program.format);
      const PlacedCameras placed = Placed(program, capture);
      EXPECT_LT(LargestResidual(program, capture, placed.list), kResidualPx);
      EXPECT_EQ(placed.model.has_value(), program.points);
    }
  }
}

// RealityScan's table as spreadsheets save it.
TEST(CameraFormats, TablesMayHaveOtherSeparatorsQuotesAndOrders) {
  const TemporaryFolder folder;
  const TrueCapture capture;
  for (const SourceProgram& program : WriteAllPrograms(capture, folder.path())) {
    if (program.format != "realityscan") continue;
    SCOPED_TRACE(program.variant);
    const std::string text = ReadFile(program.file, 1 << 24);
    const auto expect_same = [&](const std::string& changed) {
      WriteFileAtomically(program.file, changed);
      ASSERT_EQ(FormatOf(program.file, "", "`cameras`").name, "realityscan");
      EXPECT_LT(LargestResidual(program, capture, Placed(program, capture).list), kResidualPx);
    };
    std::string semicolons = text, quoted, reversed;
    std::replace(semicolons.begin(), semicolons.end(), ',', ';');
    expect_same(semicolons);
    std::replace(semicolons.begin(), semicolons.end(), ';', '\t');
    expect_same(semicolons);
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("#cameras")) continue;
      if (line.starts_with("#")) line.erase(0, 1);
      std::vector<std::string> cells;
      std::istringstream words(line);
      for (std::string cell; std::getline(words, cell, ',');) cells.push_back(cell);
      std::string in_quotes, backwards;
      for (const std::string& cell : cells) {
        in_quotes += (in_quotes.empty() ? "\"" : ",\"") + cell + "\"";
        backwards = cell + (backwards.empty() ? "" : ",") + backwards;
      }
      quoted += in_quotes + ",\n";
      reversed += backwards + "\n";
    }
    expect_same(quoted);
    expect_same(reversed);
    std::string commas = text;
    std::replace(commas.begin(), commas.end(), ',', ';');
    std::replace(commas.begin() + static_cast<long>(commas.find("jpg")), commas.end(), '.', ',');
    WriteFileAtomically(program.file, commas);
    EXPECT_THAT(MessageOf<Error>([&] { Placed(program, capture); }),
                HasSubstr("write numbers with a decimal point, not a comma"));
  }
}

TEST(PhotoNames, PathsOfOtherComputersMeanThePhotosTheyEndIn) {
  const PhotoNames names({"left/a.jpg", "right/a.jpg", "b.JPG", "c.0001.jpg", "d.jpg", "d.png"});
  const auto meant = [&](const char* path) {
    const auto found = names.Meant(path);
    return std::string(found.empty() ? "none" : found.size() > 1 ? "several" : found.front());
  };
  EXPECT_EQ(meant("left/a.jpg"), "left/a.jpg");
  EXPECT_EQ(meant("C:\\work\\right\\a.jpg"), "right/a.jpg");
  EXPECT_EQ(meant("a.jpg"), "several");
  EXPECT_EQ(meant("a"), "several");
  EXPECT_EQ(meant("left/a"), "left/a.jpg");
  EXPECT_EQ(meant("middle/a.jpg"), "none");
  EXPECT_EQ(meant("/x/y/b.jpg"), "b.JPG");
  EXPECT_EQ(meant("b"), "b.JPG");
  EXPECT_EQ(meant("c.0001"), "c.0001.jpg");
  EXPECT_EQ(meant("c"), "none");
  EXPECT_EQ(meant("d.png"), "d.png");
  EXPECT_EQ(meant("d"), "several");
  EXPECT_EQ(meant("d.tif"), "none");
}

class Changed : public ::testing::Test {
 protected:
  // The file of a program with one text for another; what reading and placing it says.
  std::string Says(const std::string& format, const std::string& variant, const std::string& from,
                   const std::string& to) {
    for (const SourceProgram& program : WriteAllPrograms(capture_, folder_.path())) {
      if (program.format != format || program.variant != variant) continue;
      std::string text = ReadFile(program.file, 1 << 24);
      const size_t at = text.find(from);
      EXPECT_NE(at, std::string::npos) << from;
      if (at == std::string::npos) return "";
      text.replace(at, from.size(), to);
      WriteFileAtomically(program.file, text);
      const std::string message = MessageOf<Error>([&] { Placed(program, capture_); });
      EXPECT_EQ(message.find('\n'), std::string::npos);
      EXPECT_THAT(message, HasSubstr(program.file.string()));
      return message;
    }
    ADD_FAILURE() << "no such program";
    return "";
  }

  TemporaryFolder folder_;
  TrueCapture capture_;
};

TEST_F(Changed, UnknownCameraModelsAreNamed) {
  EXPECT_THAT(Says("metashape", "frame", "type=\"frame\"", "type=\"spherical\""),
              AllOf(HasSubstr("sensor 0: type 'spherical'"), HasSubstr("frame or fisheye")));
  EXPECT_THAT(Says("opensfm", "perspective", "perspective", "spherical"),
              HasSubstr("'spherical' is none of perspective"));
  EXPECT_THAT(Says("openmvg", "pinhole", "\"pinhole\"", "\"spherical\""),
              HasSubstr("camera model 'spherical' cannot be used"));
  EXPECT_THAT(Says("alicevision", "brown_11", "\"brown\"", "\"3deradial4\""),
              HasSubstr("'3deradial4' is none of pinhole"));
  EXPECT_THAT(Says("miv", "plain", "Perspective", "Equirectangular"),
              AllOf(HasSubstr("(00000000).Projection"), HasSubstr("Equirectangular")));
}

TEST_F(Changed, LengthsOfAnotherUnitAreRejected) {
  EXPECT_THAT(Says("metashape", "frame", "<f>500</f>", "<f>3</f>"),
              AllOf(HasSubstr("camera 0 (00000000)"),
                    HasSubstr("a focal length of 3 px cannot be that of an image of 640 x 480")));
  EXPECT_THAT(Says("bundler", "v0.3", "\n500 -0.11", "\n3 -0.11"), HasSubstr("camera 0"));
  EXPECT_THAT(Says("openmvg", "pinhole", "\"focal_length\": 500", "\"focal_length\": -500"),
              HasSubstr("a focal length of -500 px"));
}

TEST_F(Changed, MirroredPosesAreRejected) {
  for (const SourceProgram& program : WriteAllPrograms(capture_, folder_.path())) {
    if (program.format != "openmvg" || program.variant != "pinhole") continue;
    std::string text = ReadFile(program.file, 1 << 24);
    // The first row of the first rotation, negated.
    const size_t begin = text.find("\"rotation\": [[") + 14, end = text.find(']', begin);
    std::string row = text.substr(begin, end - begin), negated;
    for (size_t at = 0; at < row.size();) {
      const size_t comma = std::min(row.find(", ", at), row.size());
      const std::string number = row.substr(at, comma - at);
      negated += (at > 0 ? ", " : "") + (number[0] == '-' ? number.substr(1) : "-" + number);
      at = comma + 2;
    }
    WriteFileAtomically(program.file, text.replace(begin, end - begin, negated));
    EXPECT_THAT(MessageOf<Error>([&] { Placed(program, capture_); }),
                AllOf(HasSubstr("extrinsics 0"), HasSubstr("found a mirroring")));
    return;
  }
}

TEST_F(Changed, NamesThatMeanTwoPhotosOrOneTwiceAreRejected) {
  EXPECT_THAT(Says("realityscan", "older", "00000001.jpg", "00000000.jpg"),
              AllOf(HasSubstr("line 4"), HasSubstr("means the photo 00000000.jpg, which line 3")));
  const SourceProgram program = WriteAllPrograms(capture_, folder_.path()).front();
  const CameraFormat format = FormatOf(program.file, "", "x");
  EXPECT_THAT(MessageOf<Error>([&] {
                PlaceCameras(format.read(program.file), "cameras.xml",
                             PhotoNames({"a/00000000.jpg", "b/00000000.jpg"}), PhotoOf);
              }),
              AllOf(HasSubstr("camera 0 (00000000)"),
                    HasSubstr("may mean any of 2 photos, a/00000000.jpg, b/00000000.jpg")));
}

TEST_F(Changed, MvsnetCamerasOfSmallerImagesAreRejected) {
  for (const SourceProgram& program : WriteAllPrograms(capture_, folder_.path())) {
    if (program.format != "mvsnet") continue;
    EXPECT_THAT(MessageOf<Error>([&] {
                  PlaceCameras(FormatOf(program.file, "", "x").read(program.file), "cams",
                               NamesIn(capture_), [](const std::string& name) {
                                 return io::SizedImage{name, 2560, 1920};
                               });
                }),
                AllOf(HasSubstr("00000000_cam.txt"), HasSubstr("images of about 648 x 472 px")));
  }
}

TEST(CameraFormats, WhatIsNotRecognisedIsSaidWithAllThatCanBe) {
  const TemporaryFolder folder;
  const auto says = [&](const std::string& name, const std::string& text) {
    WriteFileAtomically(folder.path() / name, text);
    return MessageOf<UsageError>([&] { FormatOf(folder.path() / name, "", "`poses`"); });
  };
  const std::string other = says("a.json", "{\"x\": 1}\n");
  for (const std::string& format : CameraFormats()) {
    EXPECT_THAT(other, HasSubstr("(" + format + ")"));
  }
  EXPECT_THAT(says("scene.psx", "<document version=\"1.2.0\" path=\"x\"/>"),
              HasSubstr("Metashape project; export its cameras"));
  EXPECT_THAT(says("cam.cameramodel", "{ 'lensmodel': 'LENSMODEL_PINHOLE' }"),
              HasSubstr("intrinsics of a camera"));
  EXPECT_THAT(says("cameras.abc", "Ogawa"), HasSubstr("Alembic"));
  EXPECT_THAT(says("synth_0.out", "colmap 1.0\r\n6 483\r\n"), HasSubstr("Recon3D"));
  EXPECT_THAT(says("00000000.txt", "CONTOUR\n1 0 0 0\n"), HasSubstr("PMVS"));
  EXPECT_THAT(says("old.nvm", "NVM_V2\n"), HasSubstr("only NVM_V3 is read"));
  for (const char* trajectory : {"# time tx ty tz qx qy qz qw\n1305031098.6 1 2 3 0 0 0 1\n",
                                 "#timestamp [ns],x,y,z,w,x,y,z,vx\n1403636579758555392,4.6,-1.7,"
                                 "0.8,0.5,0.1,0.8,0.1,0.0\n",
                                 "1 0 0 0.1 0 1 0 0.2 0 0 1 0.3\n"}) {
    EXPECT_THAT(says("poses.txt", trajectory), HasSubstr("make a TUM sequence of it"));
  }
  EXPECT_THAT(MessageOf<UsageError>([&] { FormatOf(folder.path() / "a.json", "obj", "`poses`"); }),
              HasSubstr("expected one of"));
  EXPECT_THAT(MessageOf<UsageError>([&] { FormatOf(folder.path() / "none", "", "`poses`"); }),
              HasSubstr("no such file or folder"));
}

}  // namespace
}  // namespace dtr::pipeline
