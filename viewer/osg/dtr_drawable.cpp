#include "viewer/osg/dtr_drawable.h"

#include <osg/Notify>
#include <osg/RenderInfo>

#include "viewer/osg/novel_camera.h"
#include "viewer/osg/read_back.h"

namespace osgDTR {

DepthTR::dtrDrawable::dtrDrawable() : state_(std::make_unique<State>()) {
  setSupportsDisplayList(false);  // every camera sees another picture
  setUseDisplayList(false);
}

DepthTR::dtrDrawable::dtrDrawable(const dtrDrawable& other, const osg::CopyOp& copyop)
    : osg::Drawable(other, copyop), state_(std::make_unique<State>()) {
  state_->settings = other.state_->Get();
}

DepthTR::dtrDrawable::~dtrDrawable() = default;

osg::BoundingBox DepthTR::dtrDrawable::computeBoundingBox() const {
  const auto scene = state_->Get().scene;
  return scene ? scene->bounds : osg::BoundingBox();
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
  if (!settings.scene || viewport.width <= 0 || viewport.height <= 0) return;
  osg::State& state = *info.getState();
  const NovelCamera novel = NovelCameraOf(state.getModelViewMatrix(), state.getProjectionMatrix(),
                                          viewport.width, viewport.height);
  const std::shared_ptr<ContextRenderer> context = state_->contexts.Of(state);
  const dtr::RenderScene& scene = settings.scene->scene;
  const dtr::gl::DrawnPicture picture =
      context->Picture(settings.scene, settings.version, novel.camera, novel.cam_from_local, [&] {
        dtr::gl::Renderer& renderer = context->renderer;
        if (settings.path == DrawPath::kGpu) {
          return renderer.Draw(scene, novel.camera, novel.cam_from_local, settings.options);
        }
        return context->compositor.Upload(RenderByReadBack(renderer, scene, novel.camera,
                                                           novel.cam_from_local, settings.options));
      });
  context->compositor.Composite(picture, novel.projection);
}

void DepthTR::dtrDrawable::releaseGLObjects(osg::State* state) const {
  osg::Drawable::releaseGLObjects(state);
  state_->contexts.Release(state);
}

size_t DepthTR::dtrDrawable::contextCount() const { return state_->contexts.count(); }

}  // namespace osgDTR
