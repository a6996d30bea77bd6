// tests/pipeline/source_programs.h -- one capture as other programs write it, and where they say
// its points are. Formulas follow each program's own description; nothing of the code under test is
// in them.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace dtr::testing {

/// A camera in axes x right, y down, z forward.
struct TrueCamera {
  std::string name;  ///< of its photo
  Eigen::Matrix3d rotation;
  Eigen::Vector3d centre;
  Eigen::Vector3d InCamera(const Eigen::Vector3d& p) const { return rotation * (p - centre); }
};

/// Five cameras around a cloud of points; photos of 640 x 480 px.
struct TrueCapture {
  static constexpr int kWidth = 640, kHeight = 480;
  std::vector<TrueCamera> cameras;
  std::vector<Eigen::Vector3d> points;
  explicit TrueCapture(int point_count = 40);
};

/// Pixel (origin in the outer corner of the first pixel) of a point in the camera frame.
using Projection = std::function<Eigen::Vector2d(const Eigen::Vector3d&)>;

/// A program's file for the capture.
struct SourceProgram {
  std::string format;          ///< that must be recognised
  std::string variant;         ///< what is special here
  std::filesystem::path file;  ///< or folder
  Projection project;
  bool points = false;  ///< the file says which photos show them
};

/// Faults that a reader could make, put into the file instead.
enum class Fault { kNone, kHalfPixel, kSwappedTangential, kFlippedAxis };

/// Writes the capture in every format below `folder`, one folder each.
std::vector<SourceProgram> WriteAllPrograms(const TrueCapture& capture,
                                            const std::filesystem::path& folder,
                                            Fault fault = Fault::kNone);

/// The same camera without distortion in formats of all kinds (focal length 500 px, principal point
/// (324, 236)).
std::vector<SourceProgram> WritePlainPrograms(const TrueCapture& capture,
                                              const std::filesystem::path& folder);

}  // namespace dtr::testing
