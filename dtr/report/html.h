// dtr/report/html.h -- the one writer of HTML pages; a page needs no network and no other file.
#pragma once
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "dtr/types/grid.h"

namespace dtr::report {

/// An image with a description: its caption, or for those who cannot see it.
struct Picture {
  ImageRgb8 image;
  std::string description;
};
/// A table cell.
using Cell = std::variant<std::string, Picture>;

/// Builds a page from top to bottom. All text is escaped; images are inlined as JPEG, plots as
/// SVG images, in which a browser runs no script. The same calls give the same bytes.
class HtmlReport {
 public:
  explicit HtmlReport(std::string_view title);

  void Section(std::string_view title);
  void Paragraph(std::string_view text);
  /// A short fact above the rest, in colour: a validation result.
  void Result(bool good, std::string_view text);
  /// Numbers are set right-aligned: columns whose every cell is a number, optionally with a unit.
  /// Throws std::invalid_argument when a row has not the header's number of cells.
  void Table(const std::vector<std::string>& header, const std::vector<std::vector<Cell>>& rows);
  void Image(std::string_view caption, const ImageRgb8& image);
  /// Small images in rows, each over its description; empty ones are left out.
  void Gallery(const std::vector<Picture>& pictures);
  /// `svg`: a whole SVG document.
  void Svg(std::string_view caption, std::string_view svg);
  /// `svg`: what ScatterSvg gives. It becomes part of the page, so that its points tell what they
  /// are; nothing else may come this way, as it is not escaped.
  void Plot(std::string_view caption, std::string_view svg);

  /// The page. The report can be continued afterwards.
  std::string Finish() const;

 private:
  std::string title_, body_;
};

}  // namespace dtr::report
