// python/core/render_pool.h -- new views of a set in memory, as `dtr render` makes them in files.
#pragma once
#include <filesystem>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "cli/renderers.h"
#include "dtr/base/progress.h"
#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "dtr/types/dtr_set.h"
#include "pipeline/render/novel_frames.h"

namespace dtr::python {

/// What `dtr render` takes beside the camera and RenderOptions.
struct RenderSettings {
  std::string renderer = "auto";  ///< as --renderer
  double memory_gb = 4;           ///< as --memory
  double gpu_memory_gb = 4;       ///< as --gpu-memory
  std::string exclude;            ///< as --exclude
  size_t time_step = 0;           ///< as --frame
  bool measured_only = false;     ///< as --measured-only
  int threads = 0;

  bool operator==(const RenderSettings&) const = default;
};

/// Throws UsageError naming the setting when one has no meaning.
void CheckRenderSettings(const RenderSettings& settings);

/// One image, with the views by name.
struct Rendered {
  RenderResult result;
  std::vector<std::string> views_used;                       ///< nearest first
  std::vector<std::pair<std::string, std::string>> skipped;  ///< that could not be read, why
};

/// A renderer with the views that it draws from, on a thread of its own: OpenGL's context belongs
/// to the thread that made it.
class RenderSession;

/// Sessions of one set. Several threads may draw at once, each with a session of its own; a session
/// that is free again keeps its views for the next image of the same settings.
class RenderPool {
 public:
  /// Both as io::ReadSet has them; `set` must outlive the pool.
  RenderPool(std::filesystem::path folder, const DtrSet& set);
  ~RenderPool();
  RenderPool(const RenderPool&) = delete;
  RenderPool& operator=(const RenderPool&) = delete;

  /// Draws an image as `dtr render` does. `wait` is called once with what becomes ready, and must
  /// wait for it. `progress` gets what the renderer notes, from any thread. Throws as
  /// pipeline::Render.
  Rendered Render(const pipeline::NovelFrame& camera, const RenderOptions& options,
                  const RenderSettings& settings, Progress& progress,
                  const std::function<void(std::future<Rendered>&)>& wait);

  /// Ends all sessions that nobody draws with.
  void Clear();

 private:
  std::unique_ptr<RenderSession> Take(const RenderSettings& settings);
  void Return(std::unique_ptr<RenderSession> session);
  void ForgetParents();

  const std::filesystem::path folder_;
  const DtrSet& set_;
  const std::shared_ptr<cli::OnceNotes> notes_ = std::make_shared<cli::OnceNotes>();
  std::mutex mutex_;
  std::vector<std::unique_ptr<RenderSession>> free_;  // used last at the end
  int process_;                                       // whose threads these are
};

}  // namespace dtr::python
