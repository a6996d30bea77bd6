// python/core/arrays.h -- our grids as numpy arrays.
#pragma once
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dtr/types/grid.h"

namespace dtr::python {

namespace py = pybind11;

/// Keeps `data` as long as Python has the capsule.
template <typename T>
py::capsule OwnerOf(std::shared_ptr<T> data) {
  auto* const owner = new std::shared_ptr<T>(std::move(data));
  return py::capsule(owner, [](void* p) { delete static_cast<std::shared_ptr<T>*>(p); });
}

inline void MakeReadOnly(py::array& array) {
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
}

/// The grid's own memory, shape (height, width) or (height, width, channels), read-only; None for
/// no grid.
template <typename T>
py::object ViewOf(const std::shared_ptr<const Grid<T>>& grid) {
  if (!grid) return py::none();
  std::vector<py::ssize_t> shape{grid->height(), grid->width()};
  if (grid->channels() > 1) shape.push_back(grid->channels());
  py::array array(py::dtype::of<T>(), shape, grid->data().data(), OwnerOf(grid));
  MakeReadOnly(array);
  return array;
}

/// A depth map of holes, read-only, which takes no memory.
inline py::array HolesOf(int width, int height) {
  static const float hole = 0;
  py::array array(py::dtype::of<float>(), std::vector<py::ssize_t>{height, width},
                  std::vector<py::ssize_t>{0, 0}, &hole, py::capsule(&hole, [](void*) {}));
  MakeReadOnly(array);
  return array;
}

/// An array that has the grid's memory and may be written to: nobody else has it.
template <typename T>
py::array ArrayOf(Grid<T> grid) {
  std::vector<py::ssize_t> shape{grid.height(), grid.width()};
  if (grid.channels() > 1) shape.push_back(grid.channels());
  auto owned = std::make_shared<Grid<T>>(std::move(grid));
  T* const data = owned->data().data();
  return py::array(py::dtype::of<T>(), shape, data, OwnerOf(std::move(owned)));
}

/// The same of a list, `columns` numbers a row; 1: one dimension. `type`: of the size of T.
template <typename T>
py::array ArrayOf(std::vector<T> values, py::ssize_t columns = 1,
                  const py::dtype& type = py::dtype::of<T>()) {
  std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(values.size()) / columns};
  if (columns > 1) shape.push_back(columns);
  auto owned = std::make_shared<std::vector<T>>(std::move(values));
  T* const data = owned->data();
  return py::array(type, shape, data, OwnerOf(std::move(owned)));
}

/// `matrix`, read-only.
template <typename Matrix>
py::object ReadOnly(const Matrix& matrix) {
  py::array array = py::cast(matrix);
  MakeReadOnly(array);
  return array;
}

}  // namespace dtr::python
