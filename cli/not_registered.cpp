#include "cli/not_registered.h"

namespace dtr::cli {

void SayNotRegistered(const std::vector<std::string>& photos,
                      const std::map<std::string, std::string>& why, Console& console) {
  for (const std::string& photo : photos) {
    const auto reason = why.find(photo);
    console.Say("  not registered: " + photo +
                (reason == why.end() ? std::string() : ": " + reason->second));
  }
}

}  // namespace dtr::cli
