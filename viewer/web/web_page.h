// viewer/web/web_page.h -- one HTML file of the viewer's sources and a set's data.
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace dtr::web {

/// What a page shows.
struct WebPage {
  std::string title;
  std::string version;             ///< of the program that makes it
  std::string set_json;            ///< docs/EXPORT.md, "The web page's data"
  std::vector<std::string> views;  ///< each view's bytes, in the order of the JSON
};

/// The whole page: no other file and no server is needed to open it.
std::string MakeWebPage(const WebPage& page);

/// Bytes as UTF-8 text that HTML keeps as it is within a script element, 8 bytes for 7
/// (docs/EXPORT.md, "Text").
std::string TextOfBytes(std::string_view bytes);

/// The page's modules as one, each after those that it imports.
std::string JoinedScript();

}  // namespace dtr::web
