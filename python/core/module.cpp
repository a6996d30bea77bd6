// The module `dtr._core`: sets, their views and cameras, rendering. python/dtr/ is what people use.
#include "python/core/module.h"

#include <pybind11/eigen.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/formats/pose_from_matrix.h"
#include "dtr/io/image_io.h"
#include "dtr/io/pruned.h"
#include "dtr/io/set_io.h"
#include "dtr/io/small_jpeg.h"
#include "dtr/render/stored_options.h"
#include "dtr/render/time_steps.h"
#include "dtr/report/contact_sheet.h"
#include "pipeline/core/view_names.h"
#include "pipeline/render/novel_frames.h"
#include "python/core/arrays.h"
#include "python/core/caller.h"
#include "python/core/camera.h"
#include "python/core/casters.h"
#include "python/core/open_set.h"
#include "python/core/render_pool.h"
#include "python/core/unlocked.h"
#include "python/core/unproject.h"

namespace dtr::python {
namespace {

using NovelFrame = pipeline::NovelFrame;

/// A set and what draws it.
struct Set : std::enable_shared_from_this<Set> {
  explicit Set(const std::filesystem::path& set_folder)
      : folder(set_folder), open(folder), pool(folder, open.set()) {}
  std::filesystem::path folder;
  OpenSet open;
  RenderPool pool;
};

/// A view of a set, which it keeps alive.
struct SetView {
  std::shared_ptr<Set> set;
  ViewPlace at;
  const View& view() const { return set->open.view(at); }
};

}  // namespace
}  // namespace dtr::python

namespace pybind11::detail {

template <>
class type_caster<dtr::python::Set> : public dtr::python::CasterOfMade<dtr::python::Set> {};
template <>
class type_caster<dtr::python::SetView> : public dtr::python::CasterOfMade<dtr::python::SetView> {};
template <>
class type_caster<dtr::python::RenderSettings>
    : public dtr::python::CasterOfMade<dtr::python::RenderSettings> {};

}  // namespace pybind11::detail

