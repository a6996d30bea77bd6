// viewer/web/web_files.h -- the page's sources, as they were when this program was built.
#pragma once
#include <string_view>
#include <vector>

namespace dtr::web {

struct WebFile {
  std::string_view name;  ///< without folders
  std::string_view text;
};

const std::vector<WebFile>& WebFiles();

}  // namespace dtr::web
