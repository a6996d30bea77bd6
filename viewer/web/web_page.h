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

/// Bytes as text of UTF-8 for a script element, 8/7 of their size: seven bits a byte, and what
/// HTML does not let through with the next seven bits in a character of two bytes (after base122
/// by K. Albertson, 2016; docs/EXPORT.md, "Bytes as text").
std::string TextOfBytes(std::string_view bytes);

/// The page's modules as one, each after those that it imports.
std::string JoinedScript();

}  // namespace dtr::web
