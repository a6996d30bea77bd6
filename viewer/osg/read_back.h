// viewer/osg/read_back.h -- the founding report's own way through a frame (its section 3.2.3,
// figure 25), kept as a reference: project every view, read it back, blend on the processor.
#pragma once
#include "dtr/gl/renderer.h"
#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "dtr/render/scene.h"
#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace osgDTR {

/// What gl::Renderer draws by the two-pass method, view by view: each valid view alone is drawn by
/// the GPU and read back; nearest surface, weights and sum are the processor's (SPEC 4). Colours
/// are blended as they were read, in 8 bits. Throws as gl::Renderer::Render, whose context is
/// current.
dtr::RenderResult RenderByReadBack(dtr::gl::Renderer& renderer, const dtr::RenderScene& scene,
                                   const dtr::PinholeCamera& novel,
                                   const dtr::Pose& novel_from_world,
                                   const dtr::RenderOptions& options);

}  // namespace osgDTR
