// dtr/gl/read_back.h -- results from the GPU. Only dtr/gl's own .cpp files include this.
#pragma once
#include <cstdint>

#include "dtr/gl/drawing.h"
#include "dtr/gl/frame.h"
#include "dtr/render/result.h"

namespace dtr::gl {

/// SPEC 6: the band's rows of `targets` into those of `result`, which has the image's size.
void ReadBack(const Targets& targets, const Band& band, RenderResult& result);

/// The same of pixels in memory, 4 bytes each as in Targets::image and Targets::marks; all but
/// depth.
void StoreRows(const Band& band, int width_px, const std::uint8_t* image, const std::uint8_t* marks,
               RenderResult& result);

}  // namespace dtr::gl
