// point_cloud SET.dtr VIEW CLOUD.ply -- a depth map as coloured points with their deviations.
#include <dtr/io/set_io.h>

#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>

namespace {
// One line for every pixel with depth: x y z red green blue sigma; lengths in the set's unit.
std::string Points(const dtr::View& view, int* count) {
  // A depth map may have 1/depth_scale of the photo's pixels; DepthCamera is that of its grid.
  const dtr::PinholeCamera camera = view.DepthCamera();
  const dtr::Pose world_from_cam = view.cam_from_world.Inverse();
  const auto& sigma = view.inverse_depth_sigma;  // of 1/z
  std::ostringstream lines;
  for (int y = 0; y < camera.height_px(); ++y) {
    for (int x = 0; x < camera.width_px(); ++x) {
      const double z = view.depth(x, y);  // along the optical axis; 0: no depth
      if (!(z > 0)) continue;
      const Eigen::Vector2d centre(x + 0.5, y + 0.5);
      const Eigen::Vector3d point =
          world_from_cam * camera.CamFromPixel(centre, z, dtr::DepthKind::kPlaneZ);
      const std::uint8_t* rgb = &view.image(view.depth_scale * x, view.depth_scale * y);
      lines << point.transpose() << ' ' << +rgb[0] << ' ' << +rgb[1] << ' ' << +rgb[2] << ' '
            << (sigma ? z * z * (*sigma)(x, y) : 0) << '\n';
      ++*count;
    }
  }
  return lines.str();
}
}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: point_cloud SET.dtr VIEW CLOUD.ply\n";
    return 2;
  }
  try {
    const dtr::DtrSet set = dtr::io::LoadSet(argv[1], {.sigma = true});
    for (const dtr::View& view : set.frames.front().views) {
      if (!dtr::IsCalled(view.name, argv[2]) || view.depth.empty()) continue;
      int count = 0;
      const std::string points = Points(view, &count);
      std::ofstream file(argv[3]);
      file << "ply\nformat ascii 1.0\nelement vertex " << count
           << "\nproperty float x\nproperty float y\nproperty float z\n"
              "property uchar red\nproperty uchar green\nproperty uchar blue\n"
              "property float sigma\nend_header\n"
           << points << std::flush;
      if (!file) throw std::runtime_error(argv[3] + std::string(": cannot be written"));
      std::cout << argv[3] << ": " << count << " points\n";
      return 0;
    }
    throw std::runtime_error(argv[2] + std::string(": no view with depth is called so"));
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
