#include "python/core/render_pool.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <thread>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/set_io.h"
#include "dtr/render/scene.h"
#include "dtr/render/time_steps.h"
#include "dtr/render/view_stream.h"
#include "pipeline/core/set_stream.h"
#include "pipeline/core/view_names.h"

namespace dtr::python {
namespace {

/// Sessions that are kept though nobody draws with them: each has views in memory.
constexpr size_t kMaxFree = 2;

/// Notes of a session go to whoever draws with it just now.
class NotesToCaller final : public Progress {
 public:
  void SetCaller(Progress* caller) {
    const std::lock_guard lock(mutex_);
    caller_ = caller;
  }
  void Stage(const std::string&, int) override {}
  void Update(int) override {}
  void Note(const std::string& line) override {
    const std::lock_guard lock(mutex_);
    if (caller_ != nullptr) caller_->Note(line);
  }

 private:
  std::mutex mutex_;
  Progress* caller_ = nullptr;
};

}  // namespace

class RenderSession {
 public:
  RenderSession(std::filesystem::path folder, const DtrSet& set, RenderSettings settings,
                std::shared_ptr<cli::OnceNotes> notes)
      : folder_(std::move(folder)), set_(set), settings_(std::move(settings)) {
    choice_.name = settings_.renderer;
    choice_.gpu_memory_gb = settings_.gpu_memory_gb;
    choice_.notes = std::move(notes);
    thread_ = std::jthread([this](const std::stop_token& stop) { Work(stop); });
  }

  const RenderSettings& settings() const { return settings_; }
  /// False once an image failed: what it left behind is not drawn with again.
  bool usable() const { return usable_; }

  std::future<Rendered> Start(const pipeline::NovelFrame& camera, const RenderOptions& options,
                              Progress& progress) {
    std::packaged_task<Rendered()> task([this, camera, options, &progress] {
      usable_ = false;
      console_.SetCaller(&progress);
      Rendered rendered = Draw(camera, options);
      console_.SetCaller(nullptr);
      usable_ = true;
      return rendered;
    });
    std::future<Rendered> result = task.get_future();
    {
      const std::lock_guard lock(mutex_);
      tasks_.push_back(std::move(task));
    }
    there_is_a_task_.notify_one();
    return result;
  }

 private:
  void Work(const std::stop_token& stop) {
    const ThreadLimit limit(settings_.threads);
    for (;;) {
      std::packaged_task<Rendered()> task;
      {
        std::unique_lock lock(mutex_);
        if (!there_is_a_task_.wait(lock, stop, [this] { return !tasks_.empty(); })) break;
        task = std::move(tasks_.front());
        tasks_.pop_front();
      }
      task();
      console_.SetCaller(nullptr);  // also after an exception
    }
    // Where they were made: OpenGL's context belongs to this thread.
    draw_ = {};
    stream_.reset();
  }

  void Open() {
    step_ = AtFrame(set_, settings_.time_step);
    const auto excluded = pipeline::ResolveViewNames(step_, settings_.exclude);
    io::CollapseDuplicates(step_);
    draw_ = cli::MakeRenderer(choice_, console_);
    stream_ = pipeline::StreamOf(folder_, step_, {DescribeRenderScene(step_, excluded)},
                                 {settings_.memory_gb, settings_.measured_only}, console_);
  }

  Rendered Draw(const pipeline::NovelFrame& camera, const RenderOptions& options) {
    if (!stream_) Open();
    const RenderScene scene =
        stream_->SceneFor(camera.cam_from_world, options, ViewStream::Wait::kForAll);
    Rendered rendered{draw_(scene, camera.camera, camera.cam_from_world, options), {}, {}};
    if (rendered.result.views_used.empty()) {
      console_.Note(fmt::format("WARNING: {}: no view is valid for this camera: the image is empty",
                                camera.name));
    }
    for (const int index : rendered.result.views_used) {
      rendered.views_used.push_back(scene.views[static_cast<size_t>(index)]->name);
    }
    for (const ViewStream::Lost& lost : stream_->lost()) {
      rendered.skipped.emplace_back(lost.name, lost.reason);
    }
    return rendered;
  }

