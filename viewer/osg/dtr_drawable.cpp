#include "viewer/osg/dtr_drawable.h"

#include <osg/FrameStamp>
#include <osg/Notify>
#include <osg/RenderInfo>

#include "dtr/render/finish_image.h"
#include "viewer/osg/novel_camera.h"
#include "viewer/osg/read_back.h"

namespace osgDTR {
namespace {

/// As the settings say, finished (SPEC 7, 8) or not.
MadeFrame DrawFrame(dtr::gl::FittingRenderer& renderer, dtr::gl::Compositor& compositor,
                    const DrawSettings& settings, const NovelCamera& novel, bool finish) {
  const dtr::RenderScene& scene = settings.set->time_steps[settings.time_step].scene;
  const dtr::RenderOptions& options = settings.options;
  const bool on_gpu = settings.path == DrawPath::kGpu;
  if (on_gpu && !finish) {
    return {renderer.Draw(scene, novel.camera, novel.cam_from_local, options,
                          dtr::gl::CurrentMapping(novel.projection)),
            true};
  }
  dtr::RenderResult result;
  if (on_gpu) {
    renderer.Draw(scene, novel.camera, novel.cam_from_local, options);
    result = renderer.ReadBack();
  } else {
    result =
        RenderByReadBack(renderer.open_gl(), scene, novel.camera, novel.cam_from_local, options);
  }
  if (!finish) return {compositor.Take(result), false};
  const dtr::Grid<float> depth =
      dtr::FinishImage(scene, novel.camera, novel.cam_from_local, options, result);
  if (!options.fill_holes) return {compositor.Take(result), false};
  return {compositor.TakeFilled(result, depth), false};
}

}  // namespace

DepthTR::dtrDrawable::dtrDrawable() : state_(std::make_unique<State>()) {
  setSupportsDisplayList(false);  // every camera sees another image
  setUseDisplayList(false);
}

DepthTR::dtrDrawable::dtrDrawable(const dtrDrawable& other, const osg::CopyOp& copyop)
    : osg::Drawable(other, copyop), state_(std::make_unique<State>()) {
  state_->settings = other.state_->Get();
}

DepthTR::dtrDrawable::~dtrDrawable() = default;

osg::BoundingBox DepthTR::dtrDrawable::computeBoundingBox() const {
  const auto set = state_->Get().set;
  return set ? set->bounds : osg::BoundingBox();
}

void DepthTR::dtrDrawable::drawImplementation(osg::RenderInfo& info) const {
  try {
    Draw(info);
  } catch (const std::exception& error) {
    // OpenSceneGraph's threads know no exceptions of ours.
    if (state_->IsNews(error.what())) OSG_WARN << error.what() << std::endl;
  }
}

void DepthTR::dtrDrawable::Draw(osg::RenderInfo& info) const {
  const DrawSettings settings = state_->Get();
  const dtr::gl::Viewport viewport = dtr::gl::CurrentViewport();
  if (!settings.set || viewport.width <= 0 || viewport.height <= 0) return;
  osg::State& state = *info.getState();
  const NovelCamera novel = NovelCameraOf(state.getModelViewMatrix(), state.getProjectionMatrix(),
                                          viewport.width, viewport.height);
  const std::shared_ptr<ContextRenderer> context = state_->contexts.Of(state);
  const bool finish = dtr::NeedsFinishing(settings.options);
  const bool may_wait = finish && settings.fill_time == FillTime::kWhenStill;
  const osg::FrameStamp* const stamp = state.getFrameStamp();
  context->Show(stamp != nullptr ? std::optional(stamp->getFrameNumber()) : std::nullopt,
                settings.set, settings.version, novel, may_wait,
                [&](dtr::gl::Compositor& compositor, bool whole) {
                  return DrawFrame(context->renderer, compositor, settings, novel, finish && whole);
                });
}

void DepthTR::dtrDrawable::releaseGLObjects(osg::State* state) const {
  osg::Drawable::releaseGLObjects(state);
  state_->contexts.Release(state);
}

size_t DepthTR::dtrDrawable::contextCount() const { return state_->contexts.count(); }

}  // namespace osgDTR
