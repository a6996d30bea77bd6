// read_openmvs FOLDER: scene.mvs and the .dmap files of a folder, read and projected by OpenMVS'
// own header (libs/MVS/Interface.h of its source), as JSON. Built by hand or by the test, not by
// CMake. Pixels are printed with the centre of the first at 0.5; OpenMVS has it at 0.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#define _USE_OPENCV  // the header's own types lack functions that it calls
#include "Interface.h"

namespace {

using Platform = MVS::Interface::Platform;

template <typename T>
std::vector<T> Several(std::istream& file, std::size_t count) {
  std::vector<T> values(count);
  file.read(reinterpret_cast<char*>(values.data()),
            static_cast<std::streamsize>(count * sizeof(T)));
  return values;
}

template <typename T>
T Next(std::istream& file) {
  return Several<T>(file, 1)[0];
}

// Pixel and point of every third pixel with depth.
void PrintDepth(const std::string& name) {
  std::ifstream file(name, std::ios::binary);
  const auto header = Next<MVS::HeaderDepthDataRaw>(file);
  const bool known = header.name == MVS::HeaderDepthDataRaw::HeaderDepthDataRawName();
  Several<char>(file, Next<std::uint16_t>(file));
  const auto ids = Several<std::uint32_t>(file, Next<std::uint32_t>(file));
  const auto k_image = Next<MVS::Interface::Mat33d>(file);
  const Platform::Pose pose{Next<MVS::Interface::Mat33d>(file), Next<MVS::Interface::Pos3d>(file)};
  const std::size_t width = header.depthWidth, count = width * header.depthHeight;
  const auto depth = Several<float>(file, count);
  Several<float>(file, 4 * count);  // normals and confidence
  const bool whole = file.good() && file.peek() == EOF;
  const double scale = static_cast<double>(width) / header.imageWidth;
  const auto k = Platform::ScaleK(k_image, scale);
  std::printf("{\"known\": %d, \"whole\": %d, \"image\": %u, \"points\": [", known, whole,
              ids.at(0));
  const char* comma = "";
  for (std::size_t i = 0; i < count; i += 3) {
    const double z = depth[i];
    if (!(z > 0)) continue;
    const double u = static_cast<double>(i % width), v = static_cast<double>(i / width);
    const auto p =
        pose / MVS::Interface::Pos3d((u - k(0, 2)) / k(0, 0) * z, (v - k(1, 2)) / k(1, 1) * z, z);
    std::printf("%s[%.17g, %.17g, %.17g, %.17g, %.17g]", comma, (u + 0.5) / scale,
                (v + 0.5) / scale, p.x, p.y, p.z);
    comma = ", ";
  }
  std::printf("]}");
}

void PrintVertex(const MVS::Interface& scene, const MVS::Interface::Vertex& vertex) {
  std::printf("{\"point\": [%.9g, %.9g, %.9g], \"seen\": [", vertex.X.x, vertex.X.y, vertex.X.z);
  const char* comma = "";
  for (const auto& view : vertex.views) {
    const auto& image = scene.images.at(view.imageID);
    const Platform& platform = scene.platforms.at(image.platformID);
    const auto pose = platform.GetPose(image.cameraID, image.poseID);
    const auto pixel = platform.cameras.at(image.cameraID) *
                       (pose * MVS::Interface::Pos3d(vertex.X.x, vertex.X.y, vertex.X.z));
    std::printf("%s[%u, %.17g, %.17g]", comma, view.imageID, pixel.x + 0.5, pixel.y + 0.5);
    comma = ", ";
  }
  std::printf("]}");
}

}  // namespace

int main(int, char** arguments) {
  const std::string folder = arguments[1];
  MVS::Interface scene;
  std::uint32_t version = 0;
  if (!MVS::ARCHIVE::SerializeLoad(scene, folder + "/scene.mvs", &version)) return 1;
  std::printf("{\"version\": %u, \"images\": [", version);
  for (std::size_t i = 0; i < scene.images.size(); ++i)
    std::printf("%s\"%s\"", i ? ", " : "", scene.images[i].name.c_str());
  std::printf("], \"vertices\": [");
  for (std::size_t i = 0; i < scene.vertices.size(); ++i) {
    if (i) std::printf(", ");
    PrintVertex(scene, scene.vertices[i]);
  }
  std::printf("], \"depth\": [");
  for (std::size_t i = 0; i < scene.images.size(); ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "/depth%04zu.dmap", i);
    if (i) std::printf(", ");
    PrintDepth(folder + name);
  }
  std::printf("]}\n");
}
