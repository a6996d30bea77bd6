// python/core/unlocked.h -- work without Python's lock (GIL), also where the interpreter ends
// meanwhile.
//
// A daemon thread may be anywhere when the interpreter ends. Once it is ending, Python ends every
// other thread that takes the lock, in the middle of our frames (pthread_exit; from Python 3.14 on
// it stops them). So nothing of ours takes the lock from then on: running work is asked to stop,
// its threads stay where they are, and the process ends without destructors of static objects,
// which those threads may use.
#pragma once
#include <pybind11/pybind11.h>

#include <atomic>
#include <functional>
#include <thread>

namespace dtr::python {

/// From now on the end of the interpreter is as above. Called once, with the lock.
void WatchEndOfInterpreter();

/// Releases Python's lock while it lives; in place of pybind11's gil_scoped_release.
class Unlocked {
 public:
  /// `stop`, where given, becomes true when the interpreter ends before this does.
  explicit Unlocked(std::atomic<bool>* stop = nullptr);
  /// Takes the lock again. Does not return where the interpreter ends on another thread.
  ~Unlocked();
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

 private:
  friend struct UnlockedThreads;
  std::atomic<bool>* const stop_;
  std::atomic<bool> stays_behind_ = false;
  PyThreadState* thread_;
};

/// Calls `function` with Python's lock, from any thread, for work that `beginner` waits for in
/// Unlocked or does with the lock. Not called where the interpreter ends without waiting for that
/// thread. `function` calls Python by its C API alone: no exception leaves it, and nothing in it
/// has a destructor, since Python may end the thread inside of it.
void CallLocked(std::thread::id beginner, const std::function<void()>& function);

}  // namespace dtr::python
