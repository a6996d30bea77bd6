#include "python/core/unlocked.h"

#include <cxxabi.h>
#include <pthread.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <set>

namespace dtr::python {

namespace py = pybind11;

/// All that are unlocked. Never destroyed: threads that stay behind may come back to it.
struct UnlockedThreads {
  std::mutex mutex;
  std::set<Unlocked*> all;
  bool ending = false;
  bool forked = false;   ///< this process is a fork of the one that loaded the module
  std::thread::id ends;  ///< the thread that ends the interpreter, and may go on calling us

  static UnlockedThreads& Get() {
    static auto* const threads = new UnlockedThreads;
    return *threads;
  }

  /// Requires the mutex.
  bool EndsWithout(std::thread::id thread) const { return ending && thread != ends; }

  void AskToStop() {
    const std::lock_guard lock(mutex);
    ending = true;
    ends = std::this_thread::get_id();
    for (Unlocked* unlocked : all) {
      if (unlocked->stop_ != nullptr) *unlocked->stop_ = true;
    }
  }

  /// Whether none works any more: each has the lock, or stays behind with nothing to do.
  bool AllRest() {
    const std::lock_guard lock(mutex);
    for (const Unlocked* unlocked : all) {
      if (!unlocked->stays_behind_) return false;
    }
    return true;
  }
};

namespace {

[[noreturn]] void StayBehind() {
  for (;;) pause();
}

bool IsFinalizing() {
#if PY_VERSION_HEX >= 0x030D0000
  return Py_IsFinalizing() != 0;
#else
  return _Py_IsFinalizing() != 0;
#endif
}

/// Among Python's `atexit` functions: other threads still run, and may be waited for.
void BeforeTheEnd() {
  using std::chrono::steady_clock;
  constexpr auto kPatience = std::chrono::seconds(1);
  constexpr auto kInterval = std::chrono::milliseconds(2);
  UnlockedThreads& threads = UnlockedThreads::Get();
  threads.AskToStop();
  // Without Unlocked: this thread is the one that goes on.
  PyThreadState* const thread = PyEval_SaveThread();
  for (const auto end = steady_clock::now() + kPatience;
       !threads.AllRest() && steady_clock::now() < end;) {
    std::this_thread::sleep_for(kInterval);
  }
  PyEval_RestoreThread(thread);
}

/// The last function that the C library calls before destructors of static objects. In a forked
/// process they would wait for threads that are the parent's alone (those of log4cplus do).
void EndWithoutDestructors(int status, void*) {
  UnlockedThreads& threads = UnlockedThreads::Get();
  {
    const std::lock_guard lock(threads.mutex);
    if (threads.all.empty() && !threads.forked) return;
  }
  std::fflush(nullptr);
  _exit(status);
}

void AfterTheEnd() {
  // Functions are called in reverse order: what is registered last comes first.
  (void)on_exit(EndWithoutDestructors, nullptr);
}

void BeforeFork() { UnlockedThreads::Get().mutex.lock(); }
void AfterForkInParent() { UnlockedThreads::Get().mutex.unlock(); }
void AfterForkInChild() {
  UnlockedThreads& threads = UnlockedThreads::Get();
  threads.all.clear();  // their threads are the parent's alone
  threads.forked = true;
  threads.mutex.unlock();
}

}  // namespace

void WatchEndOfInterpreter() {
  // Finalizers delete temporary folders. The first one registers all of them with `atexit`, which
  // calls what came last first: us, so that jobs rest before their folders go.
  const auto nothing = [] {};
  py::module_::import("weakref").attr("finalize")(py::cpp_function(nothing),
                                                  py::cpp_function(nothing));
  py::module_::import("atexit").attr("register")(py::cpp_function(&BeforeTheEnd));
  if (Py_AtExit(&AfterTheEnd) != 0) AfterTheEnd();
  pthread_atfork(&BeforeFork, &AfterForkInParent, &AfterForkInChild);
}

Unlocked::Unlocked(std::atomic<bool>* stop) : stop_(stop) {
  UnlockedThreads& threads = UnlockedThreads::Get();
  {
    const std::lock_guard lock(threads.mutex);
    stays_behind_ = threads.EndsWithout(std::this_thread::get_id());
    threads.all.insert(this);
  }
  thread_ = PyEval_SaveThread();
  if (stays_behind_) StayBehind();
}

Unlocked::~Unlocked() {
  UnlockedThreads& threads = UnlockedThreads::Get();
  {
    const std::lock_guard lock(threads.mutex);
    stays_behind_ = threads.EndsWithout(std::this_thread::get_id());
  }
  if (stays_behind_) StayBehind();
  try {
    PyEval_RestoreThread(thread_);
  } catch (abi::__forced_unwind&) {
    StayBehind();  // the interpreter has ended meanwhile; to leave this block would abort
  }
  const std::lock_guard lock(threads.mutex);
  threads.all.erase(this);
}

void CallLocked(std::thread::id beginner, const std::function<void()>& function) {
  UnlockedThreads& threads = UnlockedThreads::Get();
  {
    const std::lock_guard lock(threads.mutex);
    // Until the interpreter is finalised the thread that ends it waits for the work that it began.
    const bool waits = !threads.ending || (beginner == threads.ends && !IsFinalizing());
    if (!waits) return;
  }
  try {
    const PyGILState_STATE state = PyGILState_Ensure();
    function();
    PyGILState_Release(state);
  } catch (abi::__forced_unwind&) {
    StayBehind();
  }
}

}  // namespace dtr::python
