// cli/not_registered.h -- what is said of photos that found no camera.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "cli/console.h"

namespace dtr::cli {

/// A line for each photo, with the reason where `why` has one by its name.
void SayNotRegistered(const std::vector<std::string>& photos,
                      const std::map<std::string, std::string>& why, Console& console);

}  // namespace dtr::cli
