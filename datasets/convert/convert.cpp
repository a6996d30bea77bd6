#include "datasets/convert/convert.h"

#include <algorithm>
#include <array>

#include "datasets/convert/converters.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/work_folder.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/image_io.h"

namespace dtr::datasets {
namespace {

namespace fs = std::filesystem;

struct Kind {
  const char* name;
  io::CameraList (*convert)(const fs::path& source, const ConvertedFolder& out);
};

constexpr std::array kKinds = {
    Kind{"fountain", ConvertFountain},
    Kind{"dtu", ConvertDtu},
    Kind{"temple", ConvertTemple},
    Kind{"lego", ConvertLego},
    Kind{"livingroom", ConvertLivingRoom},
    Kind{"7scenes", Convert7Scenes},
    Kind{"fern", ConvertFern},
    Kind{"plaza", ConvertPlaza},
};

std::string StemOf(const std::string& name) { return fs::path(name).stem().string(); }

}  // namespace

ConvertedFolder::ConvertedFolder(fs::path folder) : folder_(std::move(folder)) {
  fs::create_directories(folder_ / "images");
}

fs::path ConvertedFolder::ImageFile(const std::string& name) const {
  return folder_ / "images" / name;
}

void ConvertedFolder::CopyImage(const fs::path& from, const std::string& name) const {
  CopyFileAtomically(from, ImageFile(name));
}

std::string ConvertedFolder::WriteDepth(const std::string& name, const DepthImage& depth_z) const {
  fs::create_directories(folder_ / "depth");
  const std::string file = StemOf(name) + ".exr";
  io::WriteExr(folder_ / "depth" / file, depth_z.grid());
  return file;
}

std::string ConvertedFolder::WriteMask(const std::string& name, const Mask& mask) const {
  fs::create_directories(folder_ / "masks");
  const std::string file = StemOf(name) + ".png";
  io::WriteMask(folder_ / "masks" / file, mask);
  return file;
}

io::SizedImage ImageAt(const fs::path& folder, const std::string& name) {
  const io::ImageHeader header = io::ReadImageHeader(folder / name);
  return {name, header.width_px, header.height_px};
}

std::vector<std::string> FilesEndingIn(const fs::path& folder, const std::string& ending) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(ending)) names.push_back(name);
  }
  if (names.empty()) {
    throw Error(folder.string() + ": expected files *" + ending +
                ", found none; give the folder that holds the set's SOURCE.md");
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<std::string> ConvertibleKinds() {
  std::vector<std::string> names;
  for (const Kind& kind : kKinds) names.push_back(kind.name);
  return names;
}

void ConvertDataset(const std::string& kind, const fs::path& source, const fs::path& given_out) {
  const fs::path out = WithoutTrailingSlash(given_out);
  const auto found = std::find_if(kKinds.begin(), kKinds.end(),
                                  [&](const Kind& candidate) { return kind == candidate.name; });
  if (found == kKinds.end()) {
    std::string known;
    for (const Kind& candidate : kKinds) known += std::string(" ") + candidate.name;
    throw UsageError("dataset kind \"" + kind + "\": expected one of" + known);
  }
  if (WorkFolder::IsTaken(out, "dataset")) {
    throw UsageError(out.string() + ": exists; choose another folder or remove it");
  }
  if (!fs::is_directory(source)) {
    throw Error(source.string() + ": expected the folder of the set, found none");
  }
  WorkFolder work(WorkFolder::Of(out), "dataset");
  const io::CameraList list = found->convert(source, ConvertedFolder(work.path()));
  io::WriteCamerasJson(work.path() / "cameras.json", list);
  work.Become(out);
}

}  // namespace dtr::datasets