  const std::filesystem::path folder_;
  const DtrSet& set_;
  const RenderSettings settings_;
  cli::RendererChoice choice_;
  NotesToCaller console_;
  DtrSet step_;
  std::unique_ptr<ViewStream> stream_;
  eval::RenderFunction draw_;
  bool usable_ = true;
  std::mutex mutex_;
  std::condition_variable_any there_is_a_task_;
  std::deque<std::packaged_task<Rendered()>> tasks_;
  std::jthread thread_;  // last: it ends before what it uses
};

void CheckRenderSettings(const RenderSettings& settings) {
  const std::vector<std::string> names = cli::RendererNames();
  if (std::find(names.begin(), names.end(), settings.renderer) == names.end()) {
    throw UsageError(fmt::format("`renderer`: expected one of {}, found '{}'",
                                 fmt::join(names, ", "), settings.renderer));
  }
  for (const auto& [name, value] :
       {std::pair{"memory", settings.memory_gb}, std::pair{"gpu_memory", settings.gpu_memory_gb}}) {
    constexpr double kMaxGigabytes = 4096;  // as of the command line
    if (value > 0 && value <= kMaxGigabytes) continue;
    throw UsageError(fmt::format("`{}`: expected gigabytes above 0 and up to {}, found {}", name,
                                 kMaxGigabytes, value));
  }
  constexpr int kMaxThreads = 1024;
  if (settings.threads < 0 || settings.threads > kMaxThreads) {
    throw UsageError(fmt::format("`threads`: expected 0 (all cores) to {}, found {}", kMaxThreads,
                                 settings.threads));
  }
}

RenderPool::RenderPool(std::filesystem::path folder, const DtrSet& set)
    : folder_(std::move(folder)), set_(set), process_(getpid()) {}

RenderPool::~RenderPool() { ForgetParents(); }

// After fork() the threads of these sessions are the parent's alone: to wait for them would be for
// ever.
void RenderPool::ForgetParents() {
  if (process_ == getpid()) return;
  for (auto& session : free_) (void)session.release();
  free_.clear();
  process_ = getpid();
}

std::unique_ptr<RenderSession> RenderPool::Take(const RenderSettings& settings) {
  {
    const std::lock_guard lock(mutex_);
    ForgetParents();
    const auto same = std::find_if(free_.begin(), free_.end(), [&](const auto& session) {
      return session->settings() == settings;
    });
    if (same != free_.end()) {
      std::unique_ptr<RenderSession> session = std::move(*same);
      free_.erase(same);
      return session;
    }
  }
  return std::make_unique<RenderSession>(folder_, set_, settings, notes_);
}

void RenderPool::Return(std::unique_ptr<RenderSession> session) {
  std::unique_ptr<RenderSession> oldest;  // ends outside the lock
  const std::lock_guard lock(mutex_);
  if (free_.size() >= kMaxFree) {
    oldest = std::move(free_.front());
    free_.erase(free_.begin());
  }
  free_.push_back(std::move(session));
}

void RenderPool::Clear() {
  std::vector<std::unique_ptr<RenderSession>> ended;
  const std::lock_guard lock(mutex_);
  ForgetParents();
  ended.swap(free_);
}

Rendered RenderPool::Render(const pipeline::NovelFrame& camera, const RenderOptions& options,
                            const RenderSettings& settings, Progress& progress,
                            const std::function<void(std::future<Rendered>&)>& wait) {
  CheckRenderSettings(settings);
  std::unique_ptr<RenderSession> session = Take(settings);
  std::future<Rendered> drawn = session->Start(camera, options, progress);
  wait(drawn);
  if (session->usable()) Return(std::move(session));
  return drawn.get();
}

}  // namespace dtr::python
