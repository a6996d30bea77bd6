// python/core/caller.h -- long work that Python waits for: without its lock, with its Ctrl-C.
#pragma once
#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "dtr/base/progress.h"
#include "python/core/unlocked.h"

namespace dtr::python {

namespace py = pybind11;

/// Progress for callables of Python: `on_progress(stage, done, total)` and `on_note(line)`, either
/// may be None. Made and destroyed with Python's lock (GIL), on the thread that waits for the work;
/// everything else is called without it. What a callable raises stops the work, and is raised in
/// the end. The end of the interpreter stops the work, too.
class Caller final : public Progress {
 public:
  Caller(py::object on_progress, py::object on_note)
      : on_progress_(std::move(on_progress)), on_note_(std::move(on_note)) {}
  ~Caller() override {
    for (PyObject* part : {raised_.type, raised_.value, raised_.traceback}) Py_XDECREF(part);
  }
  Caller(const Caller&) = delete;
  Caller& operator=(const Caller&) = delete;

  void Stage(const std::string& name, int total) override {
    {
      const std::lock_guard lock(mutex_);
      stage_ = name;
      total_ = total;
      next_ = {};
    }
    if (!name.empty()) Tell(name, 0, total);
  }

  void Update(int done) override {
    if (on_progress_.is_none()) return;
    std::string stage;
    int total = 0;
    {
      const std::lock_guard lock(mutex_);
      const auto now = std::chrono::steady_clock::now();
      if (stage_.empty() || (done < total_ && now < next_)) return;
      next_ = now + kInterval;
      stage = stage_;
      total = total_;
    }
    Tell(stage, done, total);
  }

  void Note(const std::string& line) override {
    if (on_note_.is_none()) return;
    Call([&] {
      PyObject* const text = TextOf(line);
      PyObject* const result =
          text == nullptr ? nullptr : PyObject_CallFunctionObjArgs(on_note_.ptr(), text, nullptr);
      Py_XDECREF(text);
      return result;
    });
  }

  bool StopRequested() const override { return stopped_; }

  /// For Unlocked.
  std::atomic<bool>* stop() { return &stopped_; }

  /// Waits without Python's lock until `result` is there. Signals reach Python meanwhile: what
  /// their handlers raise (KeyboardInterrupt) stops the work.
  template <typename T>
  void WaitFor(std::future<T>& result) {
    while (result.wait_for(kInterval) != std::future_status::ready) {
      Call([] {
        if (PyErr_CheckSignals() != 0) return static_cast<PyObject*>(nullptr);
        Py_INCREF(Py_None);
        return Py_None;
      });
    }
  }

  /// With Python's lock: throws what a callable or a handler raised.
  void Raise() {
    if (raised_.type == nullptr) return;
    PyErr_Restore(raised_.type, raised_.value, raised_.traceback);
    raised_ = {};
    throw py::error_already_set();
  }

 private:
  static constexpr auto kInterval = std::chrono::milliseconds(50);

  /// New; null with an error set. Names of files may be no UTF-8.
  static PyObject* TextOf(const std::string& text) {
    return PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "replace");
  }

  void Tell(const std::string& stage, int done, int total) {
    if (on_progress_.is_none()) return;
    Call([&] {
      return PyObject_CallFunction(on_progress_.ptr(), "Nii", TextOf(stage), done, total);
    });
  }

  /// `function` is one of CallLocked that gives a new object, or null with an error set.
  template <typename Function>
  void Call(const Function& function) {
    CallLocked(thread_, [&] {
      PyObject* const result = function();
      if (result == nullptr) TakeError();
      Py_XDECREF(result);
    });
  }

  /// With Python's lock.
  void TakeError() {
    stopped_ = true;
    if (raised_.type != nullptr) {
      PyErr_Clear();
    } else {
      PyErr_Fetch(&raised_.type, &raised_.value, &raised_.traceback);
    }
  }

  struct Raised {
    PyObject *type = nullptr, *value = nullptr, *traceback = nullptr;
  };

  const py::object on_progress_, on_note_;
  const std::thread::id thread_ = std::this_thread::get_id();
  std::mutex mutex_;
  std::string stage_;
  int total_ = 0;
  std::chrono::steady_clock::time_point next_;  // when progress is reported next
  std::atomic<bool> stopped_ = false;
  Raised raised_;  // with Python's lock
};

/// Runs `work(Progress&)` on a thread of its own and gives what it gives. Called with Python's
/// lock.
template <typename Work>
auto RunFor(Caller& caller, const Work& work) {
  using Result = decltype(work(std::declval<Progress&>()));
  std::future<Result> result;
  {
    const Unlocked unlocked(caller.stop());
    result = std::async(std::launch::async, [&] { return work(static_cast<Progress&>(caller)); });
    caller.WaitFor(result);
  }
  caller.Raise();  // rather than the Interrupted that it led to
  return result.get();
}

}  // namespace dtr::python
