// The fused depth maps as a cloud for programs of surveyors: LAS 1.4 (ASPRS, revision 15).
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "dtr/base/error.h"
#include "dtr/base/file_stream.h"
#include "dtr/base/files.h"
#include "pipeline/export/detail/common.h"
#include "pipeline/export/detail/file_in_work.h"
#include "pipeline/export/detail/fuse.h"
#include "pipeline/export/export.h"

namespace dtr::pipeline {
namespace {

constexpr std::uint16_t kLasHeaderBytes = 375, kVlrBytes = 54, kExtraBytes = 192;
constexpr std::uint16_t kPointBytes = 26 + 4;  // format 2 and a float
constexpr std::uint8_t kFloatType = 9;

struct LasHeader {
  double step = 1;  ///< of whole numbers, user's unit
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::max());
  Eigen::Vector3d high = -low;
  std::uint64_t count = 0;
  std::string facts;
};

// A text of so many bytes, zeros behind it.
std::string Fixed(std::string text, size_t bytes) {
  text.resize(bytes, '\0');
  return text;
}

// Numbers one after the other.
class Bytes {
 public:
  template <typename T>
  Bytes& Put(T value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    text_.append(raw, sizeof value);
    return *this;
  }
  Bytes& Text(const std::string& text) {
    text_ += text;
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

std::string Vlr(const std::string& user, std::uint16_t record, const std::string& description,
                const std::string& data) {
  return Bytes()
      .Put(std::uint16_t{0})
      .Text(Fixed(user, 16))
      .Put(record)
      .Put(static_cast<std::uint16_t>(data.size()))
      .Text(Fixed(description, 32))
      .Text(data)
      .text();
}

std::string HeaderOf(const LasHeader& header) {
  const std::string sigma = Bytes()
                                .Put(std::uint16_t{0})
                                .Put(kFloatType)
                                .Put(std::uint8_t{0})
                                .Text(Fixed("sigma", 32))
                                .Text(Fixed("", 124))
                                .Text(Fixed("standard deviation, along ray", 32))
                                .text();
  const std::string vlrs =
      Vlr("LASF_Spec", 4, "extra bytes", sigma) + Vlr("dtr", 1, "about the set", header.facts);
  const bool legacy = header.count <= std::numeric_limits<std::uint32_t>::max();
  const auto few = static_cast<std::uint32_t>(legacy ? header.count : 0);
  Bytes bytes;
  bytes.Text("LASF").Put(std::uint32_t{0}).Text(Fixed("", 16));
  bytes.Put(std::uint8_t{1}).Put(std::uint8_t{4});
  bytes.Text(Fixed("depth maps of photos", 32)).Text(Fixed("dtr " DTR_VERSION, 32));
  bytes.Put(std::uint32_t{0}).Put(kLasHeaderBytes);
  bytes.Put(static_cast<std::uint32_t>(kLasHeaderBytes + vlrs.size())).Put(std::uint32_t{2});
  bytes.Put(std::uint8_t{2}).Put(kPointBytes).Put(few).Put(few);
  for (int i = 1; i < 5; ++i) bytes.Put(std::uint32_t{0});
  for (int c = 0; c < 3; ++c) bytes.Put(header.step);
  for (int c = 0; c < 3; ++c) bytes.Put(header.offset[c]);
  for (int c = 0; c < 3; ++c) bytes.Put(header.high[c]).Put(header.low[c]);
  bytes.Put(std::uint64_t{0}).Put(std::uint64_t{0}).Put(std::uint32_t{0});
  bytes.Put(header.count).Put(header.count);
  for (int i = 1; i < 15; ++i) bytes.Put(std::uint64_t{0});
  return bytes.Text(vlrs).text();
}

// The least power of ten of which 31 bits reach from the origin beyond all that views show.
double StepOf(const DtrSet& set) {
  double reach = 0;
  for (const View& view : set.frames.front().views) {
    if (!view.depth_file) continue;
    const Eigen::Vector3d corner = view.camera.RayFromPixel({0, 0});
    const Eigen::Vector3d across =
        view.camera.RayFromPixel({view.camera.width_px() + 0.0, view.camera.height_px() + 0.0});
    const double far_z = std::max(view.far_z, view.completed_far_z);
    reach = std::max(reach, view.CenterInWorld().norm() +
                                far_z * (1.1 * std::max(corner.norm(), across.norm())));
  }
  if (!(reach > 0)) return 1e-3;
  return std::pow(10.0, std::ceil(std::log10(reach / 2e9)));
}

void PutPoint(const FusedSample& sample, int view, LasHeader& header, FileStream& file) {
  for (int c = 0; c < 3; ++c) {
    const double steps = std::round(sample.p_in_world[c] / header.step);
    if (!(std::abs(steps) < 2147483647.0)) {
      throw Error("a point lies beyond 32 bits of the step; choose --format ply");
    }
    file.Put(static_cast<std::int32_t>(steps));
    const double value = steps * header.step + header.offset[c];
    header.low[c] = std::min(header.low[c], value);
    header.high[c] = std::max(header.high[c], value);
  }
  constexpr std::uint8_t kOnlyReturn = 1 | 1 << 3;
  file.Put(std::uint16_t{0});  // intensity
  file.Put(kOnlyReturn);
  file.Put(std::uint8_t{0});  // never classified
  file.Put(std::uint8_t{0});  // angle
  file.Put(static_cast<std::uint8_t>(std::min(sample.views, 255)));
  file.Put(static_cast<std::uint16_t>(std::min(view + 1, 65535)));
  for (const std::uint8_t v : sample.rgb) file.Put(static_cast<std::uint16_t>(257 * v));
  file.Put(sample.sigma);
  ++header.count;
}

}  // namespace

ExportReport ExportLas(const ExportRequest& request, Progress& progress) {
  const DtrSet set = SetWithDepth(request, "las", progress);
  FileInWork target(WithoutTrailingSlash(request.output));
  LasHeader header;
  header.step = StepOf(set);
  header.offset = set.world_origin;
  for (const std::string& line : FactLines(set)) header.facts += line + "\n";
  SurfaceViews views(request.set, set, SurfaceOptions(request, true));
  FileStream file(target.path());
  file.Write(HeaderOf(header));
  Fuse(
      views, {.min_views = request.min_views},
      [&](const SurfaceView& surface, const std::vector<FusedSample>& samples) {
        for (const FusedSample& sample : samples) PutPoint(sample, surface.index, header, file);
      },
      progress);
  if (header.count == 0) header.low = header.high = header.offset;
  file.Replace(HeaderOf(header));
  target.Publish();
  return {.images = views.WithDepth().size(), .points = header.count};
}

}  // namespace dtr::pipeline
