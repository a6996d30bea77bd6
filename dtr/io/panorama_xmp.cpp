#include "dtr/io/panorama_xmp.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

#include "dtr/base/files.h"
#include "dtr/base/lower_case.h"
#include "dtr/base/regular_file.h"
#include "dtr/io/oiio_files.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

constexpr std::streamoff kSearchedBytes = 1 << 20;
constexpr size_t kLongestValue = 64;

bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

std::string_view Trimmed(std::string_view text) {
  while (!text.empty() && IsSpace(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsSpace(text.back())) text.remove_suffix(1);
  return text;
}

// What follows the name of a field: ="value" or >value<; nothing for a longer name, a closing tag
// or a value without end.
std::optional<std::string_view> ValueAt(std::string_view rest) {
  while (!rest.empty() && IsSpace(rest.front())) rest.remove_prefix(1);
  if (rest.empty()) return {};
  char end = '<';
  if (rest.front() == '=') {
    rest.remove_prefix(1);
    while (!rest.empty() && IsSpace(rest.front())) rest.remove_prefix(1);
    if (rest.empty() || (rest.front() != '"' && rest.front() != '\'')) return {};
    end = rest.front();
  } else if (rest.front() != '>') {
    return {};
  }
  rest.remove_prefix(1);
  const size_t length = rest.substr(0, kLongestValue).find(end);
  if (length == std::string_view::npos) return {};
  return Trimmed(rest.substr(0, length));
}

std::optional<std::string_view> Field(std::string_view xmp, std::string_view name) {
  for (size_t at = xmp.find(name); at != std::string_view::npos; at = xmp.find(name, at + 1)) {
    if (at > 0 && xmp[at - 1] == '/') continue;  // a closing tag
    if (const auto value = ValueAt(xmp.substr(at + name.size()))) return value;
  }
  return {};
}

std::optional<double> Number(std::string_view xmp, std::string_view name) {
  const auto text = Field(xmp, name);
  if (!text) return {};
  double value = 0;
  const auto [end, failure] = std::from_chars(text->data(), text->data() + text->size(), value);
  if (failure != std::errc() || end != text->data() + text->size() || !std::isfinite(value)) {
    return {};
  }
  return value;
}

double Size(std::string_view xmp, std::string_view name) {
  constexpr double kMaxPx = 1e6;
  const double value = Number(xmp, name).value_or(0);
  return value >= 0 && value <= kMaxPx ? value : 0;
}

std::string Part(std::ifstream& in, std::streamoff from, std::streamoff bytes) {
  std::string text(static_cast<size_t>(bytes), '\0');
  in.clear();
  in.seekg(from);
  in.read(text.data(), bytes);
  text.resize(static_cast<size_t>(std::max<std::streamsize>(in.gcount(), 0)));
  return text;
}

// A segment of a JPEG with the packet, as Adobe's XMP specification part 3 has it.
std::string XmpSegment(const std::string& xmp) {
  std::string content = std::string("http://ns.adobe.com/xap/1.0/") + '\0' + xmp;
  const size_t length = content.size() + 2;
  std::string segment = "\xff\xe1";
  segment += static_cast<char>(length >> 8);
  segment += static_cast<char>(length & 0xff);
  return segment + content;
}

}  // namespace

std::optional<PanoramaXmp> PanoramaXmpIn(std::string_view xmp) {
  const auto projection = Field(xmp, "GPano:ProjectionType");
  if (!projection) return {};
  PanoramaXmp stated;
  stated.projection = LowerCase(std::string(*projection));
  stated.full_width_px = Size(xmp, "GPano:FullPanoWidthPixels");
  stated.full_height_px = Size(xmp, "GPano:FullPanoHeightPixels");
  stated.cropped_width_px = Size(xmp, "GPano:CroppedAreaImageWidthPixels");
  stated.cropped_height_px = Size(xmp, "GPano:CroppedAreaImageHeightPixels");
  stated.left_px = Size(xmp, "GPano:CroppedAreaLeftPixels");
  stated.top_px = Size(xmp, "GPano:CroppedAreaTopPixels");
  stated.heading_deg = Number(xmp, "GPano:PoseHeadingDegrees");
  stated.pitch_deg = Number(xmp, "GPano:PosePitchDegrees");
  stated.roll_deg = Number(xmp, "GPano:PoseRollDegrees");
  return stated;
}

std::optional<PanoramaXmp> ReadPanoramaXmp(const fs::path& file) {
  std::error_code error;
  const auto size = static_cast<std::streamoff>(fs::file_size(file, error));
  if (error) return {};
  std::ifstream in = StreamOf(file);
  if (auto stated = PanoramaXmpIn(Part(in, 0, std::min(size, kSearchedBytes)))) return stated;
  if (size <= kSearchedBytes) return {};
  const std::streamoff from = std::max(kSearchedBytes / 2, size - kSearchedBytes);
  return PanoramaXmpIn(Part(in, from, size - from));
}

void WritePanoramaJpeg(const fs::path& file, const ImageRgb8& image, int quality) {
  const ImageToWrite photo{
      image.width(),
      image.height(),
      3,
      Sample::kUint8,
      {{"CompressionQuality", std::clamp(quality, 1, 100)}, {"jpeg:subsampling", "4:4:4"}}};
  std::string jpeg = EncodeImage(".jpg", photo, Sample::kUint8, image.data().data());
  const std::string width = std::to_string(image.width()), height = std::to_string(image.height());
  const std::string xmp =
      "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF "
      "xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\"><rdf:Description rdf:about=\"\" "
      "xmlns:GPano=\"http://ns.google.com/photos/1.0/panorama/\" "
      "GPano:ProjectionType=\"equirectangular\" GPano:FullPanoWidthPixels=\"" +
      width + "\" GPano:FullPanoHeightPixels=\"" + height +
      "\" GPano:CroppedAreaImageWidthPixels=\"" + width +
      "\" GPano:CroppedAreaImageHeightPixels=\"" + height +
      "\" GPano:CroppedAreaLeftPixels=\"0\" GPano:CroppedAreaTopPixels=\"0\"/></rdf:RDF>"
      "</x:xmpmeta>";
  // Behind the marker of a JPEG's start, and behind JFIF's segment, which must come first.
  size_t at = 2;
  if (jpeg.size() > 6 && jpeg.compare(2, 2, "\xff\xe0") == 0) {
    at = 4 + 256 * static_cast<unsigned char>(jpeg[4]) + static_cast<unsigned char>(jpeg[5]);
  }
  jpeg.insert(at, XmpSegment(xmp));
  WriteFileAtomically(file, jpeg);
}

}  // namespace dtr::io
