// python/core/module.h -- the two halves of the module `dtr._core`.
#pragma once
#include <pybind11/pybind11.h>

namespace dtr::python {

/// Errors, jobs of the command line, files.
void AddJobs(pybind11::module_& module);

}  // namespace dtr::python
