// Sets, and the files that only sets have (docs/FORMAT.md).
#include <cmath>

#include "dtr/base/files.h"
#include "dtr/base/hash.h"
#include "dtr/io/code_differences.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/mesh_io.h"
#include "dtr/io/set_io.h"
#include "dtr/io/sparse_io.h"
#include "tests/fuzz/readers.h"
#include "tests/io/small_mesh.h"
#include "tests/io/small_set.h"

namespace dtr::fuzz {
namespace {

namespace fs = std::filesystem;
namespace small = io::testing_support;
constexpr std::uintmax_t kSeedLimitBytes = 1 << 20;
constexpr int kWidth = 24, kHeight = 18;

Reader OpenSet(const fs::path& folder) {
  const fs::path set = folder / "scene.dtr";
  small::WriteSmallSet(set);
  return {set / "set.json",
          {ReadFile(set / "set.json", kSeedLimitBytes)},
          [set] {
            const DtrSet read = io::ReadSet(set);
            // What was taken must be fit to be told of, and to be loaded or rejected.
            io::DescribeSet(read);
            io::InfoJson(read);
            io::LoadSet(set, {.sigma = true, .held_out = true});
          },
          kImageBufferBytes};
}

// Hashes and sizes of held-out files, which set.json does not tell.
Reader OpenHeldOutFiles(const fs::path& folder) {
  const fs::path set = folder / "scene.dtr", file = set / "held_out/files.json";
  small::WriteSmallSet(set);
  return {file, {ReadFile(file, kSeedLimitBytes)}, [set] { io::ReadSet(set); }};
}

// A map with holes, a step and a slope.
DepthImage SomeDepth() {
  DepthImage depth(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const float slope = 2 + 0.01f * static_cast<float>(x + y);
      depth(x, y) = x < 3 ? 0 : x > 15 ? 7 : slope;
    }
  }
  return depth;
}

Reader OpenDepth(const fs::path& folder, DepthCoding coding) {
  const io::DepthFormat format{coding, 1, 10, LengthUnit::kMetre};
  const fs::path file = folder / (std::string("depth") + io::ExtensionOf(coding));
  io::WriteDepth(file, SomeDepth(), format);
  return {file,
          {ReadFile(file, kSeedLimitBytes)},
          [=] { io::ReadDepth(file, format, kWidth, kHeight); },
          coding == DepthCoding::kZstdInverseDepth ? 0 : kImageBufferBytes};
}

template <DepthCoding coding>
Reader OpenDepthOf(const fs::path& folder) {
  return OpenDepth(folder, coding);
}

// Differences to a base that is there and whole.
Reader OpenDifferences(const fs::path& folder) {
  const io::DepthFormat format{DepthCoding::kZstdInverseDepth, 1, 10, LengthUnit::kMetre};
  const fs::path base = folder / "base.dtz", file = folder / "differences.dtd";
  io::WriteDepth(base, SomeDepth(), format);
  const auto of_base = io::ReadDepthCodes(base, format, kWidth, kHeight);
  auto codes = of_base;
  for (size_t i = 0; i < codes.data().size(); i += 5) codes.data()[i] = i % 2 == 0 ? 0 : 900;
  const std::string sha256 = Sha256OfFile(base);
  WriteFileAtomically(file, io::EncodeDifferences(codes, of_base, sha256));
  return {file, {ReadFile(file, kSeedLimitBytes)}, [=] {
            io::ReadDepth(file, format, kWidth, kHeight, io::BaseFile{base, sha256});
          }};
}

Reader OpenSigma(const fs::path& folder) {
  const fs::path file = folder / "sigma.exr";
  Grid<float> sigma(kWidth, kHeight, 1, 0.25f);
  for (size_t i = 0; i < sigma.data().size(); i += 3) sigma.data()[i] = 0;
  io::WriteSigma(file, sigma);
  return {file,
          {ReadFile(file, kSeedLimitBytes)},
          [=] { io::ReadSigma(file, kWidth, kHeight); },
          kImageBufferBytes};
}

Reader OpenSparse(const fs::path& folder) {
  const fs::path file = folder / "sparse.bin";
  SparseScene scene;
  for (int i = 0; i < 5; ++i) scene.points.push_back({{0.5 * i, 1.0 - i, 5}});
  for (int view = 0; view < 3; ++view) {
    for (int point = 0; point < 5; ++point) {
      scene.observations.push_back({view, point, {1.5 + point, 2.0 + view}});
    }
  }
  io::WriteSparse(file, scene);
  return {file, {ReadFile(file, kSeedLimitBytes)}, [=] { io::ReadSparse(file); }};
}

Reader OpenMesh(const fs::path& folder) {
  const fs::path file = folder / "mesh.bin";
  StoredMesh mesh = io::testing_support::SmallMesh();
  std::vector<std::string> seeds;
  for (const bool everything : {false, true}) {
    if (everything) {
      mesh.mask_sha256 = std::string(64, 'a');
      mesh.absolute_depth_break = 0;
    }
    io::WriteMesh(file, mesh);
    seeds.push_back(ReadFile(file, kSeedLimitBytes));
  }
  return {file, seeds, [=] { io::ReadMesh(file); }};
}

// Also what --camera and --path of `dtr render` read.
Reader OpenCamerasJson(const fs::path& folder) {
  const fs::path file = folder / "cameras.json";
  io::CameraList list;
  list.unit = LengthUnit::kMetre;
  list.world_origin = {5e5, 4.5e6, 100};
  for (int i = 0; i < 3; ++i) {
    const View view = small::SmallView(i);
    list.cameras.push_back({"left/photo " + std::to_string(i) + ".jpg", i == 1 ? "a.exr" : "",
                            i == 2 ? "m.png" : "", DepthKind::kPlaneZ, view.camera,
                            view.cam_from_world});
  }
  return {file, {io::FormatCamerasJson(list)}, [=] {
            // What was read can be kept: moved to the middle, written, and read again.
            const io::CameraList read = io::RecentreWorld(io::ReadCamerasJson(file));
            io::ParseCamerasJson(io::FormatCamerasJson(read), "again");
          }};
}

constexpr ReaderKind kReaders[] = {
    {"set", OpenSet},
    {"depth-inverse", OpenDepthOf<DepthCoding::kPng16InverseDepth>},
    {"depth-millimetre", OpenDepthOf<DepthCoding::kPng16Millimetre>},
    {"depth-float", OpenDepthOf<DepthCoding::kExrFloat>},
    {"depth-half", OpenDepthOf<DepthCoding::kExrHalf>},
    {"depth-zstd", OpenDepthOf<DepthCoding::kZstdInverseDepth>},
    {"depth-differences", OpenDifferences},
    {"held-out-files", OpenHeldOutFiles},
    {"sigma", OpenSigma},
    {"sparse", OpenSparse},
    {"mesh", OpenMesh},
    {"cameras-json", OpenCamerasJson},
};

}  // namespace

std::span<const ReaderKind> SetReaders() { return kReaders; }

}  // namespace dtr::fuzz
