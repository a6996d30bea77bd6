// Jobs of the command line, files for them, and how errors look in Python.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "cli/run_command.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/image_io.h"
#include "dtr/report/contact_sheet.h"
#include "python/core/arrays.h"
#include "python/core/caller.h"
#include "python/core/module.h"
#include "python/core/unlocked.h"

namespace dtr::python {
namespace {

void AddErrors(py::module_& module) {
  static PyObject* error_type =
      py::exception<Error>(module, "Error", PyExc_RuntimeError).release().ptr();
  static PyObject* usage_type = [&] {
    const py::object bases = py::make_tuple(py::handle(error_type), py::handle(PyExc_ValueError));
    PyObject* type = PyErr_NewException("dtr._core.UsageError", bases.ptr(), nullptr);
    if (type == nullptr) throw py::error_already_set();
    module.add_object("UsageError", type);
    return type;
  }();
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Interrupted& stopped) {
      PyErr_SetString(PyExc_KeyboardInterrupt, stopped.what());
    } catch (const UsageError& wrong) {
      PyErr_SetString(usage_type, wrong.what());
    } catch (const Error& failed) {
      PyErr_SetString(error_type, failed.what());
    } catch (const std::filesystem::filesystem_error& failed) {
      errno = failed.code().value();
      PyErr_SetFromErrnoWithFilename(PyExc_OSError, failed.path1().c_str());
    }
  });
}

cli::NamedOption OptionFrom(const std::pair<std::string, py::object>& given) {
  using Kind = cli::NamedOption::Kind;
  const auto& [name, value] = given;
  if (py::isinstance<py::bool_>(value)) {
    return {name, value.cast<bool>() ? Kind::kOn : Kind::kOff, {}};
  }
  return {name, Kind::kValues, value.cast<std::vector<std::string>>()};
}

std::pair<bool, std::string> Run(const std::vector<std::string>& words,
                                 const std::vector<std::pair<std::string, py::object>>& options,
                                 py::object progress, py::object note) {
  std::vector<cli::NamedOption> named;
  for (const auto& option : options) named.push_back(OptionFrom(option));
  Caller caller(std::move(progress), std::move(note));
  const cli::CommandResult result =
      RunFor(caller, [&](Progress& to_caller) { return cli::RunCommand(words, named, to_caller); });
  return {result.passed, result.json};
}

template <typename T>
Grid<T> GridFrom(const py::array_t<T, py::array::c_style>& array, int channels) {
  Grid<T> grid(static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)), channels);
  std::copy_n(array.data(), grid.data().size(), grid.data().begin());
  return grid;
}

void RequireShape(const py::array& array, py::ssize_t dimensions, py::ssize_t channels) {
  constexpr py::ssize_t kMaxSide = 1 << 16;
  bool fits = array.ndim() == dimensions;
  for (py::ssize_t i = 0; fits && i < 2; ++i) {
    fits = array.shape(i) >= 1 && array.shape(i) <= kMaxSide;
  }
  if (!fits || (dimensions == 3 && array.shape(2) != channels)) {
    throw UsageError("array: expected the shape of an image, found another");
  }
}

io::Mark MarkOf(bool rendered) { return rendered ? io::Mark::kRendered : io::Mark::kNone; }

void WriteImage(const std::filesystem::path& file,
                const py::array_t<std::uint8_t, py::array::c_style>& image, bool rendered) {
  RequireShape(image, 3, 3);
  const Grid<std::uint8_t> grid = GridFrom(image, 3);
  const Unlocked unlocked;
  WriteFileAtomically(file, io::EncodePng(grid, MarkOf(rendered)));
}

void WriteDepth(const std::filesystem::path& file,
                const py::array_t<float, py::array::c_style>& depth, bool rendered) {
  RequireShape(depth, 2, 1);
  const Grid<float> grid = GridFrom(depth, 1);
  const Unlocked unlocked;
  io::WriteExr(file, grid, false, MarkOf(rendered));
}

py::bytes PngOf(const py::array_t<std::uint8_t, py::array::c_style>& image) {
  RequireShape(image, 3, 3);
  const Grid<std::uint8_t> grid = GridFrom(image, 3);
  std::string png;
  {
    const Unlocked unlocked;
    png = io::EncodePng(report::Shrink(grid, kMaxNotebookPx));
  }
  return png;
}

}  // namespace

void AddJobs(py::module_& module) {
  AddErrors(module);
  module.def("run", &Run, py::arg("words"), py::arg("options"), py::arg("progress") = py::none(),
             py::arg("note") = py::none(),
             "Run a command of `dtr`; returns (passed, the text that --json writes).");
  module.def(
      "write_image", &WriteImage, py::arg("file"), py::arg("image").noconvert(),
      py::arg("rendered") = false,
      "Write an image, shape (height, width, 3), uint8 sRGB, as PNG. rendered: its file says "
      "that it is no photo, as those of `dtr render` do.");
  module.def(
      "write_depth", &WriteDepth, py::arg("file"), py::arg("depth").noconvert(),
      py::arg("rendered") = false,
      "Write a depth map, shape (height, width), float32, as EXR. rendered: as of an image.");
  module.def("png", &PngOf, py::arg("image").noconvert(),
             "The bytes of an image as PNG, at most 1024 pixels wide and high, for notebooks.");
}

}  // namespace dtr::python
