// What `dtr import` takes and rejects: cameras, depth and masks of other programs.
#include "dtr/io/formats/npy.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "tests/cli/refusals.h"

namespace dtr::testing {
namespace {

TEST_F(Rejections, WhatCannotBeImported) {
  const auto import = [&](const std::string& cameras, std::vector<std::string> further) {
    further.insert(further.begin(), {"import", "--cameras", cameras, "-o", In("set.dtr")});
    return further;
  };
  const std::string good = Shared("courtyard/cameras.json"), depth = Shared("courtyard/depth");
  const std::string sparse = Shared("courtyard/sparse");
  Json wide = Cameras(), numbers = Cameras();
  wide["views"][0]["width"] = 96;
  Write("wide.json", wide.dump());
  numbers["views"][0]["depth"] = "0000.png";
  Write("numbers.json", numbers.dump());
  const std::string pngs = Folder("pngs"), empty = Folder("empty");
  fs::copy(depth, pngs, fs::copy_options::recursive);
  io::WriteImage(In("pngs/0000.png"), ImageRgb8(4, 4, 3));
  ExpectAllRejected({
      {kWrongUsage, ": no such file or folder", import(In("cameras.json"), {"--images", Photos()})},
      {kWrongUsage,
       "not recognised; what can be read (its --format): the folder of a COLMAP model (colmap)",
       import(Write("cameras.xml", ""), {"--images", Photos()})},
      {kWrongUsage, "--images: expected the folder of the images of", import(good, {})},
      {kWrongUsage, ": no such folder",
       import(good, {"--images", Photos(), "--masks", In("masks")})},
      {kWrongUsage, "expected a mask of 0000.jpg or of another photo, called 0000.png",
       import(sparse, {"--images", Photos(), "--masks", empty})},
      {kWrongUsage, "--depth-unit requires --depth",
       import(sparse, {"--images", Photos(), "--depth-unit", "0.001"})},
      {kWrongUsage, "--holdout: no photo is named 'nobody'",
       import(good, {"--images", Photos(), "--holdout", "nobody"})},
      {kFailed, "; give the folder of its photos",
       import(good, {"--images", empty, "--depth", depth})},
      {kFailed,
       "expected one depth map (.exr, .pfm, .png, .tif, .npy) named like the photo 0000.jpg",
       import(sparse, {"--images", Photos(), "--depth", empty})},
      {kFailed,
       "pixels as the camera says, found 192x128; give the images the cameras were made for",
       import(In("wide.json"), {"--images", Photos(), "--depth", depth})},
      {kWrongUsage, "expected --depth-unit for a depth map of whole numbers, found none",
       import(In("numbers.json"), {"--images", Photos(), "--depth", pngs})},
      {kWrongUsage,
       "expected no such folder yet, found one; choose another name or pass --force",
       {"import", "--cameras", good, "--images", Photos(), "--depth", depth, "-o", empty}},
  });
  EXPECT_FALSE(fs::exists(In("set.dtr")));
  EXPECT_FALSE(fs::exists(In("set.dtr.partial")));
}

TEST_F(Rejections, FocalLengthsThatCannotBe) {
  Json cameras = Cameras();
  cameras["views"][1]["fy"] = 3;
  const Json frame = {
      {"file_path", "0000.jpg"},
      {"transform_matrix", {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}};
  const Json transforms = {{"fl_x", 3}, {"w", 192}, {"h", 128}, {"frames", {frame}}};
  Folder("model");
  Write("model/cameras.txt", "7 PINHOLE 192 128 3 3 96 64\n");
  Write("model/images.txt", "1 1 0 0 0 0 0 0 7 0000.jpg\n\n");
  Write("model/points3D.txt", "");
  for (const auto& [file, entry] : {
           std::pair{Write("short.json", cameras.dump()), "short.json: views[1] (0001.jpg)"},
           {Write("transforms.json", transforms.dump()), "transforms.json: frames[0] (0000.jpg)"},
           {In("model"), "model: camera 7"},
       }) {
    const Ran ran = Dtr({"import", "--cameras", file, "--images", Photos(), "-o", In("set.dtr")});
    ExpectRejected(ran, kFailed, "the file has another unit, or belongs to other images");
    EXPECT_NE(ran.err.find(std::string(entry) +
                           ": a focal length of 3 px cannot be that of an image of 192 x 128 px"),
              std::string::npos)
        << ran.err;
  }
  EXPECT_FALSE(fs::exists(In("set.dtr")));
}

TEST_F(Rejections, NumbersThatCannotBeComputedWith) {
  Json far = Cameras(), near = Cameras(), npy = Cameras();
  far["views"][2]["cam_from_world"][0][3] = 1e300;
  for (Json& view : near["views"]) {
    for (int row = 0; row < 3; ++row) {
      const double length = view["cam_from_world"][static_cast<size_t>(row)][3].get<double>();
      view["cam_from_world"][static_cast<size_t>(row)][3] = 1e-150 * length;
    }
  }
  const std::string depth = Folder("depth");
  fs::copy(Shared("courtyard/depth"), depth, fs::copy_options::recursive);
  fs::remove(In("depth/0001.exr"));
  Grid<float> numbers(kCourtyardWidthPx, kCourtyardHeightPx, 1, 2.0F);
  numbers(5, 3) = 3e38F;
  io::WriteNpy(In("depth/0001.npy"), numbers);
  npy["views"][1]["depth"] = "0001.npy";
  const auto import = [&](const Json& cameras, std::vector<std::string> further) {
    further.insert(further.begin(), {"import", "--cameras", Write("cameras.json", cameras.dump()),
                                     "--images", Photos(), "-o", In("set.dtr")});
    return Dtr(further);
  };
  ExpectRejected(import(far, {"--depth", Shared("courtyard/depth")}), kFailed,
                 "units from the origin, cannot be computed with");
  ExpectRejected(import(near, {"--depth", Shared("courtyard/depth")}), kFailed,
                 "units of each other, cannot be computed with; give positions");
  const Ran sky = import(npy, {"--depth", depth});
  ExpectRejected(sky, kFailed, "cannot be computed with; give depths from");
  EXPECT_NE(sky.err.find("depth/0001.npy: its depth of 3e+38 units at pixel (5, 3) cannot"),
            std::string::npos);
  ExpectRejected(
      import(Cameras(), {"--depth", Shared("courtyard/depth"), "--depth-unit", "1e-150"}),
      kWrongUsage, "with which can be computed");
  EXPECT_FALSE(fs::exists(In("set.dtr")));
}

// Of cameras whose file names no masks they are found by the photos' names, beside the photos, too.
TEST_F(Rejections, MasksThatNoFileNamesAreFound) {
  Mask mask(kCourtyardWidthPx, kCourtyardHeightPx, 1, 255);
  mask(3, 4) = 0;
  const std::string masks = Folder("masks");
  io::WriteMask(In("masks/0002.png"), mask);
  io::WriteMask(In("masks/0003.jpg.png"), mask);
  io::WriteMask(In("masks/0004_mask.png"), mask);
  const std::string photos = Folder("both");
  fs::copy(Photos(), photos, fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  io::WriteMask(In("both/0001_mask.png"), mask);
  const auto masked = [&](const std::string& images, const std::string& from,
                          const std::string& name) {
    const std::string set = In(name);
    DtrOk({"import", "--cameras", Shared("courtyard/sparse"), "--images", images, "--masks", from,
           "-o", set});
    std::string found;
    const DtrSet read = io::ReadSet(set);
    for (const View& view : read.frames.front().views) {
      if (view.mask_file) found += view.name + " ";
    }
    return found;
  };
  EXPECT_EQ(masked(Photos(), masks, "a.dtr"), "0002.jpg 0003.jpg 0004.jpg ");
  EXPECT_EQ(masked(photos, photos, "b.dtr"), "0001.jpg ");
}

TEST_F(Rejections, CamerasOfOtherProgramsThatAreNone) {
  const auto import = [&](const std::string& cameras) {
    return std::vector<std::string>{"import", "--cameras", cameras,      "--images",
                                    Photos(), "-o",        In("set.dtr")};
  };
  Json twice = Cameras(), skewed = Cameras();
  twice["views"][1]["name"] = "0000.jpg";
  skewed["views"][0]["cam_from_world"][0][0] = 5;
  const std::string frame = R"("file_path": "0000.jpg", "transform_matrix": )"
                            "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";
  ExpectAllRejected({
      {kFailed, "views: expected a list of at least one camera, found another",
       import(Write("none.json", R"({"views": []})"))},
      {kFailed, "views[1].name: expected unique names, found \"0000.jpg\" twice",
       import(Write("twice.json", twice.dump()))},
      {kFailed, "expected a rotation matrix (R^T R = I to",
       import(Write("skewed.json", skewed.dump()))},
      {kFailed, "frames: expected a list of at least one camera, found another",
       import(Write("transforms.json", R"({"frames": []})"))},
      {kFailed, "is none of the perspective and fisheye cameras that can be undistorted",
       import(Write(
           "transforms_sphere.json",
           R"({"camera_model": "EQUIRECTANGULAR", "fl_x": 150, "frames": [{)" + frame + "}]}"))},
      {kFailed, "expected fl_x or camera_angle_x, found neither",
       import(Write("transforms_focal.json", R"({"frames": [{)" + frame + "}]}"))},
      {kFailed, "expected a .npy file (it begins with \\x93NUMPY), found another",
       import(Write("poses_bounds.npy", "0 1 2"))},
  });
}

}  // namespace
}  // namespace dtr::testing
