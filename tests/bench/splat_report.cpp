// splat_report: exported 3D Gaussians (.ply) against the held-out photos of their set, drawn by a
// rasteriser that shares nothing with the export: the formulas of Kerbl et al. 2023, sections 4 and
// 6 (EWA footprint + 0.3 px^2, opacity at most 0.99, front to back, all of an image in one order).
// docs/EXPORT.md has the figures.
//
//   splat_report SET.dtr SPLATS.ply [FOLDER for images]
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "tests/pipeline/read_ply.h"

namespace {

constexpr float kNearest = 0.05F;  // z
constexpr float kBlur = 0.3F;      // px^2
constexpr float kMostOpaque = 0.99F, kLeastOpaque = 1 / 255.0F, kEnough = 1e-4F;
constexpr float kMostRadius = 60;  // px
constexpr float kDegreeZero = 0.28209479F;

struct Gaussian {
  Eigen::Vector3f p_in_world;
  Eigen::Matrix3f covariance;
  Eigen::Array3f rgb;
  float opacity = 0;
};

std::vector<Gaussian> ReadGaussians(const std::string& file) {
  const dtr::testing::Ply ply = dtr::testing::ReadPly(file);
  std::vector<Gaussian> gaussians(ply.count);
  const auto at = [&](const char* name, size_t i) { return static_cast<float>(ply[name][i]); };
  for (size_t i = 0; i < ply.count; ++i) {
    Gaussian& g = gaussians[i];
    g.p_in_world = {at("x", i), at("y", i), at("z", i)};
    g.rgb = 0.5F + kDegreeZero * Eigen::Array3f(at("f_dc_0", i), at("f_dc_1", i), at("f_dc_2", i));
    g.opacity = 1 / (1 + std::exp(-at("opacity", i)));
    const Eigen::Quaternionf q(at("rot_0", i), at("rot_1", i), at("rot_2", i), at("rot_3", i));
    const Eigen::Vector3f size(std::exp(at("scale_0", i)), std::exp(at("scale_1", i)),
                               std::exp(at("scale_2", i)));
    const Eigen::Matrix3f m = q.normalized().toRotationMatrix() * size.asDiagonal();
    g.covariance = m * m.transpose();
  }
  return gaussians;
}

class Canvas {
 public:
  explicit Canvas(const dtr::PinholeCamera& camera)
      : camera_(camera),
        light_(camera.width_px(), camera.height_px(), 3),
        passes_(camera.width_px(), camera.height_px(), 1, 1.0F) {}

  // One more, behind all before.
  void Draw(const Gaussian& g, const Eigen::Matrix3f& rotation, const Eigen::Vector3f& p) {
    const auto fx = static_cast<float>(camera_.fx_px()), fy = static_cast<float>(camera_.fy_px());
    const float z = p.z();
    const float u = fx * p.x() / z + static_cast<float>(camera_.cx_px());
    const float v = fy * p.y() / z + static_cast<float>(camera_.cy_px());
    Eigen::Matrix<float, 2, 3> slope;
    slope << fx / z, 0, -fx * p.x() / (z * z), 0, fy / z, -fy * p.y() / (z * z);
    const Eigen::Matrix<float, 2, 3> to_image = slope * rotation;
    Eigen::Matrix2f spread = to_image * g.covariance * to_image.transpose();
    spread.diagonal().array() += kBlur;
    if (!(spread.determinant() > 0)) return;
    const Eigen::Matrix2f inverse = spread.inverse();
    const float rx = std::min(kMostRadius, 3 * std::sqrt(spread(0, 0)));
    const float ry = std::min(kMostRadius, 3 * std::sqrt(spread(1, 1)));
    const int right = std::min(light_.width() - 1, static_cast<int>(std::floor(u + rx)));
    const int bottom = std::min(light_.height() - 1, static_cast<int>(std::floor(v + ry)));
    for (int y = std::max(0, static_cast<int>(v - ry)); y <= bottom; ++y) {
      for (int x = std::max(0, static_cast<int>(u - rx)); x <= right; ++x) {
        float& passes = passes_(x, y);
        if (passes < kEnough) continue;
        const Eigen::Vector2f d(static_cast<float>(x) + 0.5F - u, static_cast<float>(y) + 0.5F - v);
        const float alpha = std::min(kMostOpaque, g.opacity * std::exp(-0.5F * d.dot(inverse * d)));
        if (alpha < kLeastOpaque) continue;
        for (int c = 0; c < 3; ++c) light_(x, y, c) += passes * alpha * g.rgb[c];
        passes *= 1 - alpha;
      }
    }
  }

