#include "dtr/base/thread_pool.h"

#include <pthread.h>

#include <algorithm>
#include <thread>

#include "dtr/base/parallel_for.h"

namespace dtr {
namespace {

thread_local Loop* current_loop = nullptr;

// Never destroyed: its threads run until the process ends.
ThreadPool* pool = nullptr;
std::once_flag made;

}  // namespace

Loop::Loop(int begin, int end, int limit, int request, const std::function<void(int)>& body,
           Loop* parent)
    : end_(end),
      limit_(limit),
      request_(request),
      body_(body),
      parent_(parent),
      root_(parent != nullptr ? parent->root_ : this),
      next_(begin),
      first_error_item_(end),
      max_running_(request) {}

void Loop::RunItems(bool by_caller) {
  const ThreadLimit limit(request_);  // its caller's
  Loop* const around = current_loop;
  current_loop = this;
  while (!failed_.load(std::memory_order_relaxed)) {
    if (!by_caller && root_->running_ > root_->max_running_) break;
    const int i = next_.fetch_add(1, std::memory_order_relaxed);
    if (i >= end_) break;
    try {
      body_(i);
    } catch (...) {
      const std::lock_guard lock(error_mutex_);
      if (i < first_error_item_) {
        first_error_item_ = i;
        first_error_ = std::current_exception();
      }
      failed_.store(true, std::memory_order_relaxed);
    }
  }
  current_loop = around;
}

bool Loop::IsInside(const Loop* ancestor) const {
  for (const Loop* loop = parent_; loop != nullptr; loop = loop->parent_) {
    if (loop == ancestor) return true;
  }
  return false;
}

ThreadPool& ThreadPool::OfProcess() {
  std::call_once(made, [] {
    pool = new ThreadPool;
    pthread_atfork(nullptr, nullptr, [] { pool = new ThreadPool, current_loop = nullptr; });
  });
  return *pool;
}

Loop* ThreadPool::Current() { return current_loop; }

void ThreadPool::Run(Loop& loop) {
  std::unique_lock lock(mutex_);
  Loop& root = *loop.root_;
  root.max_running_ = std::max(root.max_running_.load(), loop.max_running_.load());
  open_.push_back(&loop);
  StartThreads();
  Wake(loop);
  lock.unlock();
  loop.RunItems(true);
  lock.lock();
  Await(loop, lock);
  lock.unlock();
  if (loop.first_error_) std::rethrow_exception(loop.first_error_);
}

// As many as all loops may use that no other is around: a viewer that loads views beside its frames
// has threads for both. The first one that the system rejects, for want of threads or of memory, is
// the last one that is asked for, this time.
void ThreadPool::StartThreads() {
  int wanted = 0;
  for (const Loop* loop : open_) wanted += loop->root_ == loop ? loop->max_running_ - 1 : 0;
  try {
    for (; threads_ < wanted; ++threads_) std::thread([this] { Work(); }).detach();
  } catch (const std::exception&) {
  }
}

void ThreadPool::Work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (Loop* const loop = Joinable(nullptr)) {
      ++loop->root_->running_;
      Enter(*loop, lock);
      --loop->root_->running_;
      continue;
    }
    ++free_;
    work_.wait(lock);
    --free_;
  }
}

void ThreadPool::Enter(Loop& loop, std::unique_lock<std::mutex>& lock) {
  ++loop.inside_;
  lock.unlock();
  loop.RunItems(false);
  lock.lock();
  if (--loop.inside_ == 0 || loop.caller_waits_) loop.changed_.notify_one();
}

// Until all others have left; the loop's caller is inside no longer.
void ThreadPool::Await(Loop& loop, std::unique_lock<std::mutex>& lock) {
  Loop& root = *loop.root_;
  --loop.inside_;
  while (loop.inside_ > 0) {
    if (Loop* const inner = Joinable(&loop)) {
      Enter(*inner, lock);
      continue;
    }
    --root.running_;
    work_.notify_one();  // another may run in its place
    loop.caller_waits_ = true;
    loop.changed_.wait(lock);
    loop.caller_waits_ = false;
    ++root.running_;
  }
  std::erase(open_, &loop);
}

// The loop that began first, among those with items left and a place free; with an ancestor, of the
// loops inside that, whose thread asks and counts as running already.
Loop* ThreadPool::Joinable(const Loop* ancestor) {
  for (Loop* const loop : open_) {
    if (loop->inside_ >= loop->limit_ || loop->failed_ || loop->next_ >= loop->end_) continue;
    const Loop& root = *loop->root_;
    const bool allowed =
        ancestor != nullptr ? loop->IsInside(ancestor) : root.running_ < root.max_running_;
    if (allowed) return loop;
  }
  return nullptr;
}

// Threads that may enter a loop that has just begun.
void ThreadPool::Wake(const Loop& loop) {
  const int wanted = std::min(loop.limit_ - 1, free_);
  for (int i = 0; i < wanted; ++i) work_.notify_one();
  for (Loop* around = loop.parent_; around != nullptr; around = around->parent_) {
    if (around->caller_waits_) around->changed_.notify_one();
  }
}

}  // namespace dtr
