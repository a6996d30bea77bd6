#include "cli/panorama_options.h"

#include <map>
#include <string>

namespace dtr::cli {

void AddPanoramaOption(CLI::App& command, capture::PanoramaUse& use) {
  using capture::PanoramaUse;
  static const std::map<std::string, PanoramaUse> kUses{
      {"auto", PanoramaUse::kAuto}, {"yes", PanoramaUse::kAlways}, {"no", PanoramaUse::kNever}};
  command
      .add_option_function<std::string>(
          "--panoramas", [&use](const std::string& word) { use = kUses.at(word); },
          "Split 360 degree panoramas (equirectangular) into 6 views: those that state to be such "
          "(XMP, spherical video), all, or none [auto]")
      ->check(CLI::IsMember({"auto", "yes", "no"}))
      ->type_name("auto|yes|no");
}

}  // namespace dtr::cli
