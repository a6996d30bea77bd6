#include "dtr/io/formats/world_facts.h"

#include "dtr/base/error.h"

namespace dtr::io::internal {

void ReadWorldFacts(const Tree& facts, const std::string& where, ForeignScene& scene) {
  if (Find(facts, "unit") != nullptr) {
    const std::string unit = GetText(facts, "unit", where);
    bool known = false;
    for (const LengthUnit candidate :
         {LengthUnit::kUnknown, LengthUnit::kArbitrary, LengthUnit::kMetre}) {
      if (unit != NameOf(candidate)) continue;
      scene.unit = candidate;
      known = true;
    }
    if (!known) {
      throw Error(where + ".unit: expected \"unknown\", \"arbitrary\" or \"metre\", found another");
    }
  }
  if (Find(facts, "world_origin") != nullptr) {
    scene.world_origin = GetVector(facts, "world_origin", where);
  }
}

}  // namespace dtr::io::internal
