// viewer/web/web_page.h -- a page, or a site, of the viewer's sources and a set's data.
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

struct SiteFile {
  std::string name;
  std::string bytes;
};

/// The page as files for a web server: index.html, dtr-viewer.js (a module that other pages can
/// use, too), set.json, and for each view the bytes in view-0.bin, view-1.bin, ...
std::vector<SiteFile> MakeWebSite(const WebPage& page);

}  // namespace dtr::web
