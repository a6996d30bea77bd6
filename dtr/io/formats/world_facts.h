// dtr/io/formats/world_facts.h -- what our own exports say of the world. Internal to
// dtr/io/formats.
#pragma once
#include <string>

#include "dtr/io/formats/foreign_scene.h"
#include "dtr/io/formats/json_tree.h"

namespace dtr::io::internal {

/// Unit and origin out of `facts` (`dtr export` writes them beside formats without a place for
/// them); what is absent stays. Throws Error for others than we write.
void ReadWorldFacts(const Tree& facts, const std::string& where, ForeignScene& scene);

}  // namespace dtr::io::internal
