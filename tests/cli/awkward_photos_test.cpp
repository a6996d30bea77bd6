// Photos as people have them, one of each kind, behind names and links that scripts stumble over:
// `dtr build` makes of them what it makes of plain ones.
#include <nlohmann/json.hpp>

#include "calib/colmap/model_io.h"
#include "datasets/layout.h"
#include "datasets/make.h"
#include "datasets/render_truth.h"
#include "datasets/scene.h"
#include "dtr/base/files.h"
#include "dtr/io/set_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/photo_kinds.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

struct Kind {
  const char* name;  ///< of the photo's file; in the order in which `dtr` takes them
  void (*write)(const fs::path&, const ImageRgb8&);
  int apart;  ///< levels of 255 that the way of writing may cost
};
constexpr Kind kKinds[kCourtyardViews] = {
    {"$HOME; rm -rf.jpg", WriteCmyk, 4},
    {"- alpha.png", WriteAlpha, 0},
    {"a b  c.tif", WriteTurned, 0},
    {"linear.exr", WriteLinear, 0},
    {"progressive.jpeg", WriteProgressive, 4},
    {"sixteen bits.PNG", WriteSixteenBits, 0},
    {"\xc3\x84rger \xe5\x86\x99\xe7\x9c\x9f.png",
     [](const fs::path& file, const ImageRgb8& image) { io::WriteImage(file, image); }, 0},
};

std::vector<std::string> Build(const fs::path& photos, const fs::path& model, const fs::path& set) {
  return {"build",        photos.string(),
          "-o",           set.string(),
          "--poses",      model.string(),
          "--max-size",   "0",
          "--passes",     "1",
          "--iterations", "2",
          "--neighbours", "2",
          "--threads",    "2"};
}

// The views of a set, by the names in `names`.
std::vector<View> Views(const fs::path& set_folder, const std::vector<std::string>& names) {
  DtrSet set = io::ReadSet(set_folder);
  std::vector<View> views;
  for (const std::string& name : names) {
    for (View& view : set.frames.at(0).views) {
      if (view.name != name) continue;
      io::LoadPixels(set_folder, view, {});
      views.push_back(view);
    }
  }
  return views;
}

void ExpectSameImage(const View& plain, const View& awkward, int apart) {
  ASSERT_EQ(awkward.image.width(), plain.image.width());
  ASSERT_EQ(awkward.image.height(), plain.image.height());
  for (size_t i = 0; i < plain.image.data().size(); ++i) {
    ASSERT_NEAR(awkward.image.data()[i], plain.image.data()[i], apart) << i;
  }
}

// Depth is found where it was found, and is the same to a few percent almost everywhere: every
// view is matched with one whose pixels changed a little.
void ExpectSameDepth(const View& plain, const View& awkward) {
  int both = 0, either = 0, same = 0;
  for (int y = 0; y < plain.depth.height(); ++y) {
    for (int x = 0; x < plain.depth.width(); ++x) {
      const float a = plain.depth(x, y), b = awkward.depth(x, y);
      either += a > 0 || b > 0;
      both += a > 0 && b > 0;
      same += a > 0 && b > 0 && std::abs(a - b) < 0.03f * a;
    }
  }
  EXPECT_GT(both, either * 8 / 10);
  EXPECT_GT(same, both * 9 / 10);
}

