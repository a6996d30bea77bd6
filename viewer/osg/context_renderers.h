// viewer/osg/context_renderers.h -- what lies on the GPU of a scene, for every graphics context it
// is drawn in.
#pragma once
#include <osg/State>
#include <osg/ref_ptr>

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "dtr/gl/compositor.h"
#include "dtr/gl/renderer.h"
#include "viewer/osg/loaded_scene.h"
#include "viewer/stillness.h"

namespace osgDTR {

/// A renderer of one graphics context, and what its last picture was of.
class ContextRenderer {
 public:
  ContextRenderer();

  /// A picture of what is said, made anew only when one of these differs from the last call's: a
  /// viewer draws a still scene again and again. `draw` is told whether the picture is to be whole:
  /// with `may_wait` not before nothing has differed for a while.
  template <typename Draw>
  dtr::gl::DrawnPicture Picture(std::shared_ptr<const LoadedSet> set, unsigned settings_version,
                                const dtr::PinholeCamera& camera, const dtr::Pose& pose,
                                bool may_wait, const Draw& draw) {
    if (set != set_) {
      renderer.Forget();  // while the old views still live
      last_.reset();
      set_ = std::move(set);
    }
    Last now{settings_version, camera, pose, true, {}};
    const bool same = last_ && now.SameAs(*last_);
    if (last_ && !same) stillness_.Moved();
    now.whole = !may_wait || stillness_.still();
    if (!same || (now.whole && !last_->whole)) {
      last_.reset();
      now.picture = draw(now.whole);
      last_ = std::move(now);
    }
    return last_->picture;
  }

  dtr::gl::Renderer renderer;
  dtr::gl::Compositor compositor;
  std::atomic<bool> abandoned = false;  ///< its context is gone: kept, but never used again

 private:
  struct Last {
    unsigned settings_version;
    dtr::PinholeCamera camera;
    dtr::Pose pose;
    bool whole;
    dtr::gl::DrawnPicture picture;
    bool SameAs(const Last& other) const {
      return settings_version == other.settings_version && camera == other.camera &&
             pose.rotation.coeffs() == other.pose.rotation.coeffs() &&
             pose.translation == other.pose.translation;
    }
  };
  std::shared_ptr<const LoadedSet> set_;
  std::optional<Last> last_;
  dtr::viewer::Stillness stillness_;
};

/// The renderers of one drawable, by graphics context. Contexts that share their objects still have
/// a renderer each: vertex arrays and framebuffers are never shared. Renderers die where their
/// context is current: when OpenSceneGraph flushes it or closes its window. Any thread.
class ContextRenderers {
 public:
  ContextRenderers();
  ~ContextRenderers();
  ContextRenderers(const ContextRenderers&) = delete;
  ContextRenderers& operator=(const ContextRenderers&) = delete;

  /// That of the context of `state`, which is current on this thread; made at the first call.
  std::shared_ptr<ContextRenderer> Of(osg::State& state);

  /// Gives up the renderer of a context, or all of them (null); they die as said above.
  void Release(const osg::State* state);

  /// Renderers that are in use now.
  size_t count() const;

 private:
  class Owner;
  struct Entry {
    const osg::State* state = nullptr;
    osg::ref_ptr<Owner> owner;
    std::weak_ptr<ContextRenderer> renderer;
    /// Null where the renderer or its context is gone.
    std::shared_ptr<ContextRenderer> Alive() const {
      auto locked = renderer.lock();
      return locked && !locked->abandoned ? locked : nullptr;
    }
  };
  mutable std::mutex mutex_;
  std::vector<Entry> entries_;
};

}  // namespace osgDTR
