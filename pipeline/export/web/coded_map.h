// pipeline/export/web/coded_map.h -- depth codes and masks as few bytes, for the page of
// `dtr export --format web` (docs/EXPORT.md, "Coded maps").
#pragma once
#include <cstdint>
#include <string>

#include "dtr/types/grid.h"

namespace dtr::pipeline {

/// Which elements are not 0. Where `known` (of the same size, or empty) is not 0 nothing is stored.
std::string CodedPlaces(const Grid<std::uint16_t>& map, const Grid<std::uint16_t>& known);

/// The values of the elements that are not 0.
std::string CodedValues(const Grid<std::uint16_t>& map);

}  // namespace dtr::pipeline
