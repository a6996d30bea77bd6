// Photos that were zoomed one by one, without EXIF or with one that says nothing of it: a camera
// for each (`--camera-per photo`) has the right focal length, or the validation fails.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "dtr/io/image_io.h"
#include "dtr/types/area_average.h"
#include "tests/cli/compared_with_plaza.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr double kPlazaFocal = 746.6667 / 960;  // long sides
constexpr int kWidthPx = 480, kHeightPx = 320;
constexpr double kFocalShare = 0.01;  // measured: 0.005
constexpr double kPositionShare = 0.01;

// The photo's middle 1 / zoom, shrunk to the size that all are to have.
ImageRgb8 Zoomed(const ImageRgb8& photo, double zoom) {
  const int part_width = static_cast<int>(std::lround(photo.width() / zoom)) / 2 * 2;
  const int part_height = static_cast<int>(std::lround(photo.height() / zoom)) / 2 * 2;
  const int left = (photo.width() - part_width) / 2, top = (photo.height() - part_height) / 2;
  ImageRgb8 small(kWidthPx, kHeightPx, 3);
  for (int c = 0; c < 3; ++c) {
    Grid<std::uint8_t> part(part_width, part_height);
    for (int y = 0; y < part_height; ++y) {
      for (int x = 0; x < part_width; ++x) part(x, y) = photo(left + x, top + y, c);
    }
    const Grid<std::uint8_t> shrunk = AreaAverage(part, kWidthPx, kHeightPx);
    for (int y = 0; y < kHeightPx; ++y) {
      for (int x = 0; x < kWidthPx; ++x) small(x, y, c) = shrunk(x, y);
    }
  }
  return small;
}

class ZoomedPhotos : public ::testing::Test {
 protected:
  void Photos(const std::map<std::string, double>& zooms) {
    fs::create_directories(folder_ / "photos");
    for (int i = 2; i < 12; ++i) {
      const std::string name = fmt::format("{:04}.jpg", i);
      const auto zoom = zooms.find(name);
      io::WriteImage(
          folder_ / "photos" / name,
          Zoomed(io::ReadImage(Plaza() / "images" / name), zoom == zooms.end() ? 1 : zoom->second),
          85);
    }
  }
  Ran Calibrate(const fs::path& photos) {
    return DtrOk({"calibrate", "photos", photos.string(), "-o", (folder_ / "model").string(),
                  "--camera-per", "photo"});
  }
  void ExpectRight(const std::map<std::string, double>& zooms) {
    const calib::SfmModel model = colmap::ReadModel(folder_ / "model");
    EXPECT_EQ(model.images.size(), 10u);
    for (const calib::SfmImage& image : model.images) {
      const auto zoom = zooms.find(image.name);
      const double right = kPlazaFocal * kWidthPx * (zoom == zooms.end() ? 1 : zoom->second);
      const calib::LensCamera& camera = model.cameras.at(image.camera_id);
      EXPECT_NEAR(camera.params[0], right, kFocalShare * right) << image.name;
      EXPECT_NEAR(camera.params[1], camera.width_px / 2.0, 0.005 * kWidthPx) << image.name;
      EXPECT_NEAR(camera.params[2], camera.height_px / 2.0, 0.005 * kWidthPx) << image.name;
    }
    EXPECT_LT(PositionsOff(model), kPositionShare);
  }
  void GetTheirFocalLengths(const std::map<std::string, double>& zooms) {
    DTR_REQUIRE_DATA(Plaza());
    Photos(zooms);
    Calibrate(folder_ / "photos");
    ExpectRight(zooms);
  }
  TemporaryFolder folder_;
};

TEST_F(ZoomedPhotos, TwoOfTenOfTheFieldCase) {
  const fs::path photos = FieldCase("zoom_camera_per_photo") / "photos";
  DTR_REQUIRE_DATA(photos);
  DTR_REQUIRE_DATA(Plaza());
  const Ran ran = Calibrate(photos);
  EXPECT_THAT(ran.err, HasSubstr("zoomed: "));
  ExpectRight({{"0005.jpg", 4.0 / 3}, {"0009.jpg", 4.0 / 3}});
}

TEST_F(ZoomedPhotos, OthersByOtherFactors) {
  GetTheirFocalLengths({{"0003.jpg", 1.5}, {"0006.jpg", 1.2}, {"0010.jpg", 1.8}});
}

TEST_F(ZoomedPhotos, ByLittle) {
  GetTheirFocalLengths({{"0003.jpg", 1.07}, {"0005.jpg", 1.05}, {"0009.jpg", 1.1}});
}

TEST_F(ZoomedPhotos, EachByAnotherFactor) {
  std::map<std::string, double> zooms;
  for (int i = 2; i < 12; ++i) {
    zooms[fmt::format("{:04}.jpg", i)] = 1 + 0.37 * i - std::floor(0.37 * i);
  }
  GetTheirFocalLengths(zooms);
}

// A camera for each of photos that were not zoomed costs little.
TEST_F(ZoomedPhotos, NoneOfThem) { GetTheirFocalLengths({}); }

}  // namespace
}  // namespace dtr::testing
