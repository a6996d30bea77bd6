#include "capture/screening.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

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

// An earlier photo that shows the same image as photos[index].
void FindSameImage(std::vector<Photo>& photos, size_t index) {
  Screening& screening = *photos[index].screening;
  const double contrast = ContrastOf(screening.thumbnail);
  const size_t first = index - std::min(index, kPhotosLookedBackAt);
  for (size_t other = first; other < index; ++other) {
    const auto& earlier = photos[other].screening;
    if (!earlier || earlier->thumbnail.empty() || !earlier->duplicate_of.empty()) continue;
    const double difference = DifferenceOf(screening.thumbnail, earlier->thumbnail);
    if (!(difference < kSameImage * contrast)) continue;
    screening.duplicate_of = photos[other].name;
    return Add(screening, Fault::kDuplicate,
               fmt::format("shows the same image as {}: they differ by {:.1f} % of its contrast",
                           photos[other].name, 100 * difference / contrast));
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
  std::map<std::string, std::string> first_with_content;
  for (size_t i = 0; i < photos.size(); ++i) {
    const Photo& photo = photos[i];
    if (!photo.screening) continue;
    Screening& screening = *photos[i].screening;
    screening.duplicate_of.clear();
    screening.faults.clear();
    screening.remarks.clear();
    const auto [first, is_new] = first_with_content.emplace(photo.source_sha256, photo.name);
    if (!is_new) {
      screening.duplicate_of = first->second;
      Add(screening, Fault::kDuplicate, "has the same bytes as " + first->second);
    } else if (!screening.thumbnail.empty()) {
      FindSameImage(photos, i);
    }
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
