// dtr/gl/read_back.h -- results from the GPU. Only dtr/gl's own .cpp files include this.
#pragma once
#include "dtr/gl/drawing.h"
#include "dtr/render/frame.h"
#include "dtr/render/result.h"

namespace dtr::gl {

/// SPEC 6: the band's rows of `targets` into those of `result`, which has the image's size.
void ReadBack(const Targets& targets, const Band& band, RenderResult& result);

}  // namespace dtr::gl