TEST(AwkwardPhotos, GiveTheSetOfPlainOnes) {
  const TemporaryFolder folder;
  const fs::path courtyard = folder / "c", photos = folder / "photos of \"mine\"";
  MakeSmallCourtyard(courtyard);
  fs::create_directories(photos);
  fs::create_directories(folder / "elsewhere");
  calib::SfmModel model = colmap::ReadModel(courtyard / "sparse");
  ASSERT_EQ(model.images.size(), static_cast<size_t>(kCourtyardViews));
  std::vector<std::string> plain_names, names;
  for (size_t i = 0; i < model.images.size(); ++i) {
    const Kind& kind = kKinds[i];
    // Every second one is a link to a file that may not be written.
    const fs::path file = (i % 2 == 0 ? photos : folder / "elsewhere") / kind.name;
    kind.write(file, io::ReadImage(courtyard / "images" / model.images[i].name));
    fs::permissions(file, fs::perms::owner_read);
    if (i % 2 == 1) fs::create_symlink(file, photos / kind.name);
    plain_names.push_back(model.images[i].name);
    names.push_back(model.images[i].name = kind.name);
  }
  // No camera is known for it: it must not get into anybody's way.
  WriteForeign<float>(photos / "not finite.exr", {64, 48, 3, OIIO::TypeDesc::FLOAT},
                      std::vector<float>(64 * 48 * 3, NAN));
  colmap::WriteModel(folder / "model", model, colmap::Format::kBinary);
  fs::create_directory_symlink(photos, folder / "link");

  DtrOk(Build(courtyard / "images", courtyard / "sparse", folder / "plain.dtr"));
  DtrOk(Build(folder / "link", folder / "model", folder / "awkward.dtr"));
  const std::vector<View> plain = Views(folder / "plain.dtr", plain_names);
  const std::vector<View> awkward = Views(folder / "awkward.dtr", names);
  ASSERT_EQ(plain.size(), static_cast<size_t>(kCourtyardViews));
  ASSERT_EQ(awkward.size(), plain.size());
  for (size_t i = 0; i < plain.size(); ++i) {
    SCOPED_TRACE(kKinds[i].name);
    ExpectSameImage(plain[i], awkward[i], kKinds[i].apart);
    ExpectSameDepth(plain[i], awkward[i]);
  }
}

// Photos of one scene by a phone, a tablet and an old camera, held as it came.
struct Shot {
  const char* name;  ///< in byte order
  int width_px, height_px;
  double focal_35mm;
  int orientation;  ///< EXIF's, of the stored pixels
  bool grey;
};
constexpr Shot kShots[] = {
    {"a/1.png", 192, 128, 28, 1, false}, {"a/2.tif", 128, 192, 28, 6, false},
    {"a/3.tif", 192, 128, 28, 3, false}, {"a/4.tif", 128, 192, 28, 8, false},
    {"a/5.png", 192, 128, 28, 1, true},  {"b/1.tif", 144, 144, 24, 2, false},
    {"b/2.tif", 144, 144, 24, 4, false}, {"b/3.tif", 120, 180, 35, 5, false},
    {"b/4.tif", 180, 120, 35, 7, false}, {"c/1.png", 96, 64, 28, 1, false},
    {"c/2.png", 96, 64, 28, 1, true},    {"c/3.tif", 160, 240, 32, 8, false}};

// The file that a camera held that way writes: turned upright by its tag it is `upright`.
void WriteHeld(const fs::path& file, const ImageRgb8& upright, int orientation) {
  const int back = orientation == 6 ? 8 : orientation == 8 ? 6 : orientation;
  const ImageRgb8 stored = io::ApplyExifOrientation(upright, back);
  OIIO::ImageSpec spec(stored.width(), stored.height(), 3, OIIO::TypeDesc::UINT8);
  spec.attribute("Orientation", orientation);
  WriteForeign<std::uint8_t>(file, spec, {stored.data().begin(), stored.data().end()});
}

// How much of the depth that can be known is found, and how much of what is found is right: within
// a pixel of disparity, as the photos' focal lengths in pixels differ by a factor of 2.8.
struct DepthFound {
  double complete = 0, right = 0;
};
DepthFound FoundDepth(const View& view, const DepthImage& truth) {
  const double scale_px = view.camera.fx_px() * view.reference_baseline;
  int known = 0, both = 0, right = 0;
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      if (truth(x, y) <= 0) continue;
      ++known;
      if (view.depth(x, y) <= 0) continue;
      ++both;
      right += scale_px * std::abs(1 / view.depth(x, y) - 1 / truth(x, y)) < 1;
    }
  }
  return {static_cast<double>(both) / known, static_cast<double>(right) / std::max(both, 1)};
}

// Photos of 0.006 to 0.04 Mpx, one pass, two neighbours. Least complete (measured 0.34) is the
// last of the arc, whose neighbours, on one side only, are 2.5 times as coarse; least right (0.84)
// the first, which has them on one side too. Means measured: 0.60 and 0.91. The maps are
// deterministic; the margins are for other compilers.
constexpr double kCompleteEach = 0.3, kRightEach = 0.8;
constexpr double kCompleteMean = 0.57, kRightMean = 0.89;

