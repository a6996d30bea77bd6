#include "capture/screening.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <system_error>
#include <utility>

#include "dtr/base/lower_case.h"
#include "dtr/base/order_statistics.h"
#include "dtr/types/area_average.h"
#include "dtr/types/luma.h"

namespace dtr::capture {
namespace {

constexpr int kBright = 254, kDark = 1;  // a level of slack: JPEG moves clipped values by one
constexpr double kBlurred = 0.25;        // of the median sharpness of photos of the same camera
constexpr double kClipped = 0.25;        // share of a photo's pixels
constexpr size_t kPhotosForAMedian = 3;
constexpr int kThumbnailSidePx = 64;
constexpr double kSameImage = 0.03;  // of the thumbnail's contrast
constexpr size_t kPhotosLookedBackAt = 100;
constexpr double kMoreBytes = 1.05;  // of one format: less was lost

// Sums of a value and its square, exact within a row, rows added in their order.
struct Moments {
  double sum = 0, squares = 0;
  std::int64_t count = 0;
  void AddRow(std::int64_t row_sum, std::int64_t row_squares, std::int64_t row_count) {
    sum += static_cast<double>(row_sum);
    squares += static_cast<double>(row_squares);
    count += row_count;
  }
  double Variance() const {
    if (count == 0) return 0;
    const auto n = static_cast<double>(count);
    return std::max(0.0, squares / n - (sum / n) * (sum / n));
  }
};

std::string Percent(double share) { return fmt::format("{:.0f} %", 100 * share); }

// Root mean square of a thumbnail about its mean: its contrast.
double ContrastOf(const Grid<std::uint16_t>& thumbnail) {
  Moments moments;
  for (const std::int64_t value : thumbnail.data()) moments.AddRow(value, value * value, 1);
  return std::sqrt(moments.Variance());
}

// Root mean square of what two thumbnails differ by; infinite where their sizes do.
double DifferenceOf(const Grid<std::uint16_t>& a, const Grid<std::uint16_t>& b) {
  if (a.width() != b.width() || a.height() != b.height()) {
    return std::numeric_limits<double>::infinity();
  }
  std::int64_t squares = 0;
  for (size_t i = 0; i < a.data().size(); ++i) {
    const std::int64_t difference = a.data()[i] - b.data()[i];
    squares += difference * difference;
  }
  return std::sqrt(static_cast<double>(squares) / static_cast<double>(a.data().size()));
}

// Whether a pixel and its 4 neighbours are usable.
bool CrossIsUsable(const Mask& mask, int x, int y) {
  return mask(x, y) != 0 && mask(x - 1, y) != 0 && mask(x + 1, y) != 0 && mask(x, y - 1) != 0 &&
         mask(x, y + 1) != 0;
}

void Add(Screening& screening, Fault fault, std::string remark) {
  screening.faults.push_back(fault);
  screening.remarks.push_back(std::move(remark));
}

// Photos of one image, rising, by the index of the first.
using Copies = std::map<size_t, std::vector<size_t>>;

// The first photo before photos[index] that shows the same image; `index` where there is none.
size_t FirstOfImage(const std::vector<Photo>& photos, const std::vector<size_t>& first_of,
                    size_t index) {
  const Grid<std::uint16_t>& thumbnail = photos[index].screening->thumbnail;
  if (thumbnail.empty()) return index;
  const double limit = kSameImage * ContrastOf(thumbnail);
  for (size_t other = index - std::min(index, kPhotosLookedBackAt); other < index; ++other) {
    const auto& earlier = photos[other].screening;
    if (!earlier || earlier->thumbnail.empty() || first_of[other] != other) continue;
    if (DifferenceOf(thumbnail, earlier->thumbnail) < limit) return other;
  }
  return index;
}

Copies FindCopies(const std::vector<Photo>& photos) {
  std::map<std::string, size_t> first_with_content;
  std::vector<size_t> first_of(photos.size());
  Copies copies;
  for (size_t i = 0; i < photos.size(); ++i) {
    first_of[i] = i;
    if (!photos[i].screening) continue;
    const auto [same, is_new] = first_with_content.emplace(photos[i].source_sha256, i);
    first_of[i] = is_new ? FirstOfImage(photos, first_of, i) : first_of[same->second];
    copies[first_of[i]].push_back(i);
  }
  return copies;
}

bool HasCameraData(const Photo& photo) {
  return photo.focal_prior_px || photo.gps || !photo.make.empty() || !photo.date_time.empty();
}

double BytesOf(const Photo& photo) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(photo.file, error);
  return error ? 0 : static_cast<double>(bytes);
}

// Whether `a` is the better one of two photos of one image. Sharpness says little of a photo that
// was compressed again, whose blocks have edges of their own, and nothing of one of another size.
bool IsBetterCopy(const Photo& a, const Photo& b) {
  const bool same_file = !a.source_sha256.empty() && a.source_sha256 == b.source_sha256;
  if (same_file) return a.name.size() < b.name.size();  // "IMG_1 (1).jpg"
  const auto pixels = [](const Photo& photo) {
    return static_cast<std::int64_t>(photo.width_px) * photo.height_px;
  };
  if (pixels(a) != pixels(b)) return pixels(a) > pixels(b);
  const double a_sharpness = a.screening->sharpness, b_sharpness = b.screening->sharpness;
  if (b_sharpness < kBlurred * a_sharpness) return true;
  if (a_sharpness < kBlurred * b_sharpness) return false;
  if (HasCameraData(a) != HasCameraData(b)) return HasCameraData(a);
  if (LowerExtension(a.file) != LowerExtension(b.file)) return false;
  return BytesOf(a) > kMoreBytes * BytesOf(b);
}

void NameDuplicates(std::vector<Photo>& photos) {
  for (const auto& [first, copies] : FindCopies(photos)) {
    if (copies.size() < 2) continue;
    const Photo& best = photos[BestCopy(photos, copies)];
    for (const size_t i : copies) {
      Photo& photo = photos[i];
      if (&photo == &best) continue;
      photo.screening->duplicate_of = best.name;
      const Grid<std::uint16_t>& thumbnail = photo.screening->thumbnail;
      Add(*photo.screening, Fault::kDuplicate,
          photo.source_sha256 == best.source_sha256
              ? "has the same bytes as " + best.name
              : fmt::format("shows the same image as {}: they differ by {:.1f} % of its contrast",
                            best.name,
                            100 * DifferenceOf(thumbnail, best.screening->thumbnail) /
                                ContrastOf(thumbnail)));
    }
  }
}

std::map<std::string, double> MedianSharpnessByCamera(const std::vector<Photo>& photos) {
  std::map<std::string, std::vector<double>> all;
  for (const Photo& photo : photos) {
    if (photo.screening) all[photo.camera_group].push_back(photo.screening->sharpness);
  }
  std::map<std::string, double> medians;
  for (auto& [group, values] : all) {
    if (values.size() < kPhotosForAMedian) continue;
    medians[group] = UpperMedian(values);
  }
  return medians;
}

}  // namespace

