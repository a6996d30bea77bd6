// dtr/gl/two_pass.h -- SPEC 4: every view's nearest fragments, drawn by the raster pipeline. Only
// dtr/gl's own .cpp files include this.
#pragma once
#include "dtr/gl/drawing.h"
#include "dtr/gl/program.h"
#include "dtr/gl/view_store.h"
#include "dtr/render/frame.h"

namespace dtr::gl {

/// SPEC 2, 3 and 4.2: the nearest fragments of all views of the frame, one layer of `targets` each,
/// in their order. `clip_control`: HasClipControl(), or false to do without. The views must have
/// been prepared (ViewStore::Prepare) with these options.
void DrawViewLayers(const RenderFrame& frame, const Band& band, ViewStore& store,
                    ProgramCache& programs, const Targets& targets, bool clip_control);

}  // namespace dtr::gl
