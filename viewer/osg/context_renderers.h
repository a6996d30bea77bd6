// viewer/osg/context_renderers.h -- what lies on the GPU of a scene, for every graphics context it
// is drawn in.
#pragma once
#include <osg/State>
#include <osg/ref_ptr>

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "dtr/gl/compositor.h"
#include "dtr/gl/fitting_renderer.h"
#include "viewer/osg/loaded_scene.h"
#include "viewer/osg/novel_camera.h"
#include "viewer/stillness.h"

namespace osgDTR {

/// An image that was made for one of a node's appearances in a window.
struct MadeFrame {
  dtr::gl::DrawnFrame picture;
  bool in_renderer =
      false;  ///< it holds until the renderer's next; else the compositor's own has it
};

/// A renderer of one graphics context, and what its last images were of.
class ContextRenderer {
 public:
  ContextRenderer();

  /// Puts an image of what is said into the framebuffer. It is made again only when one of these
  /// differs from the frame before: a viewer draws a still scene again and again. A window may show
  /// a node several times in a frame: the n-th of a frame goes with the n-th of the frame before.
  /// `draw` is given the compositor that takes images from memory and whether the image is to
  /// be whole: with `may_wait` not before nothing has differed for a while. `frame`:
  /// OpenSceneGraph's number of it; empty: a frame of its own.
  template <typename Draw>
  void Show(std::optional<unsigned> frame, std::shared_ptr<const LoadedSet> set,
            unsigned settings_version, const NovelCamera& novel, bool may_wait, const Draw& draw) {
    if (set != set_) {
      renderer.Forget();  // while the old views still live
      appearances_.clear();
      shown_before_ = false;
      set_ = std::move(set);
    }
    Appearance& shown = Next(frame);
    const bool same = shown.last && shown.last->Is(settings_version, novel);
    if (shown.last && !same) shown.stillness.Moved();
    const bool whole = !may_wait || shown.stillness.still();
    if (!same || !Holds(*shown.last) || (whole && !shown.last->whole)) {
      shown.last.reset();
      ++drawn_;  // also where this fails: the renderer may have begun
      MadeFrame made = draw(shown.compositor, whole);
      shown.last = Last{settings_version, novel.camera,   novel.cam_from_local, whole,
                        drawn_,           std::move(made)};
    }
    shown.compositor.Composite(shown.last->made.picture, novel.projection);
  }

  dtr::gl::FittingRenderer renderer;
  std::atomic<bool> abandoned = false;  ///< its context is gone: kept, but never used again

 private:
  struct Last {
    unsigned settings_version;
    dtr::PinholeCamera camera;
    dtr::Pose pose;
    bool whole;
    unsigned long number;  ///< among all that the renderer was asked for
    MadeFrame made;
    bool Is(unsigned version, const NovelCamera& novel) const {
      return settings_version == version && camera == novel.camera &&
             pose.rotation.coeffs() == novel.cam_from_local.rotation.coeffs() &&
             pose.translation == novel.cam_from_local.translation;
    }
  };
  struct Appearance {
    std::optional<Last> last;
    dtr::viewer::Stillness stillness;
    dtr::gl::Compositor compositor;
  };

  /// The one whose turn it is in this frame.
  Appearance& Next(std::optional<unsigned> frame);
  bool Holds(const Last& last) const { return !last.made.in_renderer || last.number == drawn_; }

  std::shared_ptr<const LoadedSet> set_;
  std::deque<Appearance> appearances_;
  std::optional<unsigned> frame_;
  size_t in_frame_ = 0;        ///< appearances shown in it so far
  bool shown_before_ = false;  ///< in an earlier frame
  unsigned long drawn_ = 0;
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
