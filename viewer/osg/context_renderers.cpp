#include "viewer/osg/context_renderers.h"

#include <osg/ContextData>
#include <osg/GLObjects>
#include <osg/GraphicsContext>
#include <osg/Notify>
#include <osg/observer_ptr>

#include <algorithm>

namespace osgDTR {
namespace {

// A window that shows a node more often draws all of them again in every frame.
constexpr size_t kMaxAppearances = 16;

dtr::gl::RendererSettings Settings() {
  dtr::gl::RendererSettings settings;
  settings.warn = [](const std::string& line) { OSG_WARN << line << std::endl; };
  return settings;
}

}  // namespace

ContextRenderer::ContextRenderer() : renderer(Settings()) {}

ContextRenderer::Appearance& ContextRenderer::Next(std::optional<unsigned> frame) {
  if (!frame || frame != frame_) {
    // What the frame before no longer showed has gone from the window.
    while (appearances_.size() > in_frame_) appearances_.pop_back();
    shown_before_ = in_frame_ > 0;
    in_frame_ = 0;
    frame_ = frame;
  }
  // Who draws without counting frames never begins a new one.
  if (in_frame_ == kMaxAppearances) in_frame_ = 0;
  if (in_frame_ == appearances_.size()) {
    appearances_.emplace_back();
    if (shown_before_) appearances_.back().stillness.Moved();  // it came into the image
  }
  return appearances_[in_frame_++];
}

/// Owns the renderers of all contexts of one context ID; OpenSceneGraph calls it with one of them
/// current.
class ContextRenderers::Owner final : public osg::GraphicsObjectManager {
 public:
  explicit Owner(unsigned context_id) : GraphicsObjectManager("osgDTR", context_id) {}

  /// The owner for a context ID. OpenSceneGraph looks managers up without a lock, and contexts that
  /// share an ID draw in threads of their own: each would make one.
  static Owner* Of(unsigned context_id) {
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    return osg::get<Owner>(context_id);
  }

  std::weak_ptr<ContextRenderer> Make(osg::State& state) {
    Tenant tenant{state.getGraphicsContext(), state.getGraphicsContext() != nullptr, false,
                  std::make_shared<ContextRenderer>()};
    const std::lock_guard lock(mutex_);
    tenants_.push_back(tenant);
    return tenant.renderer;
  }

  void GiveUp(const std::shared_ptr<ContextRenderer>& renderer) {
    const std::lock_guard lock(mutex_);
    for (Tenant& tenant : tenants_) tenant.given_up |= tenant.renderer == renderer;
  }

  void flushDeletedGLObjects(double, double&) override { flushAllDeletedGLObjects(); }
  void flushAllDeletedGLObjects() override {
    const bool sure = CurrentContexts() <= 1;
    Destroy(
        [&](const Tenant& t) { return t.given_up && (!t.has_context || (sure && t.IsCurrent())); });
  }
  void deleteAllGLObjects() override {
    Destroy([](const Tenant&) { return true; });
  }
  void discardAllGLObjects() override { Abandon(); }

 protected:
  ~Owner() override { Abandon(); }

 private:
  struct Tenant {
    osg::observer_ptr<osg::GraphicsContext> context;
    bool has_context = false;  ///< false: a State of its own, without osg::GraphicsContext
    bool given_up = false;
    std::shared_ptr<ContextRenderer> renderer;
    bool IsCurrent() const {
      osg::ref_ptr<osg::GraphicsContext> locked;
      return context.lock(locked) && locked->isCurrent();
    }
  };

  /// OpenSceneGraph remembers the thread of each context's last makeCurrent: where two that share
  /// an ID both seem current on this one, it is not known which is.
  int CurrentContexts() {
    const std::lock_guard lock(mutex_);
    std::vector<osg::GraphicsContext*> current;
    for (const Tenant& tenant : tenants_) {
      if (tenant.IsCurrent()) current.push_back(tenant.context.get());
    }
    std::sort(current.begin(), current.end());
    return static_cast<int>(std::unique(current.begin(), current.end()) - current.begin());
  }

  template <typename Which>
  void Destroy(const Which& which) {
    std::vector<Tenant> dying;  // outside the lock: their views may be the last owners of much
    {
      const std::lock_guard lock(mutex_);
      const auto first = std::stable_partition(tenants_.begin(), tenants_.end(),
                                               [&](const Tenant& t) { return !which(t); });
      dying.assign(std::make_move_iterator(first), std::make_move_iterator(tenants_.end()));
      tenants_.erase(first, tenants_.end());
    }
  }

  /// The context is gone and took its objects with it; to destroy their owners would call OpenGL.
  void Abandon() {
    static std::mutex mutex;
    static auto* const abandoned = new std::vector<Tenant>;
    const std::scoped_lock lock(mutex_, mutex);
    for (const Tenant& tenant : tenants_) tenant.renderer->abandoned = true;
    std::move(tenants_.begin(), tenants_.end(), std::back_inserter(*abandoned));
    tenants_.clear();
  }

  std::mutex mutex_;
  std::vector<Tenant> tenants_;
};

ContextRenderers::ContextRenderers() = default;
ContextRenderers::~ContextRenderers() { Release(nullptr); }

std::shared_ptr<ContextRenderer> ContextRenderers::Of(osg::State& state) {
  Owner* const owner = Owner::Of(state.getContextID());
  const std::lock_guard lock(mutex_);
  // Numbers and addresses of contexts are used again: what belongs to an earlier one is dead.
  std::erase_if(entries_, [](const Entry& entry) { return !entry.Alive(); });
  for (const Entry& entry : entries_) {
    if (entry.state == &state && entry.owner == owner) return entry.renderer.lock();
  }
  entries_.push_back({&state, owner, owner->Make(state)});
  return entries_.back().renderer.lock();
}

void ContextRenderers::Release(const osg::State* state) {
  const std::lock_guard lock(mutex_);
  std::erase_if(entries_, [&](const Entry& entry) {
    if (state != nullptr && entry.state != state) return false;
    if (const auto renderer = entry.Alive()) entry.owner->GiveUp(renderer);
    return true;
  });
}

size_t ContextRenderers::count() const {
  const std::lock_guard lock(mutex_);
  return static_cast<size_t>(std::count_if(entries_.begin(), entries_.end(),
                                           [](const Entry& e) { return e.Alive() != nullptr; }));
}

}  // namespace osgDTR
