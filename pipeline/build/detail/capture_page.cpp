#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/report/contact_sheet.h"
#include "dtr/report/html.h"
#include "pipeline/build/capture.h"

namespace dtr::pipeline {
namespace {

constexpr int kThumbnailPx = 192;
constexpr int kWidestSheet = 12;  // images in a row

using Rows = std::vector<std::vector<report::Cell>>;

std::vector<report::Cell> RowOf(const capture::Photo& photo, const ImageRgb8& thumbnail) {
  std::vector<report::Cell> row{report::Picture{thumbnail, photo.name}, photo.name,
                                fmt::format("{} x {}", photo.width_px, photo.height_px)};
  if (!photo.screening) {
    row.insert(row.end(), {"", "", "", "not looked at"});
    return row;
  }
  const capture::Screening& screening = *photo.screening;
  std::string remarks;
  for (const std::string& remark : screening.remarks) {
    remarks += (remarks.empty() ? "" : "; ") + remark;
  }
  row.push_back(fmt::format("{:.3f}", screening.sharpness));
  row.push_back(fmt::format("{:.1f} %", 100 * screening.overexposed_share));
  row.push_back(fmt::format("{:.1f} %", 100 * screening.underexposed_share));
  row.push_back(remarks);
  return row;
}

// The photo, grey where it is masked.
ImageRgb8 WithMaskShown(const capture::Photo& photo) {
  constexpr std::uint8_t kMasked = 128;
  capture::PhotoPixels pixels = ReadPhotoAndMask(photo);
  for (size_t i = 0; i < pixels.mask.data().size(); ++i) {
    if (pixels.mask.data()[i] == 0) std::fill_n(&pixels.image.data()[3 * i], 3, kMasked);
  }
  return std::move(pixels.image);
}

bool IsFaulty(const capture::Photo& photo) {
  return photo.screening && !photo.screening->remarks.empty();
}

}  // namespace

CaptureLook LookAt(const capture::Capture& capture, const std::string& title, double memory_gb,
                   Progress& progress) {
  const int count = static_cast<int>(capture.photos.size());
  progress.Stage("contact sheet", count);
  std::vector<ImageRgb8> thumbnails(capture.photos.size());
  std::atomic<int> done{0};
  MemoryBudget memory(memory_gb);
  ParallelFor(0, count, [&](int i) {
    progress.ThrowIfInterrupted();
    const auto index = static_cast<size_t>(i);
    const auto share = memory.Take(MemoryOf(capture.photos[index]));
    thumbnails[index] = report::Shrink(WithMaskShown(capture.photos[index]), kThumbnailPx);
    progress.Update(++done);
  });

  CaptureLook look;
  const int columns = std::clamp(static_cast<int>(std::ceil(std::sqrt(count))), 1, kWidestSheet);
  look.contact_sheet = report::ContactSheet(thumbnails, columns, kThumbnailPx);

  const std::vector<std::string> header{"photo",       "name",         "size px", "sharpness",
                                        "overexposed", "underexposed", "remarks"};
  Rows faulty, good;
  for (size_t i = 0; i < capture.photos.size(); ++i) {
    const capture::Photo& photo = capture.photos[i];
    (IsFaulty(photo) ? faulty : good).push_back(RowOf(photo, thumbnails[i]));
  }
  report::HtmlReport page(title);
  page.Result(faulty.empty(), fmt::format("{} photos, {} with a remark, {} skipped", count,
                                          faulty.size(), capture.skipped.size()));
  page.Paragraph(
      "Sharpness is the variance of the 4-neighbour Laplacian over the variance of the brightness: "
      "compare it between photos of one camera. Overexposed: a channel at 254 or 255; "
      "underexposed: all at 0 or 1. Photos with remarks are used unless the capture was made "
      "without them.");
  if (!faulty.empty()) {
    page.Section("Worth a look");
    page.Table(header, faulty);
  }
  if (!capture.skipped.empty()) {
    page.Section("Skipped");
    Rows rows;
    for (const auto& skipped : capture.skipped) rows.push_back({skipped.name, skipped.reason});
    page.Table({"name", "reason"}, rows);
  }
  if (!capture.remarks.empty()) {
    page.Section("Remarks on files");
    Rows rows;
    for (const auto& remark : capture.remarks) rows.push_back({remark.name, remark.text});
    page.Table({"name", "remark"}, rows);
  }
  if (!good.empty()) {
    page.Section("Nothing wrong seen");
    page.Table(header, good);
  }
  look.page = page.Finish();
  return look;
}

}  // namespace dtr::pipeline
