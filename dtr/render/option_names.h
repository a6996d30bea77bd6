// dtr/render/option_names.h -- the choices among RenderOptions by the names people type.
#pragma once
#include <array>

#include "dtr/render/options.h"

namespace dtr {

inline constexpr std::array kRenderMethods{RenderMethod::kDeferred, RenderMethod::kTwoPass};
inline constexpr std::array kPrimitives{Primitive::kMesh, Primitive::kSplat};
inline constexpr std::array kBlendWeights{BlendWeight::kCosine, BlendWeight::kExponential,
                                          BlendWeight::kAngle, BlendWeight::kInverseAngle,
                                          BlendWeight::kKNearest};

/// "two-pass" or "deferred", as --method takes them.
const char* NameOf(RenderMethod method);
/// As --primitive takes them.
const char* NameOf(Primitive primitive);
/// As --blend takes them.
const char* NameOf(BlendWeight blend);

}  // namespace dtr
