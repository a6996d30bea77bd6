// Advice that a rejection gives leads to the goal: each row is rejected, does what the line says,
// and is then done.
#include <functional>

#include "dtr/io/depth_io.h"
#include "dtr/io/image_io.h"
#include "tests/cli/refusals.h"

namespace dtr::testing {
namespace {

struct Advised {
  int code;
  std::string advice;                ///< that the line must hold
  std::vector<std::string> refused;  ///< what was asked
  std::function<void()> follow;      ///< what the line says to do, apart from other options
  std::vector<std::string> done;     ///< what is asked then
};

void ExpectAllLeadToTheGoal(const std::vector<Advised>& rows) {
  for (const Advised& row : rows) {
    SCOPED_TRACE(fmt::format("dtr {}", fmt::join(row.refused, " ")));
    ExpectRejected(Dtr(row.refused), row.code, row.advice);
    if (row.follow) row.follow();
    DtrOk(row.done);
  }
}

class Advice : public Rejections {
 protected:
  std::string NewSet() { return In(fmt::format("{}.dtr", sets_++)); }
  std::vector<std::string> Import(const std::string& cameras, const std::string& images,
                                  std::vector<std::string> further = {}) {
    std::vector<std::string> args = {"import", "--cameras", cameras, "--images",
                                     images,   "-o",        NewSet()};
    args.insert(args.end(), further.begin(), further.end());
    return args;
  }
  // The photos of the courtyard, to be changed.
  std::string CopyOfPhotos(const std::string& name) {
    fs::copy(Photos(), Folder(name),
             fs::copy_options::recursive | fs::copy_options::overwrite_existing);
    return In(name);
  }
  // The courtyard's cameras as a transforms.json with further fields in front of the frames.
  std::string Transforms(const std::string& name, const Json& fields) {
    Json file = fields;
    const Json cameras = Cameras();
    for (const Json& view : cameras["views"]) {
      Json frame = {{"file_path", view["name"]}, {"w", view["width"]}, {"h", view["height"]},
                    {"fl_x", view["fx"]},        {"fl_y", view["fy"]}, {"cx", view["cx"]},
                    {"cy", view["cy"]}};
      // cam_from_world with axes y, z turned, inverted: R^T, -R^T t.
      const Json& m = view["cam_from_world"];
      for (size_t i = 0; i < 3; ++i) {
        double t = 0;
        for (size_t k = 0; k < 3; ++k) t -= m[k][i].get<double>() * m[k][3].get<double>();
        frame["transform_matrix"].push_back(
            {m[0][i], -m[1][i].get<double>(), -m[2][i].get<double>(), t});
      }
      frame["transform_matrix"].push_back({0, 0, 0, 1});
      frame["depth_file_path"] = view["depth"];
      file["frames"].push_back(frame);
    }
    return Write(name, file.dump());
  }
  std::string Depth() const { return Shared("courtyard/depth"); }