// The photos under names that also tell their format.
std::vector<CourtyardPhoto> Named(std::vector<CourtyardPhoto> photos, const std::string& ending) {
  for (CourtyardPhoto& photo : photos) photo.name += ending;
  return photos;
}

ImageRgb8 Upright(const fs::path& folder, const Shot& shot) {
  return io::ReadImage(folder / "upright" / (std::string(shot.name) + ".png"));
}

// What `dtr` must take a photo for, whatever its file is.
ImageRgb8 Meant(const fs::path& folder, const Shot& shot) {
  ImageRgb8 image = Upright(folder, shot);
  for (size_t i = 0; shot.grey && i < image.data().size(); i += 3) {
    image.data()[i] = image.data()[i + 2] = image.data()[i + 1];  // WriteGrey keeps the green
  }
  return image;
}

// Writes every photo the way it came, below photos/, and as what it means, below plain/.
void WriteShots(const fs::path& folder) {
  for (const Shot& shot : kShots) {
    const ImageRgb8 upright = Upright(folder, shot);
    const fs::path file = folder / "photos" / shot.name, plain = folder / "plain" / shot.name;
    fs::create_directories(file.parent_path());
    fs::create_directories(plain.parent_path());
    io::WriteImage(plain.string() + ".png", Meant(folder, shot));
    if (shot.grey) {
      WriteGrey(file, upright);
    } else if (shot.orientation == 1) {
      io::WriteImage(file, upright);
    } else {
      WriteHeld(file, upright, shot.orientation);
    }
  }
}

TEST(AwkwardPhotos, OfEverySizeLensShapeAndOrientationMakeOneSet) {
  const TemporaryFolder folder;
  std::vector<CourtyardPhoto> shots;
  std::vector<std::string> names, plain_names;
  const std::vector<Pose> poses = CourtyardArc(std::size(kShots));
  for (const Shot& shot : kShots) {
    shots.push_back({shot.name,
                     datasets::MakeCamera(shot.width_px, shot.height_px, shot.focal_35mm),
                     poses[shots.size()]});
    names.emplace_back(shot.name);
    plain_names.push_back(names.back() + ".png");
  }
  RenderCourtyard(folder / "upright", Named(shots, ".png"));
  WriteShots(folder.path());
  colmap::WriteModel(folder / "model", CourtyardModel(shots), colmap::Format::kBinary);
  // Its cameras are those of upright photos; COLMAP's own would be of photos as they are stored.
  WriteFileAtomically(folder / "model/upright_photos.txt", "");
  colmap::WriteModel(folder / "plain_model", CourtyardModel(Named(shots, ".png")),
                     colmap::Format::kBinary);
  DtrOk(Build(folder / "photos", folder / "model", folder / "set.dtr"));
  DtrOk(Build(folder / "plain", folder / "plain_model", folder / "plain.dtr"));
  const std::vector<View> views = Views(folder / "set.dtr", names);
  const std::vector<View> plain = Views(folder / "plain.dtr", plain_names);
  ASSERT_EQ(views.size(), names.size());
  ASSERT_EQ(plain.size(), names.size());
  const datasets::Scene scene = datasets::MakeScene("courtyard", datasets::DatasetSpec{}.seed);
  double complete = 0, right = 0;
  for (size_t i = 0; i < views.size(); ++i) {
    SCOPED_TRACE(kShots[i].name);
    EXPECT_EQ(views[i].camera, shots[i].camera);
    EXPECT_EQ(views[i].image, Meant(folder.path(), kShots[i]));
    // How a camera was held and how it wrote its file moves nothing.
    EXPECT_EQ(views[i].depth.grid(), plain[i].depth.grid());
    const DepthFound found = FoundDepth(
        views[i], datasets::RenderDepth(scene, shots[i].camera, shots[i].cam_from_scene));
    EXPECT_GT(found.complete, kCompleteEach);
    EXPECT_GT(found.right, kRightEach);
    complete += found.complete / static_cast<double>(views.size());
    right += found.right / static_cast<double>(views.size());
  }
  EXPECT_GT(complete, kCompleteMean);
  EXPECT_GT(right, kRightMean);
}

}  // namespace
}  // namespace dtr::testing