  dtr::ImageRgb8 Image() const {
    dtr::ImageRgb8 image(light_.width(), light_.height(), 3);
    std::transform(light_.data().begin(), light_.data().end(), image.data().begin(), [](float v) {
      return static_cast<std::uint8_t>(std::clamp(std::lround(255 * v), 0L, 255L));
    });
    return image;
  }

 private:
  dtr::PinholeCamera camera_;
  dtr::Grid<float> light_, passes_;
};

dtr::ImageRgb8 Rasterise(const std::vector<Gaussian>& gaussians, const dtr::View& view) {
  const Eigen::Matrix3f rotation = view.cam_from_world.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f translation = view.cam_from_world.translation.cast<float>();
  std::vector<std::pair<float, size_t>> order;
  for (size_t i = 0; i < gaussians.size(); ++i) {
    const float z = (rotation * gaussians[i].p_in_world + translation).z();
    if (z > kNearest) order.emplace_back(z, i);
  }
  std::sort(order.begin(), order.end());
  Canvas canvas(view.camera);
  for (const auto& [z, i] : order) {
    canvas.Draw(gaussians[i], rotation, rotation * gaussians[i].p_in_world + translation);
  }
  return canvas.Image();
}

// Over the pixels that the photo's mask lets count.
double PsnrDb(const dtr::ImageRgb8& image, const dtr::View& view) {
  double sum = 0, count = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (!view.mask.empty() && view.mask(x, y) == 0) continue;
      for (int c = 0; c < 3; ++c) {
        const double difference = image(x, y, c) - view.image(x, y, c);
        sum += difference * difference;
        ++count;
      }
    }
  }
  return 10 * std::log10(255 * 255 * count / sum);
}

int Run(const std::string& folder, const std::string& file, const std::string& images) {
  const std::vector<Gaussian> gaussians = ReadGaussians(file);
  dtr::DtrSet set = dtr::io::ReadSet(folder);
  double sum = 0;
  int count = 0;
  for (dtr::View& view : set.frames.at(0).views) {
    if (view.role != dtr::ViewRole::kHeldOut) continue;
    dtr::io::LoadOptions load;
    load.depth = false;
    load.held_out = true;
    dtr::io::LoadPixels(folder, view, load);
    const dtr::ImageRgb8 image = Rasterise(gaussians, view);
    const double psnr_db = PsnrDb(image, view);
    std::printf("| %s | %.2f dB |\n", view.name.c_str(), psnr_db);
    sum += psnr_db;
    ++count;
    if (!images.empty()) {
      dtr::io::WritePng(std::filesystem::path(images) / (view.id + ".png"), image);
    }
  }
  if (count == 0) {
    std::fprintf(stderr, "splat_report: %s has no held-out photos\n", folder.c_str());
    return 1;
  }
  std::printf("| mean of %d, %zu Gaussians | %.2f dB |\n", count, gaussians.size(), sum / count);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || argc > 4) {
    std::fprintf(stderr, "usage: splat_report SET.dtr SPLATS.ply [FOLDER for images]\n");
    return 2;
  }
  try {
    return Run(argv[1], argv[2], argc > 3 ? argv[3] : "");
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "splat_report: %s\n", failure.what());
    return 1;
  }
}
