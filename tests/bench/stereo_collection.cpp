// tests/bench/stereo_collection.cpp -- what does a stereo engine make of a real collection?
//
//   stereo_collection MODEL IMAGES OUT [--engine NAME] [--neighbours K] [--agree N]
//   [--every N]
//
// MODEL is a COLMAP model of PINHOLE cameras (undistorted photos), IMAGES their folder. Writes
// OUT/NAME.exr (z-depth) and OUT/NAME.png (closer is brighter), and prints seconds and shares.
// Score against truth: ../shared/tools/score_depth.py ../shared/data/plaza OUT
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>

#include "calib/colmap/model_io.h"
#include "stereo/depth_maps.h"

namespace {

namespace fs = std::filesystem;
using namespace dtr;

class TerminalProgress final : public Progress {
 public:
  void Stage(const std::string& name, int total) override {
    fmt::print(stderr, "{}: {} items\n", name, total);
  }
  void Update(int) override {}
  void Note(const std::string& line) override { fmt::print(stderr, "note: {}\n", line); }
};

ImageRgb8 ReadRgb(const fs::path& file) {
  const auto input = OIIO::ImageInput::open(file.string());
  if (!input) throw Error(file.string() + ": cannot be read");
  ImageRgb8 image(input->spec().width, input->spec().height, 3);
  input->read_image(0, 0, 0, 3, OIIO::TypeDesc::UINT8, image.row(0));
  return image;
}

template <typename T>
void Write(const fs::path& file, const Grid<T>& grid, OIIO::TypeDesc type) {
  const auto output = OIIO::ImageOutput::create(file.string());
  OIIO::ImageSpec spec(grid.width(), grid.height(), 1, type);
  spec.channelnames = {"Y"};
  if (!output || !output->open(file.string(), spec) || !output->write_image(type, grid.row(0)) ||
      !output->close()) {
    throw Error(file.string() + ": cannot be written");
  }
}

/// Brightness linear in inverse depth over the range; holes black.
Grid<std::uint8_t> Shown(const DepthImage& depth, const stereo::DepthRange& range) {
  Grid<std::uint8_t> shown(depth.width(), depth.height());
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      if (DepthImage::IsHole(depth(x, y))) continue;
      const double t = (1 / depth(x, y) - 1 / range.far_z) / (1 / range.near_z - 1 / range.far_z);
      shown(x, y) = static_cast<std::uint8_t>(40 + 215 * std::clamp(std::sqrt(t), 0.0, 1.0));
    }
  }
  return shown;
}

struct Collection {
  std::vector<std::string> names;
  std::vector<ImageRgb8> images;
  std::vector<stereo::StereoView> views;
  SparseScene scene;
};

Collection Load(const fs::path& model_folder, const fs::path& images) {
  const calib::SfmModel model = colmap::ReadModel(model_folder);
  Collection c;
  std::map<std::uint64_t, int> index_of;
  for (const auto& [id, point] : model.points) {
    index_of[id] = static_cast<int>(c.scene.points.size());
    c.scene.points.push_back({point.p_in_world});
  }
  for (const calib::SfmImage& image : model.images) {
    const int view = static_cast<int>(c.names.size());
    c.names.push_back(fs::path(image.name).stem().string());
    c.images.push_back(ReadRgb(images / image.name));
    const calib::LensCamera& lens = model.cameras.at(image.camera_id);
    if (!lens.IsUndistorted()) throw Error(image.name + ": expected an undistorted camera");
    c.views.push_back({lens.Pinhole(), image.cam_from_world, nullptr, nullptr});
    for (const calib::SfmFeature& f : image.features) {
      if (f.point_id != calib::SfmFeature::kNoPoint) {
        c.scene.observations.push_back({view, index_of.at(f.point_id), f.pixel});
      }
    }
  }
  for (size_t i = 0; i < c.views.size(); ++i) c.views[i].image = &c.images[i];
  return c;
}

void Run(int argc, char** argv) {
  if (argc < 4) throw UsageError("usage: stereo_collection MODEL IMAGES OUT [--option value ...]");
  std::map<std::string, std::string> given;
  for (int i = 4; i + 1 < argc; i += 2) given[argv[i]] = argv[i + 1];
  const auto number = [&](const std::string& name, int otherwise) {
    return given.count(name) ? std::stoi(given[name]) : otherwise;
  };
  const fs::path out = argv[3];
  fs::create_directories(out);
  const Collection c = Load(argv[1], argv[2]);
  stereo::DepthMapsOptions options;
  options.consistency.min_agreeing = number("--agree", options.consistency.min_agreeing);
  const int every = number("--every", 1);
  const auto engine = stereo::MakeEngine(given.count("--engine") ? given["--engine"] : "sgbm");
  options.neighbours.count = number("--neighbours", engine->Neighbours());
  TerminalProgress progress;
  const auto start = std::chrono::steady_clock::now();
  stereo::ComputeDepthMaps(
      c.views, c.scene, *engine, options, progress, [&](int view) { return view % every != 0; },
      [&](int view, stereo::DepthEstimate&& estimate, const stereo::DepthRange& range) {
        const auto& name = c.names[static_cast<size_t>(view)];
        size_t kept = 0;
        for (const float z : estimate.depth.grid().data()) kept += !DepthImage::IsHole(z);
        fmt::print("{}: {:.1f} % with depth, range {:.3g} to {:.3g}\n", name,
                   100.0 * static_cast<double>(kept) /
                       static_cast<double>(estimate.depth.grid().data().size()),
                   range.near_z, range.far_z);
        Write(out / (name + ".exr"), estimate.depth.grid(), OIIO::TypeDesc::FLOAT);
        fs::create_directories(out / "sigma");
        Write(out / "sigma" / (name + ".exr"), estimate.inverse_depth_sigma, OIIO::TypeDesc::FLOAT);
        fs::create_directories(out / "shown");
        Write(out / "shown" / (name + ".png"), Shown(estimate.depth, range), OIIO::TypeDesc::UINT8);
      });
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  fmt::print("{} views in {:.1f} s\n", c.views.size(), seconds.count());
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Run(argc, argv);
    return 0;
  } catch (const dtr::UsageError& error) {
    std::cerr << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
