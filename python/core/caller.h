// python/core/caller.h -- long work that Python waits for: without its lock, with its Ctrl-C.
#pragma once
#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <future>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "dtr/base/progress.h"

namespace dtr::python {

namespace py = pybind11;

/// Progress for callables of Python: `on_progress(stage, done, total)` and `on_note(line)`, either
/// may be None. Made and destroyed with Python's lock (GIL); everything else is called without it.
/// What a callable raises stops the work, and is raised in the end.
class Caller final : public Progress {
 public:
  Caller(py::object on_progress, py::object on_note)
      : on_progress_(std::move(on_progress)), on_note_(std::move(on_note)) {}

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
    Call([&] { on_note_(line); });
  }

  bool StopRequested() const override { return stopped_; }

  /// Waits without Python's lock until `result` is there. Signals reach Python meanwhile: what
  /// their handlers raise (KeyboardInterrupt) stops the work.
  template <typename T>
  void WaitFor(std::future<T>& result) {
    while (result.wait_for(kInterval) != std::future_status::ready) {
      Call([] {
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      });
    }
  }

  /// With Python's lock: throws what a callable or a handler raised.
  void Raise() {
    if (raised_) throw py::error_already_set(std::move(*raised_));
  }

 private:
  static constexpr auto kInterval = std::chrono::milliseconds(50);

  void Tell(const std::string& stage, int done, int total) {
    if (on_progress_.is_none()) return;
    Call([&] { on_progress_(stage, done, total); });
  }

  template <typename Function>
  void Call(const Function& function) {
    const py::gil_scoped_acquire acquire;
    try {
      function();
    } catch (py::error_already_set& error) {
      if (!raised_) raised_.emplace(std::move(error));
      stopped_ = true;
    }
  }

  const py::object on_progress_, on_note_;
  std::mutex mutex_;
  std::string stage_;
  int total_ = 0;
  std::chrono::steady_clock::time_point next_;  // when progress is reported next
  std::atomic<bool> stopped_ = false;
  std::optional<py::error_already_set> raised_;  // with Python's lock
};

/// Runs `work(Progress&)` on a thread of its own and gives what it gives. Called with Python's
/// lock.
template <typename Work>
auto RunFor(Caller& caller, const Work& work) {
  using Result = decltype(work(std::declval<Progress&>()));
  std::future<Result> result;
  {
    const py::gil_scoped_release release;
    result = std::async(std::launch::async, [&] { return work(static_cast<Progress&>(caller)); });
    caller.WaitFor(result);
  }
  caller.Raise();  // rather than the Interrupted that it led to
  return result.get();
}

}  // namespace dtr::python