double Sharpness(const ImageRgb8& photo, const Mask& mask) {
  const int width = photo.width(), height = photo.height();
  if (width < 3 || height < 3) return 0;
  std::array<std::vector<int>, 3> rows;  // above, this, below
  const auto load = [&](std::vector<int>& row, int y) {
    row.resize(static_cast<size_t>(width));
    for (int x = 0; x < width; ++x) row[static_cast<size_t>(x)] = Luma(&photo(x, y));
  };
  load(rows[0], 0);
  load(rows[1], 1);
  Moments brightness, laplacian;
  for (int y = 1; y + 1 < height; ++y) {
    load(rows[2], y + 1);
    std::int64_t sum = 0, squares = 0, lap_sum = 0, lap_squares = 0;
    std::int64_t counted = 0;
    for (size_t x = 1; x + 1 < static_cast<size_t>(width); ++x) {
      if (!mask.empty() && !CrossIsUsable(mask, static_cast<int>(x), y)) continue;
      ++counted;
      const std::int64_t value = rows[1][x];
      const std::int64_t lap =
          rows[0][x] + rows[2][x] + rows[1][x - 1] + rows[1][x + 1] - 4 * value;
      sum += value;
      squares += value * value;
      lap_sum += lap;
      lap_squares += lap * lap;
    }
    brightness.AddRow(sum, squares, counted);
    laplacian.AddRow(lap_sum, lap_squares, counted);
    std::rotate(rows.begin(), rows.begin() + 1, rows.end());
  }
  // Below a hundredth of a level there is nothing but the rounding of the means.
  constexpr double kNoVariance = 1e-4 * 256 * 256;
  return brightness.Variance() > kNoVariance ? laplacian.Variance() / brightness.Variance() : 0;
}

