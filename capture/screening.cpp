#include "capture/screening.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>

namespace dtr::capture {
namespace {

constexpr int kBright = 254, kDark = 1;  // a level of slack: JPEG moves clipped values by one
constexpr double kBlurred = 0.25;        // of the median sharpness of photos of the same camera
constexpr double kClipped = 0.25;        // share of a photo's pixels
constexpr size_t kPhotosForAMedian = 3;

// Rec. 601 luma in 1/256 levels, as integers so that sums are exact.
int Luma(const std::uint8_t* rgb) { return 77 * rgb[0] + 150 * rgb[1] + 29 * rgb[2]; }

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

double Sharpness(const ImageRgb8& photo) {
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
    for (size_t x = 1; x + 1 < static_cast<size_t>(width); ++x) {
      const std::int64_t value = rows[1][x];
      const std::int64_t lap =
          rows[0][x] + rows[2][x] + rows[1][x - 1] + rows[1][x + 1] - 4 * value;
      sum += value;
      squares += value * value;
      lap_sum += lap;
      lap_squares += lap * lap;
    }
    brightness.AddRow(sum, squares, width - 2);
    laplacian.AddRow(lap_sum, lap_squares, width - 2);
    std::rotate(rows.begin(), rows.begin() + 1, rows.end());
  }
  // Below a hundredth of a level there is nothing but the rounding of the means.
  constexpr double kNoVariance = 1e-4 * 256 * 256;
  return brightness.Variance() > kNoVariance ? laplacian.Variance() / brightness.Variance() : 0;
}

std::string Percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f %%", 100 * share);
  return text;
}

std::map<std::string, double> MedianSharpnessByCamera(const std::vector<Photo>& photos) {
  std::map<std::string, std::vector<double>> all;
  for (const Photo& photo : photos) {
    if (photo.screening) all[photo.camera_group].push_back(photo.screening->sharpness);
  }
  std::map<std::string, double> medians;
  for (auto& [group, values] : all) {
    if (values.size() < kPhotosForAMedian) continue;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    medians[group] = *middle;
  }
  return medians;
}

}  // namespace

Screening MeasurePhoto(const ImageRgb8& photo) {
  Screening screening;
  screening.sharpness = Sharpness(photo);
  std::int64_t over = 0, under = 0;
  const std::uint8_t* rgb = photo.data().data();
  const std::int64_t pixels = static_cast<std::int64_t>(photo.width()) * photo.height();
  for (std::int64_t i = 0; i < pixels; ++i, rgb += 3) {
    const int most = std::max({rgb[0], rgb[1], rgb[2]});
    over += most >= kBright;
    under += most <= kDark;
  }
  screening.overexposed_share = static_cast<double>(over) / static_cast<double>(pixels);
  screening.underexposed_share = static_cast<double>(under) / static_cast<double>(pixels);
  return screening;
}

void JudgePhotos(std::vector<Photo>& photos) {
  const auto medians = MedianSharpnessByCamera(photos);
  std::map<std::string, std::string> first_with_content;
  for (Photo& photo : photos) {
    if (!photo.screening) continue;
    Screening& screening = *photo.screening;
    const auto [first, is_new] = first_with_content.emplace(photo.source_sha256, photo.name);
    if (!is_new) {
      screening.duplicate_of = first->second;
      screening.remarks.push_back("has the same bytes as " + first->second);
    }
    const auto median = medians.find(photo.camera_group);
    if (median != medians.end() && screening.sharpness < kBlurred * median->second) {
      screening.remarks.push_back("may be blurred: sharpness is " +
                                  Percent(screening.sharpness / median->second) +
                                  " of its camera's median");
    }
    if (screening.overexposed_share > kClipped) {
      screening.remarks.push_back(Percent(screening.overexposed_share) + " of it is overexposed");
    }
    if (screening.underexposed_share > kClipped) {
      screening.remarks.push_back(Percent(screening.underexposed_share) + " of it is underexposed");
    }
  }
}

}  // namespace dtr::capture
