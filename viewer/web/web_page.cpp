#include "viewer/web/web_page.h"

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>

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
  ReplaceAll(text, "&", "&amp;");
  ReplaceAll(text, "<", "&lt;");
  ReplaceAll(text, ">", "&gt;");
  return text;
}

/// A module without its imports and exports, after the modules that it imports.
void AddModule(std::string_view name, std::set<std::string_view>& done, std::string& script) {
  if (!done.insert(name).second) return;
  const std::string_view text = TextOf(name);
  std::string body;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size() - 1) + 1;
    std::string_view line = text.substr(at, end - at);
    if (line.starts_with("import ")) {
      const size_t last = text.find(";\n", at);
      const std::string_view statement = text.substr(at, last - at);
      const size_t from = statement.find("\"./") + 3;
      AddModule(statement.substr(from, statement.size() - from - 1), done, script);
      at = last + 2;
      continue;
    }
    constexpr std::string_view kExport = "export ";
    if (line.starts_with(kExport)) line.remove_prefix(kExport.size());
    body += line;
    at = end;
  }
  script += body;
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

// What HTML's parser changes or ends a script element at.
constexpr std::string_view kForbidden("\0\n\r<", 4);

constexpr std::string_view kViewEnd = "</script>\n";
std::string ViewStart(size_t index) {
  return "<script type=\"text/plain\" id=\"view-" + std::to_string(index) + "\">";
}

/// The page around its views: before and after.
std::pair<std::string, std::string> Frame(const WebPage& page) {
  std::string text(TextOf("index.html"));
  constexpr std::string_view kViews = "{{views}}\n";
  const size_t at = text.find(kViews);
  std::string after = text.substr(at + kViews.size());
  text.resize(at);
  // Texts of the set come last: nothing in them is taken for a place to fill in.
  ReplaceAll(text, "{{style}}", TextOf("page.css"));
  ReplaceAll(text, "{{shaders}}", WithoutTags(ShadersJson()));
  ReplaceAll(text, "{{script}}", JoinedScript());
  ReplaceAll(text, "{{version}}", EscapedHtml(page.version));
  const size_t title = text.find("{{title}}"), set = text.find("{{set}}");
  text.replace(set, 7, WithoutTags(page.set_json));
  text.replace(title, 9, EscapedHtml(page.title));
  return {std::move(text), std::move(after)};
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

std::string JoinedScript() {
  std::set<std::string_view> done;
  std::string script;
  AddModule("main.js", done, script);
  return script;
}

std::string MakeWebPage(const WebPage& page) {
  auto [text, after] = Frame(page);
  for (size_t i = 0; i < page.views.size(); ++i) {
    text += ViewStart(i);
    text += TextOfBytes(page.views[i]);
    text += kViewEnd;
  }
  return text + after;
}

}  // namespace dtr::web
