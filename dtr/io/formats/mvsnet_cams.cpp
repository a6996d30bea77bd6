#include <fmt/format.h>

#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/io/formats/foreign_readers.h"
#include "dtr/io/formats/json_tree.h"
#include "dtr/io/formats/pose_from_matrix.h"
#include "dtr/io/formats/text_cameras.h"
#include "dtr/io/formats/text_numbers.h"
#include "dtr/io/formats/world_facts.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

constexpr char kEnd[] = "_cam.txt";

// Names of the files NNNNNNNN_cam.txt, in byte order.
std::vector<std::string> CamFiles(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entries(folder, error); !error && entries != fs::directory_iterator();
       entries.increment(error)) {
    const std::string name = entries->path().filename().string();
    if (name.ends_with(kEnd) && entries->is_regular_file()) names.push_back(name);
  }
  if (error) throw Error(folder.string() + ": cannot be listed: " + error.message());
  std::sort(names.begin(), names.end());
  return names;
}

void ExpectWord(internal::TextNumbers& text, const char* word) {
  if (text.Word(word) != word) {
    throw Error(text.Where() + "expected '" + word + "', found another word");
  }
}

ForeignCamera ReadCam(const fs::path& file) {
  internal::TextNumbers text(file);
  ExpectWord(text, "extrinsic");
  const Eigen::Matrix4d extrinsic = text.Matrix4("a 4x4 pose");
  ExpectWord(text, "intrinsic");
  const Eigen::Matrix3d k = text.Matrix3("a calibration matrix");
  // Depth range: 2 to 4 numbers, of which nothing here is made.
  text.Number("the least depth");
  text.Number("the depth interval");
  for (int i = 0; i < 2 && !text.AtEnd(); ++i) text.Number("a depth");
  text.ExpectEnd();
  ForeignCamera camera;
  camera.entry = file.filename().string();
  camera.path = camera.entry.substr(0, camera.entry.size() - std::size(kEnd) + 1);
  const PinholeCamera pinhole = CameraFromK(k, 1, 1, PixelOrigin::kCorner, file.string());
  camera.intrinsics.lens = {"PINHOLE",
                            {pinhole.fx_px(), pinhole.fy_px(), pinhole.cx_px(), pinhole.cy_px()}};
  camera.cam_from_world = PoseFromMatrix(extrinsic, kPrintedRotationTolerance, file.string());
  return camera;
}

}  // namespace

ForeignScene ReadMvsnetFolder(const fs::path& folder) {
  const fs::path cams = fs::is_directory(folder / "cams") ? folder / "cams" : folder;
  const std::vector<std::string> names = CamFiles(cams);
  if (names.empty()) {
    throw Error(cams.string() + ": expected files NNNNNNNN_cam.txt, found none");
  }
  ForeignScene scene;
  for (const std::string& name : names) scene.cameras.push_back(ReadCam(cams / name));
  scene.notes.push_back(cams.string() + ": its depth ranges are not used");
  for (const fs::path& beside : {folder / "dtr.json", folder / ".." / "dtr.json"}) {
    if (!fs::is_regular_file(beside)) continue;
    internal::ReadWorldFacts(internal::ReadTree(beside), beside.string(), scene);
    break;
  }
  return scene;
}

}  // namespace dtr::io