  int sets_ = 0;
};

TEST_F(Advice, OfImportsOfPhotosLeadsToTheGoal) {
  const std::string cameras = Shared("courtyard/cameras.json"), sparse = Shared("courtyard/sparse");
  const std::string photos = CopyOfPhotos("photos"), empty = Folder("empty"),
                    nothing = Folder("nothing");
  fs::remove(In("photos/0003.jpg"));
  Write("poses.list", "0000.jpg 1 2 3\n");
  ExpectAllLeadToTheGoal({
      {kFailed,
       "give --allow-missing to leave such cameras out",
       Import(cameras, photos, {"--depth", Depth()}),
       {},
       Import(cameras, photos, {"--depth", Depth(), "--allow-missing"})},
      {kFailed, "copy the photos there", Import(sparse, photos),
       [&] { fs::copy(Photos() + "/0003.jpg", In("photos/0003.jpg")); }, Import(sparse, photos)},
      {kFailed,
       "give the folder of its photos",
       Import(sparse, empty),
       {},
       Import(sparse, Photos())},
      {kWrongUsage, "not recognised; what can be read (its --format)",
       Import(In("poses.list"), Photos(), {"--depth", Depth()}),
       [&] { fs::copy(cameras, In("poses.list"), fs::copy_options::overwrite_existing); },
       Import(In("poses.list"), Photos(), {"--depth", Depth()})},
      {kWrongUsage, "expected a mask of 0000.jpg or of another photo, called 0000.png",
       Import(sparse, Photos(), {"--masks", empty}),
       [&] {
         io::WriteMask(In("empty/0000.png"), Mask(kCourtyardWidthPx, kCourtyardHeightPx, 1, 255));
       },
       Import(sparse, Photos(), {"--masks", empty})},
      {kFailed,
       "give the folder whose maps are named like the photos",
       Import(sparse, Photos(), {"--depth", nothing}),
       {},
       Import(sparse, Photos(), {"--depth", Depth()})},
      {kWrongUsage,
       "expected no such folder yet, found one; choose another name or pass --force",
       {"import", "--cameras", sparse, "--images", Photos(), "-o", In("1.dtr")},
       {},
       {"import", "--cameras", sparse, "--images", Photos(), "-o", In("1.dtr"), "--force"}},
  });
}

TEST_F(Advice, OfDepthInWholeNumbersLeadsToTheGoal) {
  const std::string depth = Folder("mm");
  for (int i = 0; i < kCourtyardViews; ++i) {
    io::WritePng16(fmt::format("{}/{:04}.png", depth, i),
                   Grid<std::uint16_t>(kCourtyardWidthPx, kCourtyardHeightPx, 1, 4000));
  }
  const std::string sparse = Shared("courtyard/sparse");
  ExpectAllLeadToTheGoal({{kWrongUsage,
                           "give it, as 0.001 for millimetres in a set in metres",
                           Import(sparse, Photos(), {"--depth", depth}),
                           {},
                           Import(sparse, Photos(), {"--depth", depth, "--depth-unit", "0.001"})}});
}

TEST_F(Advice, OfATransformsJsonLeadsToTheGoal) {
  const std::string contradicts =
      Transforms("a/transforms.json", {{"is_fisheye", true}, {"camera_model", "OPENCV"}});
  const std::string rational = Transforms("b/transforms.json", {{"k4", 0.001}});
  const std::string straight = Transforms("d/transforms.json", {});
  const std::vector<std::string> depth = {"--depth", Depth()};
  const std::string frames = In("frames");
  const auto render = [&](const std::string& option, const std::string& file) {
    return std::vector<std::string>{"render", Shared("good.dtr"), option, file, "--size",
                                    "48x32",  "--renderer",       "cpu",  "-o", frames};
  };
  ExpectAllLeadToTheGoal({
      {kFailed, "is_fisheye conflicts with camera_model OPENCV; correct one of them",
       Import(contradicts, Photos(), depth),
       [&] {
         Transforms("a/transforms.json", {{"is_fisheye", false}, {"camera_model", "OPENCV"}});
       },
       Import(contradicts, Photos(), depth)},
      {kFailed, "where OpenCV's is meant write \"camera_model\": \"FULL_OPENCV\"",
       Import(rational, Photos(), depth),
       [&] {
         Transforms("b/transforms.json", {{"k4", 0.001}, {"camera_model", "FULL_OPENCV"}});
       },
       Import(rational, Photos(), depth)},
      {kWrongUsage, "give --path for several", render("--camera", straight),
       [&] { fs::remove_all(frames); }, render("--path", straight)},
  });
}

TEST_F(Advice, OfPosesForPhotosLeadsToTheGoal) {
  const std::string pinhole = "PINHOLE 192 128 150 150 96 64";
  const std::string model = Model("names", pinhole, "a.jpg", "b.jpg");
  const std::string photos = Folder("named");
  fs::copy(Photos() + "/0000.jpg", In("named/0000.jpg"));
  fs::copy(Photos() + "/0001.jpg", In("named/0001.jpg"));
  const auto build = [&](std::vector<std::string> further) {
    further.insert(further.begin(), {"build", photos, "-o", NewSet(), "--engine", "none"});
    return further;
  };
  const auto taken = [&](std::vector<std::string> further) {
    further.insert(further.begin(), {"build", Photos(), "--engine", "none", "--poses",
                                     Shared("courtyard/sparse"), "-o", In("taken.dtr")});
    return further;
  };
  DtrOk(taken({}));
  // What such a model brings: no points, so that they would be triangulated; names are rejected
  // first.
  ExpectRejected(Dtr(build({"--poses", model})), kFailed,
                 "name the photos as it does, or give theirs");
  ExpectAllLeadToTheGoal({{kWrongUsage,
                           "choose another name or pass --force to replace it",
                           taken({}),
                           {},
                           taken({"--force"})}});
}

TEST_F(Advice, OfLensFilesLeadsToTheGoal) {
  const std::string sparse = Shared("courtyard/sparse");
  const std::string matrices = "K: [[150, 0, 95.5], [0, 150, 63.5], [0, 0, 1]]\nD: [0, 0, 0, 0]\n";
  int models = 0;
  const auto refine = [&](const std::string& lens) {
    return std::vector<std::string>{"calibrate",
                                    "refine",
                                    sparse,
                                    "--lens",
                                    lens,
                                    "-o",
                                    In(fmt::format("refined{}", models++))};
  };
  const std::string size = "image_width: 192\nimage_height: 128\n";
  const std::string sizeless = Write("sizeless.yml", matrices);
  const std::string twice = Write("twice.yml", size + matrices + "mtx: [1]\n");
  const std::string of_chain =
      "cam0:\n  camera_model: pinhole\n  intrinsics: [150, 150, 95.5, 63.5]\n"
      "  distortion_model: radtan\n  distortion_coeffs: [0, 0, 0, 0]\n";
  const std::string chain = Write("chain.yaml", of_chain);
  const std::string two =
      Write("two.txt", "1 PINHOLE 192 128 150 150 96 64\n2 PINHOLE 192 128 150 150 96 64\n");
  ExpectAllLeadToTheGoal({
      {kFailed, "write image_width, image_height, camera_matrix", refine(sizeless),
       [&] { Write("sizeless.yml", size + matrices); }, refine(sizeless)},
      {kFailed, "may both be the camera matrix; leave the one that is meant", refine(twice),
       [&] { Write("twice.yml", size + matrices); }, refine(twice)},
      {kFailed, "cam0: expected a field resolution", refine(chain),
       [&] { Write("chain.yaml", of_chain + "  resolution: [192, 128]\n"); }, refine(chain)},
      {kFailed, "give a file with the camera that took the photos", refine(two),
       [&] { Write("two.txt", "1 PINHOLE 192 128 150 150 96 64\n"); }, refine(two)},
      {kWrongUsage,
       "expected no model yet, found one; remove it or choose another folder",
       {"calibrate", "refine", sparse, "-o", In("refined1")},
       [&] { fs::remove_all(In("refined1")); },
       {"calibrate", "refine", sparse, "-o", In("refined1")}},
  });
}

TEST_F(Advice, OfCapturesLeadsToTheGoal) {
  const std::string out = In("captured");
  const std::vector<std::string> capture = {"capture", Photos(), "-o", out};
  DtrOk(capture);
  std::vector<std::string> forced = capture;
  forced.push_back("--force");
  ExpectAllLeadToTheGoal(
      {{kWrongUsage, "choose another name or give --force", capture, {}, forced}});
}

}  // namespace
}  // namespace dtr::testing
