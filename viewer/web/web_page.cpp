#include "viewer/web/web_page.h"

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "dtr/base/utf8.h"
#include "viewer/web/web_files.h"

namespace dtr::web {
namespace {

std::string_view TextOf(std::string_view name) {
  for (const WebFile& file : WebFiles()) {
    if (file.name == name) return file.text;
  }
  throw std::logic_error("viewer/web: no file " + std::string(name));
}

void ReplaceAll(std::string& text, std::string_view what, std::string_view by) {
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
}

/// JSON within a script element: nothing in it can end the element.
std::string WithoutTags(std::string json) {
  ReplaceAll(json, "<", "\\u003c");
  return json;
}

std::string EscapedHtml(std::string text) {
  text = WithoutDirectionMarks(std::move(text));
  ReplaceAll(text, "&", "&amp;");
  ReplaceAll(text, "<", "&lt;");
  ReplaceAll(text, ">", "&gt;");
  return text;
}

std::string ShadersJson() {
  nlohmann::ordered_json shaders;
  for (const WebFile& file : WebFiles()) {
    const std::string_view extension = file.name.substr(file.name.rfind('.'));
    if (extension == ".js" || extension == ".html" || extension == ".css") continue;
    shaders[std::string(file.name)] = std::string(file.text);
  }
  return shaders.dump();
}

/// A module without its imports and, unless it is the one to be imported, its exports, after the
/// modules that it imports.
void AddModule(std::string_view name, bool exports, std::set<std::string_view>& done,
               std::string& script) {
  if (!done.insert(name).second) return;
  if (name == "shaders.js") {  // not a file: what the shaders' files say
    script += "const embeddedShaders = " + ShadersJson() + ";\n";
    return;
  }
  const std::string_view text = TextOf(name);
  std::string body;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size() - 1) + 1;
    std::string_view line = text.substr(at, end - at);
    if (line.starts_with("import ")) {
      const size_t last = text.find(";\n", at);
      const std::string_view statement = text.substr(at, last - at);
      const size_t from = statement.find("\"./") + 3;
      AddModule(statement.substr(from, statement.size() - from - 1), false, done, script);
      at = last + 2;
      continue;
    }
    constexpr std::string_view kExport = "export ";
    if (!exports && line.starts_with(kExport)) line.remove_prefix(kExport.size());
    body += line;
    at = end;
  }
  script += body;
}

std::string Joined(std::string_view entry, bool exports) {
  std::set<std::string_view> done;
  std::string script;
  AddModule(entry, exports, done, script);
  return script;
}

// What HTML's parser changes or ends a script element at.
constexpr std::string_view kForbidden("\0\n\r<", 4);

/// `index.html` around what is particular to a page or a site. Texts of the set come last: nothing
/// in them is taken for a place to fill in.
std::string Filled(const WebPage& page, std::string_view policy, std::string_view waiting,
                   const std::string& data) {
  std::string text(TextOf("index.html"));
  ReplaceAll(text, "{{style}}", TextOf("page.css"));
  ReplaceAll(text, "{{policy}}", policy);
  ReplaceAll(text, "{{waiting}}", waiting);
  ReplaceAll(text, "{{version}}", EscapedHtml(page.version));
  const size_t title = text.find("{{title}}"), at = text.find("{{data}}\n");
  text.replace(at, 9, data);
  text.replace(title, 9, EscapedHtml(page.title));
  return text;
}

}  // namespace

std::string TextOfBytes(std::string_view bytes) {
  std::string text;
  text.reserve(bytes.size() * 8 / 7 + 8);
  const auto seven_from = [&bytes](size_t bit) {
    const size_t at = bit / 8;
    const auto byte = [&](size_t i) {
      return i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0u;
    };
    return (byte(at) << 8 | byte(at + 1)) >> (9 - bit % 8) & 127;
  };
  for (size_t bit = 0; bit < 8 * bytes.size(); bit += 7) {
    const unsigned seven = seven_from(bit);
    const size_t forbidden = kForbidden.find(static_cast<char>(seven));
    if (forbidden == std::string_view::npos) {
      text += static_cast<char>(seven);
      continue;
    }
    // Two bytes of UTF-8 with it and the next seven bits.
    bit += 7;
    const auto code = static_cast<unsigned>(forbidden + 1) << 7 | seven_from(bit);
    text += static_cast<char>(0xc0 | code >> 6);
    text += static_cast<char>(0x80 | (code & 63));
  }
  return text;
}

std::string MakeWebPage(const WebPage& page) {
  std::string data =
      "<script type=\"application/json\" id=\"shaders\">" + WithoutTags(ShadersJson()) +
      "</script>\n<script type=\"module\" id=\"script\">\n" + Joined("main.js", false) +
      "</script>\n<script type=\"application/json\" id=\"set\">" + WithoutTags(page.set_json) +
      "</script>\n";
  for (size_t i = 0; i < page.views.size(); ++i) {
    data += "<script type=\"text/plain\" id=\"view-" + std::to_string(i) + "\">";
    data += TextOfBytes(page.views[i]);
    data += "</script>\n";
  }
  return Filled(
      page, "script-src 'unsafe-inline' blob:", "the page is cut short or scripts are off", data);
}

std::vector<SiteFile> MakeWebSite(const WebPage& page) {
  constexpr std::string_view kStart =
      "<script type=\"module\">\nimport { openPage } from \"./dtr-viewer.js\";\n"
      "openPage(\"./set.json\");\n</script>\n";
  constexpr std::string_view kWaiting =
      "scripts are off, or the folder is not behind a web server, which this page needs: "
      "<code>python3 -m http.server</code> in it is one";
  std::vector<SiteFile> files = {
      {"index.html", Filled(page, "script-src 'self' 'unsafe-inline' blob:; connect-src 'self'",
                            kWaiting, std::string(kStart))},
      {"dtr-viewer.js", Joined("viewer.js", true)},
      {"set.json", page.set_json + "\n"}};
  for (size_t i = 0; i < page.views.size(); ++i) {
    files.push_back({"view-" + std::to_string(i) + ".bin", page.views[i]});
  }
  return files;
}

}  // namespace dtr::web
