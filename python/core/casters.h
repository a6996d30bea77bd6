// python/core/casters.h -- how arguments of our classes come from Python.
#pragma once
#include <pybind11/pybind11.h>

#include "pipeline/render/novel_frames.h"

namespace dtr::python {

namespace py = pybind11;

/// As pybind11's, for objects that have a value. Those of `__new__` without `__init__` have none;
/// pybind11 would give memory that nobody has written.
template <typename T>
class CasterOfMade : public py::detail::type_caster_base<T> {
 public:
  bool load(py::handle source, bool convert) {
    if (py::isinstance<T>(source)) {
      auto* const instance = reinterpret_cast<py::detail::instance*>(source.ptr());
      const auto* const type = py::detail::get_type_info(typeid(T));
      if (instance->get_value_and_holder(type).value_ptr() == nullptr) {
        throw py::type_error(
            std::string(py::str(py::type::of(source).attr("__name__"))) +
            ": this object was never initialised; make it by its class, not by __new__, and views "
            "by dtr.load");
      }
    }
    return py::detail::type_caster_base<T>::load(source, convert);
  }
};

}  // namespace dtr::python

namespace pybind11::detail {

template <>
class type_caster<dtr::pipeline::NovelFrame>
    : public dtr::python::CasterOfMade<dtr::pipeline::NovelFrame> {};

}  // namespace pybind11::detail
