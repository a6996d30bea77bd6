// The class `Camera` of the module.
#include <pybind11/eigen.h>

#include <array>
#include <string>

#include "dtr/io/formats/pose_from_matrix.h"
#include "python/core/arrays.h"
#include "python/core/camera.h"
#include "python/core/casters.h"
#include "python/core/module.h"

namespace dtr::python {
namespace {

using NovelFrame = pipeline::NovelFrame;

NovelFrame MakeCamera(const Eigen::Ref<const RowMajor3d>& k,
                      const Eigen::Ref<const RowMajor4d>& cam_from_world, int width, int height,
                      const std::string& name) {
  return {name, CameraFrom(k, width, height, "Camera"), PoseFrom(cam_from_world, "Camera")};
}

/// Everything to the last bit, which the matrices do not give.
py::tuple StateOf(const NovelFrame& camera) {
  const PinholeCamera& k = camera.camera;
  const Eigen::Quaterniond& q = camera.cam_from_world.rotation;
  const Eigen::Vector3d& t = camera.cam_from_world.translation;
  return py::make_tuple(camera.name, k.width_px(), k.height_px(), k.fx_px(), k.fy_px(), k.cx_px(),
                        k.cy_px(), q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z());
}

NovelFrame CameraOfState(const py::tuple& state) {
  constexpr size_t kNumbers = 11;  // after name and size
  if (state.size() != 3 + kNumbers) throw py::value_error("Camera: not the state of a camera");
  std::array<double, kNumbers> n;
  for (size_t i = 0; i < kNumbers; ++i) n[i] = state[3 + i].cast<double>();
  Eigen::Matrix3d k;
  k << n[0], 0, n[2], 0, n[1], n[3], 0, 0, 1;
  NovelFrame camera;
  camera.name = state[0].cast<std::string>();
  camera.camera = CameraFrom(k, state[1].cast<int>(), state[2].cast<int>(), "Camera");
  camera.cam_from_world = {{n[4], n[5], n[6], n[7]}, {n[8], n[9], n[10]}};
  // Only for its checks: its rotation may be another by an ulp.
  (void)PoseFrom(io::MatrixFromPose(camera.cam_from_world), "Camera");
  return camera;
}

}  // namespace

void AddCamera(py::module_& module) {
  py::class_<NovelFrame>(module, "Camera",
                         "A pinhole camera at a place of a set's world.\n\n"
                         "K: (3, 3) float64, pixels, origin at the outer corner of the top-left\n"
                         "pixel (its centre is 0.5, 0.5). cam_from_world: (4, 4) float64,\n"
                         "p_cam = R p_world + t; axes of the camera: x right, y down, z forward;\n"
                         "scene units, relative to the set's world_origin.")
      .def(py::init(&MakeCamera), py::arg("K"), py::arg("cam_from_world"), py::arg("width"),
           py::arg("height"), py::arg("name") = "camera")
      .def_readonly("name", &NovelFrame::name, "Of the view or file that it comes from.")
      .def_property_readonly(
          "K", [](const NovelFrame& c) { return ReadOnly(RowMajor3d(MatrixOf(c.camera))); },
          "(3, 3) float64, pixels, read-only.")
      .def_property_readonly(
          "cam_from_world",
          [](const NovelFrame& c) {
            return ReadOnly(RowMajor4d(io::MatrixFromPose(c.cam_from_world)));
          },
          "(4, 4) float64, scene units, read-only.")
      .def_property_readonly(
          "size",
          [](const NovelFrame& c) {
            return py::make_tuple(c.camera.width_px(), c.camera.height_px());
          },
          "(width, height) in pixels.")
      .def(
          "resized",
          [](const NovelFrame& c, int width, int height) {
            NovelFrame resized = c;
            resized.camera =
                pipeline::WithSize(c.camera, std::to_string(width) + "x" + std::to_string(height));
            return resized;
          },
          py::arg("width"), py::arg("height"),
          "The same camera for another size of image; 0 for either side keeps the proportions.")
      .def(py::pickle(&StateOf, &CameraOfState))
      .def("__repr__", [](const NovelFrame& c) {
        return "<dtr.Camera " + c.name + ", " + std::to_string(c.camera.width_px()) + "x" +
               std::to_string(c.camera.height_px()) + ">";
      });
}

}  // namespace dtr::python
