#include "calib/models/board_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "calib/lens_map.h"

namespace dtr::calib {
namespace {

struct BoardModelFacts {
  BoardModel model;
  const char* name;
  CameraModel lens;
  int free_parameters;
  int complexity;
};

constexpr std::array<BoardModelFacts, 5> kFacts{{
    {BoardModel::kPinhole, "pinhole", CameraModel::kPinhole, 4, 0},
    {BoardModel::kBrown4, "brown4", CameraModel::kOpenCv, 8, 1},
    {BoardModel::kBrown5, "brown5", CameraModel::kFullOpenCv, 9, 2},
    {BoardModel::kBrown8, "brown8", CameraModel::kFullOpenCv, 12, 4},
    {BoardModel::kFisheye, "fisheye", CameraModel::kOpenCvFisheye, 8, 3},
}};

const BoardModelFacts& FactsOf(BoardModel model) {
  for (const BoardModelFacts& facts : kFacts) {
    if (facts.model == model) return facts;
  }
  throw std::invalid_argument("BoardModel: unknown value");
}

}  // namespace

std::string NameOf(BoardModel model) { return FactsOf(model).name; }

std::optional<BoardModel> BoardModelFromName(const std::string& name) {
  for (const BoardModelFacts& facts : kFacts) {
    if (name == facts.name) return facts.model;
  }
  return std::nullopt;
}

CameraModel CameraModelOf(BoardModel model) { return FactsOf(model).lens; }

int FreeParameterCount(BoardModel model) { return FactsOf(model).free_parameters; }

int ComplexityOf(BoardModel model) { return FactsOf(model).complexity; }

std::vector<std::string> FreeParameterNames(BoardModel model) {
  static constexpr const char* kBrown[] = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  static constexpr const char* kFisheye[] = {"k1", "k2", "k3", "k4"};
  std::vector<std::string> names{"fx_px", "fy_px", "cx_px", "cy_px"};
  const char* const* coefficients = model == BoardModel::kFisheye ? kFisheye : kBrown;
  for (int i = 4; i < FreeParameterCount(model); ++i) names.emplace_back(coefficients[i - 4]);
  return names;
}

LensCamera CameraFrom(BoardModel model, int width_px, int height_px,
                      std::span<const double> free_params) {
  if (free_params.size() != static_cast<size_t>(FreeParameterCount(model))) {
    throw std::invalid_argument("CameraFrom: " + NameOf(model) + " has " +
                                std::to_string(FreeParameterCount(model)) + " parameters, found " +
                                std::to_string(free_params.size()));
  }
  LensCamera camera{CameraModelOf(model), width_px, height_px,
                    std::vector<double>(free_params.begin(), free_params.end())};
  camera.params.resize(static_cast<size_t>(ParameterCount(camera.model)), 0.0);
  camera.Check();
  return camera;
}

namespace {

// Of a fisheye: the largest circle around the principal point that stays in the image.
double CircleRadius(const LensCamera& camera, const Eigen::Vector2d& middle) {
  return std::min(
      {middle.x(), camera.width_px - middle.x(), middle.y(), camera.height_px - middle.y()});
}

Eigen::Vector2d PrincipalPoint(const LensCamera& camera) {
  const PinholeCamera k = camera.Pinhole();
  return {k.cx_px(), k.cy_px()};
}

}  // namespace

bool IsAskedFor(const LensCamera& camera, const Eigen::Vector2d& pixel) {
  if (camera.model != CameraModel::kOpenCvFisheye) return true;
  const Eigen::Vector2d middle = PrincipalPoint(camera);
  return (pixel - middle).norm() <= CircleRadius(camera, middle);
}

bool CoversImage(const LensCamera& camera) {
  const LensMap lens(camera);
  const double w = camera.width_px, h = camera.height_px;
  std::vector<Eigen::Vector2d> places;
  if (camera.model == CameraModel::kOpenCvFisheye) {
    const Eigen::Vector2d middle = PrincipalPoint(camera);
    const double radius = CircleRadius(camera, middle);
    for (int i = 0; i < 16; ++i) {
      const double turn = i * std::numbers::pi / 8;
      places.emplace_back(middle + radius * Eigen::Vector2d(std::cos(turn), std::sin(turn)));
    }
  } else {
    // The farthest pixel is a corner; the middles of the sides are looked at for tangential terms
    // that reach far.
    for (const double x : {0.0, w / 2, w}) {
      for (const double y : {0.0, h / 2, h}) places.emplace_back(x, y);
    }
  }
  return std::all_of(places.begin(), places.end(),
                     [&](const Eigen::Vector2d& pixel) { return lens.RayFromPixel(pixel); });
}

}  // namespace dtr::calib