namespace dtr::python {
namespace {

py::object BytesOf(const SetView& view, Plane plane) {
  Bytes pixels;
  {
    const Unlocked unlocked;
    pixels = view.set->open.BytesOf(view.at, plane);
  }
  return ViewOf(pixels);
}

py::object FloatsOf(const SetView& view, Plane plane) {
  Floats pixels;
  {
    const Unlocked unlocked;
    pixels = view.set->open.FloatsOf(view.at, plane);
  }
  return ViewOf(pixels);
}

/// Of a held-out view: holes.
py::object DepthOf(const SetView& view) {
  const py::object depth = FloatsOf(view, Plane::kDepth);
  if (!depth.is_none() || view.view().role != ViewRole::kHeldOut) return depth;
  const PinholeCamera camera = view.view().DepthCamera();
  return HolesOf(camera.width_px(), camera.height_px());
}

std::uintptr_t AddressOf(const SetView& view, const std::string& plane) {
  OpenSet& set = view.set->open;
  const auto address = [](const auto& grid) {
    return grid ? reinterpret_cast<std::uintptr_t>(grid->data().data()) : 0;
  };
  if (plane == "image") return address(set.BytesOf(view.at, Plane::kImage));
  if (plane == "mask") return address(set.BytesOf(view.at, Plane::kMask));
  if (plane == "depth") return address(set.FloatsOf(view.at, Plane::kDepth));
  if (plane == "completed_depth") return address(set.FloatsOf(view.at, Plane::kCompletedDepth));
  return address(set.FloatsOf(view.at, Plane::kSigma));
}

py::bytes ThumbnailOf(const SetView& view, int max_side_px) {
  constexpr int kQuality = 80, kMaxSidePx = 4096;
  if (max_side_px < 1 || max_side_px > kMaxSidePx) {
    throw UsageError("`max_side_px`: expected 1 to 4096, found " + std::to_string(max_side_px));
  }
  std::string jpeg;
  {
    const Unlocked unlocked;
    const Bytes image = view.set->open.BytesOf(view.at, Plane::kImage);
    if (image) jpeg = io::SmallJpeg(report::Shrink(*image, max_side_px), kQuality);
  }
  return jpeg;
}

py::object PngOf(const SetView& view) {
  std::string png;
  {
    const Unlocked unlocked;
    const Bytes image = view.set->open.BytesOf(view.at, Plane::kImage);
    if (image) png = io::EncodePng(report::Shrink(*image, kMaxNotebookPx));
  }
  if (png.empty()) return py::none();
  return py::bytes(png);
}

[[noreturn]] py::object RejectPickling(const SetView& /*view*/, int /*protocol*/) {
  throw py::type_error(
      "View: a view is part of an open set and cannot be pickled; pass the set's `path` and the "
      "view's `name`, and open it there: dtr.load(path)[name]");
}

py::dict UnprojectView(const SetView& view, bool completed) {
  Unprojected all;
  {
    const Unlocked unlocked;
    all = Unproject(view.set->open, view.at, completed);
  }
  py::dict points;
  points["points"] = ArrayOf(std::move(all.points), 3);
  points["colours"] = ArrayOf(std::move(all.rgb), 3);
  points["sigma"] = ArrayOf(std::move(all.sigma));
  points["directions"] = ArrayOf(std::move(all.directions), 3);
  points["pixels"] = ArrayOf(std::move(all.pixels), 2);
  points["completed"] = ArrayOf(std::move(all.completed), 1, py::dtype::of<bool>());
  return points;
}

// ---- cameras

NovelFrame CameraOf(const SetView& view) {
  return {view.view().id, view.view().camera, view.view().cam_from_world};
}

std::vector<NovelFrame> CamerasOf(const Set& set, pipeline::NovelCameraRequest request,
                                  size_t time_step, py::object note) {
  request.load_depth = pipeline::DepthLoaderOf(set.folder);
  Caller caller(py::none(), std::move(note));
  std::vector<std::string> notes;
  std::vector<NovelFrame> cameras;
  {
    const Unlocked unlocked;
    cameras = pipeline::NovelFrames(AtFrame(set.open.set(), time_step), request, &notes);
  }
  for (const std::string& line : notes) caller.Note(line);
  caller.Raise();
  return cameras;
}

// ---- sets

std::shared_ptr<Set> Open(const std::filesystem::path& folder) {
  try {
    const Unlocked unlocked;
    return std::make_shared<Set>(folder);
  } catch (const Error& error) {
    if (std::error_code none; !std::filesystem::exists(folder, none)) {
      PyErr_SetString(PyExc_FileNotFoundError, error.what());
      throw py::error_already_set();
    }
    throw;
  }
}

std::vector<std::vector<SetView>> ViewsOf(Set& set) {
  std::vector<std::vector<SetView>> steps;
  const std::vector<Frame>& frames = set.open.set().frames;
  for (size_t step = 0; step < frames.size(); ++step) {
    steps.emplace_back();
    for (size_t i = 0; i < frames[step].views.size(); ++i) {
      steps.back().push_back({set.shared_from_this(), {step, i}});
    }
  }
  return steps;
}

size_t IndexOf(const Set& set, const std::string& name, size_t time_step) {
  const DtrSet step = AtFrame(set.open.set(), time_step);
  return static_cast<size_t>(&pipeline::FindView(step, name) - step.frames.front().views.data());
}

void LoadPixels(Set& set, const std::vector<std::string>& planes, int threads, py::object progress,
                py::object note) {
  std::vector<Plane> wanted;
  for (const std::string& plane : planes) {
    if (plane == "image") wanted.push_back(Plane::kImage);
    if (plane == "mask") wanted.push_back(Plane::kMask);
    if (plane == "depth") wanted.push_back(Plane::kDepth);
    if (plane == "completed_depth") wanted.push_back(Plane::kCompletedDepth);
    if (plane == "sigma") wanted.push_back(Plane::kSigma);
  }
  Caller caller(std::move(progress), std::move(note));
  RunFor(caller, [&](Progress& to_caller) {
    const ThreadLimit limit(threads);
    set.open.Load(wanted, to_caller);
  });
}

/// The set's own options of rendering with those of `json`, an object of RenderOptions' fields.
RenderOptions OptionsFrom(const DtrSet& set, const std::string& json) {
  const io::StoredRenderOptions stored = io::RenderOptionsOf(set);
  RenderOptions options = WithStoredOptions(WholeFrames(), stored.json, stored.where);
  try {
    options = WithStoredOptions(options, json, "render");
  } catch (const Error& error) {
    throw UsageError(error.what());
  }
  return options;
}

py::dict RenderImage(Set& set, const NovelFrame& camera, const std::string& options_json,
                     const RenderSettings& settings, py::object note) {
  const RenderOptions options = OptionsFrom(set.open.set(), options_json);
  Caller caller(py::none(), std::move(note));
  Rendered rendered;
  try {
    const Unlocked unlocked(caller.stop());
    rendered = set.pool.Render(camera, options, settings, caller,
                               [&](std::future<Rendered>& drawn) { caller.WaitFor(drawn); });
  } catch (...) {
    caller.Raise();
    throw;
  }
  caller.Raise();
  RenderResult& result = rendered.result;
  py::dict all;
  all["image"] = ArrayOf(std::move(result.image));
  all["depth"] = ArrayOf(std::move(result.depth.grid()));
  all["coverage"] = ArrayOf(std::move(result.coverage));
  all["view_count"] = ArrayOf(std::move(result.view_count));
  all["views_used"] = rendered.views_used;
  all["skipped"] = rendered.skipped;
  all["coverage_share"] = result.coverage_share;
  return all;
}

// ---- what Python sees

void AddView(py::module_& module) {
  py::class_<SetView>(module, "View",
                      "A view of a set: a calibrated photo and, of source views, its depth map.\n\n"
                      "Arrays are read-only and have the set's own memory; they keep their pixels\n"
                      "alive. Pixels are read from disk when they are first asked for.")
      .def_property_readonly(
          "id", [](const SetView& v) { return v.view().id; }, "Unique in its set.")
      .def_property_readonly(
          "name", [](const SetView& v) { return v.view().name; }, "The photo's name.")
      .def_property_readonly(
          "role", [](const SetView& v) { return NameOf(v.view().role); },
          "'source', or 'held_out': kept to measure with, without depth.")
      .def_property_readonly("camera", &CameraOf, "Of the image, at its place.")
      .def_property_readonly(
          "K", [](const SetView& v) { return ReadOnly(RowMajor3d(MatrixOf(v.view().camera))); },
          "(3, 3) float64 of the image's pixels, read-only.")
      .def_property_readonly(
          "depth_K",
          [](const SetView& v) { return ReadOnly(RowMajor3d(MatrixOf(v.view().DepthCamera()))); },
          "(3, 3) float64 of the depth map's pixels, read-only: K where both have one size.")
      .def_property_readonly(
          "cam_from_world",
          [](const SetView& v) {
            return ReadOnly(RowMajor4d(io::MatrixFromPose(v.view().cam_from_world)));
          },
          "(4, 4) float64, p_cam = R p_world + t, scene units, read-only.")
      .def_property_readonly(
          "size",
          [](const SetView& v) {
            return py::make_tuple(v.view().camera.width_px(), v.view().camera.height_px());
          },
          "(width, height) of the image in pixels.")
      .def_property_readonly(
          "image", [](const SetView& v) { return BytesOf(v, Plane::kImage); },
          "(height, width, 3) uint8, sRGB, top row first.")
      .def_property_readonly(
          "mask", [](const SetView& v) { return BytesOf(v, Plane::kMask); },
          "(height, width) uint8, 255 where a pixel is usable; None: all are.")
      .def_property_readonly(
          "depth", &DepthOf,
          "(height, width) float32, plane z in the camera's frame, scene units, as measured; 0 is "
          "a\n"
          "hole: all of a held-out view. None where the set has no depth. May be a whole fraction "
          "of the image's size.")
      .def_property_readonly(
          "completed_depth", [](const SetView& v) { return FloatsOf(v, Plane::kCompletedDepth); },
          "As depth, of the pixels where none was measured and renderers draw a likely surface; 0\n"
          "elsewhere. None where nothing was completed.")
      .def_property_readonly(
          "sigma", [](const SetView& v) { return FloatsOf(v, Plane::kSigma); },
          "(height, width) float32, standard deviation of 1/depth, 1/scene units; that of the "
          "depth\n"
          "is depth**2 times it. None where the set has none.")
      .def("thumbnail", &ThumbnailOf, py::arg("max_side_px") = 160,
           "The image as a small JPEG file, bytes.")
      .def("_repr_png_", &PngOf, "For notebooks: the image, at most 1024 pixels wide and high.")
      .def("__reduce_ex__", &RejectPickling)
      .def("_unproject", &UnprojectView, py::arg("completed"))
      .def("_address", &AddressOf, py::arg("plane"),
           "Where the set has these pixels in memory, for tests.")
      .def("__eq__",
           [](const SetView& a, const py::object& other) {
             if (!py::isinstance<SetView>(other)) return false;
             const auto& b = other.cast<const SetView&>();
             return a.set == b.set && a.at.time_step == b.at.time_step && a.at.view == b.at.view;
           })
      .def("__hash__",
           [](const SetView& v) {
             return py::hash(py::make_tuple(reinterpret_cast<std::uintptr_t>(v.set.get()),
                                            v.at.time_step, v.at.view));
           })
      .def("__repr__", [](const SetView& v) {
        return "<dtr.View " + v.view().name + ", " + NameOf(v.view().role) + ", " +
               std::to_string(v.view().camera.width_px()) + "x" +
               std::to_string(v.view().camera.height_px()) + ">";
      });
}

void AddSet(py::module_& module) {
  py::class_<Set, std::shared_ptr<Set>>(module, "OpenSet", "A set on disk. Use dtr.load.")
      .def(py::init(&Open), py::arg("folder"))
      .def_property_readonly("unit", [](const Set& s) { return NameOf(s.open.set().unit); })
      .def_property_readonly(
          "world_origin",
          [](const Set& s) { return ReadOnly(Eigen::Vector3d(s.open.set().world_origin)); })
      .def_property_readonly(
          "scene_center",
          [](const Set& s) { return ReadOnly(Eigen::Vector3d(s.open.set().scene_center)); })
      .def_property_readonly("validation_json",
                             [](const Set& s) { return s.open.set().validation_json; })
      .def_property_readonly("info_json", [](const Set& s) { return io::InfoJson(s.open.set()); })
      .def_property_readonly("times_s",
                             [](const Set& s) {
                               std::vector<double> times;
                               for (const Frame& f : s.open.set().frames) times.push_back(f.time_s);
                               return times;
                             })
      .def("views", &ViewsOf)
      .def("index_of", &IndexOf, py::arg("name"), py::arg("time_step"))
      .def("load_pixels", &LoadPixels, py::arg("planes"), py::arg("threads"), py::arg("progress"),
           py::arg("note"))
      .def("drop_pixels",
           [](Set& s) {
             const Unlocked unlocked;
             s.open.DropPixels();
             s.pool.Clear();
           })
      .def(
          "camera_like",
          [](const Set& s, const std::string& view, size_t time_step) {
            pipeline::NovelCameraRequest request;
            request.like = view;
            return CamerasOf(s, request, time_step, py::none()).front();
          },
          py::arg("view"), py::arg("time_step"))
      .def(
          "cameras_of_file",
          [](const Set& s, const std::filesystem::path& file, const py::object& note) {
            pipeline::NovelCameraRequest request;
            request.path_file = file;
            return CamerasOf(s, request, 0, note);
          },
          py::arg("file"), py::arg("note"))
      .def(
          "fly_through",
          [](const Set& s, int frames, const std::string& size) {
            constexpr int kMaxFrames = 100000;  // as of the command line
            if (frames < 2 || frames > kMaxFrames) {
              throw UsageError("`frames`: expected 2 to " + std::to_string(kMaxFrames) +
                               ", found " + std::to_string(frames));
            }
            pipeline::NovelCameraRequest request;
            request.fly_through_frames = frames;
            request.size = size;
            return CamerasOf(s, request, 0, py::none());
          },
          py::arg("frames"), py::arg("size"))
      .def("render", &RenderImage, py::arg("camera"), py::arg("options_json"), py::arg("settings"),
           py::arg("note"));
  py::class_<RenderSettings>(module, "RenderSettings", "What `dtr render` takes beside the camera.")
      .def(py::init<>())
      .def_readwrite("renderer", &RenderSettings::renderer)
      .def_readwrite("memory_gb", &RenderSettings::memory_gb)
      .def_readwrite("gpu_memory_gb", &RenderSettings::gpu_memory_gb)
      .def_readwrite("exclude", &RenderSettings::exclude)
      .def_readwrite("time_step", &RenderSettings::time_step)
      .def_readwrite("measured_only", &RenderSettings::measured_only)
      .def_readwrite("threads", &RenderSettings::threads);
}

}  // namespace

PYBIND11_MODULE(_core, module) {
  module.doc() = "The C++ half of the package dtr. Use `import dtr`.";
  module.attr("__version__") = DTR_VERSION;
  WatchEndOfInterpreter();
  AddJobs(module);
  AddCamera(module);
  AddView(module);
  AddSet(module);
}

}  // namespace dtr::python
