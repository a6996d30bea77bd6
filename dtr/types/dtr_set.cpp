#include "dtr/types/dtr_set.h"

namespace dtr {

const char* NameOf(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::kArbitrary:
      return "arbitrary";
    case LengthUnit::kMetre:
      return "metre";
    case LengthUnit::kUnknown:
      break;
  }
  return "unknown";
}

}  // namespace dtr
