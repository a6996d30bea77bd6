// python/core/module.h -- parts of the module `dtr._core`.
#pragma once
#include <pybind11/pybind11.h>

namespace dtr::python {

/// Sides of images in notebooks, which store them in the page.
inline constexpr int kMaxNotebookPx = 1024;

/// Errors, jobs of the command line, files.
void AddJobs(pybind11::module_& module);
void AddCamera(pybind11::module_& module);

}  // namespace dtr::python