Grid<std::uint16_t> SmallLuma(const ImageRgb8& photo, int side_px) {
  const auto [width, height] = TargetSize(photo.width(), photo.height(), side_px);
  const ImageRgb8 small = AreaAverage(photo, width, height);
  Grid<std::uint16_t> luma(width, height);
  for (size_t i = 0; i < luma.data().size(); ++i) {
    luma.data()[i] = static_cast<std::uint16_t>(Luma(&small.data()[3 * i]));
  }
  return luma;
}

size_t BestCopy(const std::vector<Photo>& photos, const std::vector<size_t>& copies) {
  size_t best = copies.front();
  for (const size_t other : copies) {
    if (IsBetterCopy(photos[other], photos[best])) best = other;
  }
  return best;
}

Screening MeasurePhoto(const ImageRgb8& photo, const Mask& mask) {
  Screening screening;
  screening.sharpness = Sharpness(photo, mask);
  std::int64_t over = 0, under = 0, usable = 0;
  const std::uint8_t* rgb = photo.data().data();
  const std::int64_t pixels = static_cast<std::int64_t>(photo.width()) * photo.height();
  for (std::int64_t i = 0; i < pixels; ++i, rgb += 3) {
    if (!mask.empty() && mask.data()[static_cast<size_t>(i)] == 0) continue;
    ++usable;
    const int most = std::max({rgb[0], rgb[1], rgb[2]});
    over += most >= kBright;
    under += most <= kDark;
  }
  const double all = std::max(1.0, static_cast<double>(usable));
  screening.overexposed_share = static_cast<double>(over) / all;
  screening.underexposed_share = static_cast<double>(under) / all;
  screening.thumbnail = SmallLuma(photo, kThumbnailSidePx);
  return screening;
}

void ScreenPhotos(std::vector<Photo>& photos) {
  const auto medians = MedianSharpnessByCamera(photos);
  for (Photo& photo : photos) {
    if (!photo.screening) continue;
    photo.screening->duplicate_of.clear();
    photo.screening->faults.clear();
    photo.screening->remarks.clear();
  }
  NameDuplicates(photos);
  for (Photo& photo : photos) {
    if (!photo.screening) continue;
    Screening& screening = *photo.screening;
    const auto median = medians.find(photo.camera_group);
    if (median != medians.end() && screening.sharpness < kBlurred * median->second) {
      Add(screening, Fault::kBlurred,
          "may be blurred: sharpness is " + Percent(screening.sharpness / median->second) +
              " of its camera's median");
    }
    if (screening.overexposed_share > kClipped) {
      Add(screening, Fault::kOverexposed,
          Percent(screening.overexposed_share) + " of it is overexposed");
    }
    if (screening.underexposed_share > kClipped) {
      Add(screening, Fault::kUnderexposed,
          Percent(screening.underexposed_share) + " of it is underexposed");
    }
  }
}

}  // namespace dtr::capture
