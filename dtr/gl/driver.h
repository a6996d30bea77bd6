// dtr/gl/driver.h -- what the driver of the current context is like. Only dtr/gl's own .cpp files
// and its tests include this.
#pragma once
#include <cstddef>
#include <string_view>

namespace dtr::gl {

/// Whether a driver that calls itself so (GL_RENDERER) draws on the processor.
bool IsSoftwareRasteriser(std::string_view renderer);

/// The same for the current context.
bool DrawsOnProcessor();

/// Whether the driver lets clip space's z run from 0 to 1: OpenGL 4.5 or GL_ARB_clip_control.
bool HasClipControl();

/// GL_MAX_SHADER_STORAGE_BLOCK_SIZE: bytes of a storage buffer that a shader sees.
size_t MostStorageBytes();

}  // namespace dtr::gl
