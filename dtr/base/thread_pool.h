// dtr/base/thread_pool.h -- internal to dtr/base: threads that all parallel loops share.
#pragma once
#include <atomic>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <vector>

namespace dtr {

/// One call of ParallelFor while it runs; it lives on its caller's stack.
class Loop {
 public:
  /// `limit`: threads that may be inside at once, its caller among them; `request`: those that it
  /// and all loops around and inside it may use together. `parent`: the loop whose item calls.
  Loop(int begin, int end, int limit, int request, const std::function<void(int)>& body,
       Loop* parent);
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

 private:
  friend class ThreadPool;

  void RunItems(bool by_caller);
  bool IsInside(const Loop* ancestor) const;

  const int end_, limit_, request_;
  const std::function<void(int)>& body_;
  Loop* const parent_;
  Loop* const root_;
  std::atomic<int> next_;
  std::atomic<bool> failed_ = false;

  std::mutex error_mutex_;
  std::exception_ptr first_error_;
  int first_error_item_;

  // What the pool's mutex guards.
  int inside_ = 1;
  bool caller_waits_ = false;
  std::condition_variable changed_;  // for its caller, while that waits
  // Of a root: threads at work in it and in loops inside it, and how many may be.
  std::atomic<int> running_ = 1, max_running_;
};

/// Threads that live as long as the process. A thread that is free enters the loop that began first
/// among those with items left and a place free. A caller whose items are all taken, and who waits
/// for others to finish theirs, enters loops inside its own meanwhile, and no other: so it returns
/// as soon as its loop is done, its stack stays shallow, and no loop waits for itself. Where
/// another took its place meanwhile, one of those at work leaves after its item.
///
/// After a fork the child has a pool of its own, without threads at first.
class ThreadPool {
 public:
  static ThreadPool& OfProcess();

  /// The loop whose item the calling thread runs; null: none.
  static Loop* Current();

  /// Runs all of the loop's items, the calling thread among those at work. Rethrows what they
  /// threw.
  void Run(Loop& loop);

 private:
  void StartThreads();
  void Work();
  void Enter(Loop& loop, std::unique_lock<std::mutex>& lock);
  void Await(Loop& loop, std::unique_lock<std::mutex>& lock);
  Loop* Joinable(const Loop* ancestor);
  void Wake(const Loop& loop);

  std::mutex mutex_;
  std::condition_variable work_;  // for threads that are free
  std::vector<Loop*> open_;       // by when they began
  int threads_ = 0, free_ = 0;
};

}  // namespace dtr
