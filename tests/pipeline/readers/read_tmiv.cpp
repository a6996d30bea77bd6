// read_tmiv FOLDER: sequence.json and the raw depth of its source cameras, read and put into the
// world by TMIV's own code, as JSON. Built by hand or by the test from TMIV's source, not by CMake.
// Names of files are those that TMIV's configurations ask for.
#include <TMIV/Common/Quaternion.h>
#include <TMIV/MivBitstream/DepthOccupancyTransform.h>
#include <TMIV/MivBitstream/SequenceConfig.h>
#include <TMIV/Renderer/Engine.h>

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>

using namespace TMIV;

namespace {

void PrintCamera(const std::string& folder, const MivBitstream::CameraConfig& camera) {
  const MivBitstream::ViewParams& view = camera.viewParams;
  const int width = view.ci.ci_projection_plane_width_minus1() + 1,
            height = view.ci.ci_projection_plane_height_minus1() + 1;
  const auto name = [&](const char* what, const std::string& format) {
    return fmt::format("{}/{}_{}_{}x{}_{}.yuv", folder, view.name, what, width, height, format);
  };
  std::ifstream file(name("depth", camera.geometryVideoFormat()), std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  std::ifstream texture(name("texture", camera.textureVideoFormat()),
                        std::ios::binary | std::ios::ate);
  std::printf(
      "{\"name\": \"%s\", \"occupancy\": %d, \"depth_bytes\": %zu, \"texture_bytes\": %ld, "
      "\"points\": [",
      view.name.c_str(), view.hasOccupancy, bytes.size(), static_cast<long>(texture.tellg()));
  const MivBitstream::DepthTransform transform(view.dq,
                                               static_cast<unsigned>(camera.bitDepthDepth));
  const Renderer::Engine<MivBitstream::CiCamType::perspective> engine{view.ci};
  const char* comma = "";
  for (int i = 0; i < width * height && 2 * static_cast<std::size_t>(i) + 1 < bytes.size();
       i += 3) {
    const auto byte = [&](int k) {
      return static_cast<unsigned char>(
          bytes[2 * static_cast<std::size_t>(i) + static_cast<std::size_t>(k)]);
    };
    const auto code = static_cast<std::uint16_t>(byte(0) | byte(1) << 8);
    if (view.hasOccupancy && code == 0) continue;
    const float u = static_cast<float>(i % width) + 0.5F, v = static_cast<float>(i / width) + 0.5F;
    const auto in_cam = engine.unprojectVertex({u, v}, transform.expandDepth(code));
    const auto p = rotate(Common::Vec3d(in_cam), Common::QuatD(view.ce.rotation())) +
                   Common::Vec3d(view.ce.position());
    std::printf("%s[%.9g, %.9g, %.17g, %.17g, %.17g]", comma, u, v, p.x(), p.y(), p.z());
    comma = ", ";
  }
  std::printf("]}");
}

}  // namespace

int main(int, char** arguments) {
  const std::string folder = arguments[1];
  std::ifstream file(folder + "/sequence.json");
  const MivBitstream::SequenceConfig sequence(file);
  std::printf("{\"frames\": %d, \"cameras\": [", sequence.numberOfFrames);
  const char* comma = "";
  for (const std::string& name : sequence.sourceCameraNames) {
    std::printf("%s", comma);
    PrintCamera(folder, sequence.cameraByName(name));
    comma = ", ";
  }
  std::printf("]}\n");
}
