#include "dtr/render/option_names.h"

namespace dtr {

const char* NameOf(RenderMethod method) {
  return method == RenderMethod::kTwoPass ? "two-pass" : "deferred";
}

const char* NameOf(Primitive primitive) { return primitive == Primitive::kMesh ? "mesh" : "splat"; }

const char* NameOf(BlendWeight blend) {
  switch (blend) {
    case BlendWeight::kCosine:
      return "cosine";
    case BlendWeight::kExponential:
      return "exponential";
    case BlendWeight::kAngle:
      return "angle";
    case BlendWeight::kInverseAngle:
      return "inverse-angle";
    case BlendWeight::kKNearest:
      return "k-nearest";
  }
  return "";
}

}  // namespace dtr
