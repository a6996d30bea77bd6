#include "dtr/report/html.h"

#include <algorithm>
#include <cctype>
#include <stdexcept>

#include "dtr/report/encode.h"

namespace dtr::report {
namespace {

constexpr int kJpegQuality = 88;  // thumbnails are looked at, not measured

constexpr std::string_view kStyle = R"css(
:root { color-scheme: light dark;
  --ink: #1d2430; --soft: #5c6675; --line: #dde2e9; --page: #fbfcfd; --card: #ffffff;
  --good: #1b7f4b; --bad: #b3261e; --accent: #2f5fb3; }
@media (prefers-color-scheme: dark) { :root {
  --ink: #e6e9ee; --soft: #9aa5b4; --line: #333b47; --page: #14181e; --card: #1c222a;
  --good: #58c98c; --bad: #ff8a80; --accent: #8ab4ff; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 76rem; padding: 2rem 1.25rem 4rem; background: var(--page);
  color: var(--ink); font: 15px/1.5 system-ui, -apple-system, "Segoe UI", sans-serif; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 1.5rem; overflow-wrap: break-word; }
h2 { font-size: 1.15rem; margin: 2.4rem 0 .8rem; padding-bottom: .3rem;
  border-bottom: 2px solid var(--accent); }
p { max-width: 46rem; margin: .6rem 0; white-space: pre-line; overflow-wrap: break-word; }
.result { display: inline-block; font-weight: 600; padding: .3rem .8rem; border-radius: 1rem;
  border: 1.5px solid currentColor; max-width: none; }
.good { color: var(--good); } .bad { color: var(--bad); }
.scroll { overflow-x: auto; background: var(--card); border: 1px solid var(--line);
  border-radius: .5rem; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th { text-align: left; font-weight: 600; color: var(--soft); font-size: .85rem; }
th, td { padding: .45rem .8rem; border-bottom: 1px solid var(--line); vertical-align: middle;
  overflow-wrap: break-word; }
tbody tr:last-child td { border-bottom: 0; }
.number { text-align: right; }
.number, .brief { white-space: nowrap; }
td img { display: block; max-width: 20rem; height: auto; border-radius: .25rem; }
figure { margin: 1rem 0; }
figure img { display: block; max-width: 100%; height: auto; border-radius: .4rem; }
figure img.plot { background: #fff; padding: .5rem; border: 1px solid var(--line); }
figure.plot svg { display: block; width: 100%; height: auto; border: 1px solid var(--line);
  border-radius: .4rem; }
figcaption { color: var(--soft); font-size: .9rem; margin-top: .35rem; overflow-wrap: break-word; }
.gallery { display: flex; flex-wrap: wrap; gap: .8rem; align-items: end; }
.gallery figure { margin: 0; max-width: 100%; break-inside: avoid; }
@media screen and (max-width: 40rem) {  /* a phone: a row is a block, each cell has its column's name */
  thead { display: none; }
  tr { display: block; padding: .5rem 0; border-bottom: 1px solid var(--line); }
  td { display: block; border: 0; padding: .1rem .8rem; }
  .number { text-align: left; }
  td::before { content: attr(data-column); color: var(--soft); margin-right: .5rem; }
  td img { max-width: 100%; } }
@media print { body { background: #fff; color: #000; max-width: none; } }
)css";

std::string ImageElement(const ImageRgb8& image, std::string_view description) {
  return "<img alt=\"" + EscapeHtml(description) + "\" width=\"" + std::to_string(image.width()) +
         "\" height=\"" + std::to_string(image.height()) + "\" src=\"data:image/jpeg;base64," +
         Base64(EncodeJpeg(image, kJpegQuality)) + "\">";
}

/// Digits first, perhaps after a sign, and at most one short word after them: "12", "-3.5 dB".
bool LooksLikeNumber(const Cell& cell) {
  const auto* text = std::get_if<std::string>(&cell);
  if (text == nullptr) return false;
  if (text->empty() || *text == "-") return true;  // no value
  size_t i = (*text)[0] == '-' || (*text)[0] == '+' ? 1 : 0;
  const size_t first = i;
  while (i < text->size() && (std::isdigit(static_cast<unsigned char>((*text)[i])) != 0 ||
                              (*text)[i] == '.' || (*text)[i] == 'e')) {
    ++i;
  }
  const auto is_digit = [&](size_t at) {
    return std::isdigit(static_cast<unsigned char>((*text)[at])) != 0;
  };
  // A unit may follow; what follows a dot is no unit: 0010.jpg is a name.
  return i > first && is_digit(first) && is_digit(i - 1) && text->size() - i <= 4;
}

/// A few words, which a line has room for.
bool IsBrief(const Cell& cell) {
  constexpr size_t kMaxBytes = 16;
  const auto* text = std::get_if<std::string>(&cell);
  return text != nullptr && text->size() <= kMaxBytes;
}

/// Classes of the columns of a table.
std::vector<const char*> ClassesOf(size_t columns, const std::vector<std::vector<Cell>>& rows) {
  std::vector<const char*> classes(columns, "");
  for (size_t i = 0; i < columns && !rows.empty(); ++i) {
    const auto all = [&](bool (*holds)(const Cell&)) {
      return std::all_of(rows.begin(), rows.end(), [&](const auto& row) { return holds(row[i]); });
    };
    if (all(LooksLikeNumber)) {
      classes[i] = " class=\"number\"";
    } else if (all(IsBrief)) {
      classes[i] = " class=\"brief\"";
    }
  }
  return classes;
}

}  // namespace

HtmlReport::HtmlReport(std::string_view title) : title_(EscapeHtml(title)) {}

void HtmlReport::Section(std::string_view title) {
  body_ += "<h2>" + EscapeHtml(title) + "</h2>\n";
}

void HtmlReport::Paragraph(std::string_view text) { body_ += "<p>" + EscapeHtml(text) + "</p>\n"; }

void HtmlReport::Result(bool good, std::string_view text) {
  // The sign repeats what the colour says, for print and for the colour-blind.
  body_ += std::string("<p class=\"result ") + (good ? "good\">&#10003; " : "bad\">&#10007; ") +
           EscapeHtml(text) + "</p>\n";
}

void HtmlReport::Table(const std::vector<std::string>& header,
                       const std::vector<std::vector<Cell>>& rows) {
  for (const auto& row : rows) {
    if (row.size() != header.size()) {
      throw std::invalid_argument(
          "HtmlReport::Table: a row has another number of cells than the "
          "header");
    }
  }
  const std::vector<const char*> classes = ClassesOf(header.size(), rows);
  const auto open = [&](const std::string& tag, size_t column) {
    return "<" + tag + classes[column] + ">";
  };
  body_ += "<div class=\"scroll\"><table><thead><tr>";
  for (size_t i = 0; i < header.size(); ++i) {
    body_ += open("th", i) + EscapeHtml(header[i]) + "</th>";
  }
  body_ += "</tr></thead><tbody>\n";
  for (const auto& row : rows) {
    body_ += "<tr>";
    for (size_t i = 0; i < row.size(); ++i) {
      body_ += open("td data-column=\"" + EscapeHtml(header[i]) + "\"", i);
      if (const auto* text = std::get_if<std::string>(&row[i])) {
        body_ += EscapeHtml(*text);
      } else {
        const Picture& picture = std::get<Picture>(row[i]);
        if (!picture.image.empty()) body_ += ImageElement(picture.image, picture.description);
      }
      body_ += "</td>";
    }
    body_ += "</tr>\n";
  }
  body_ += "</tbody></table></div>\n";
}

void HtmlReport::Image(std::string_view caption, const ImageRgb8& image) {
  body_ += "<figure>" + ImageElement(image, caption) + "<figcaption>" + EscapeHtml(caption) +
           "</figcaption></figure>\n";
}

void HtmlReport::Gallery(const std::vector<Picture>& pictures) {
  body_ += "<div class=\"gallery\">\n";
  for (const Picture& picture : pictures) {
    if (!picture.image.empty()) Image(picture.description, picture.image);
  }
  body_ += "</div>\n";
}

void HtmlReport::Svg(std::string_view caption, std::string_view svg) {
  body_ += "<figure><img class=\"plot\" alt=\"" + EscapeHtml(caption) +
           "\" src=\"data:image/svg+xml;base64," + Base64(svg) + "\"><figcaption>" +
           EscapeHtml(caption) + "</figcaption></figure>\n";
}

void HtmlReport::Plot(std::string_view caption, std::string_view svg) {
  body_ += "<figure class=\"plot\">" + std::string(svg) + "<figcaption>" + EscapeHtml(caption) +
           "</figcaption></figure>\n";
}

std::string HtmlReport::Finish() const {
  std::string page = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  // The browser itself rejects whatever is not in the page.
  page +=
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
      "style-src 'unsafe-inline'\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>";
  page += title_ + "</title>\n<style>";
  page += kStyle;
  page += "</style>\n</head>\n<body>\n<h1>" + title_ + "</h1>\n" + body_ + "</body>\n</html>\n";
  return page;
}

}  // namespace dtr::report
