#include "dtr/render/shrunk_photos.h"

#include <algorithm>
#include <optional>

#include "dtr/base/parallel_for.h"
#include "dtr/render/colour.h"
#include "dtr/render/exposure.h"

namespace dtr {
namespace {

ShrunkPhoto Shrink(const View& view, int cell_px) {
  const int width = view.image.width(), height = view.image.height();
  const int columns = (width + cell_px - 1) / cell_px, rows = (height + cell_px - 1) / cell_px;
  ShrunkPhoto shrunk{Grid<double>(columns, rows, 3), Mask(columns, rows)};
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      int sum[3] = {}, count = 0;
      const int end_x = std::min((x + 1) * cell_px, width);
      for (int j = y * cell_px; j < std::min((y + 1) * cell_px, height); ++j) {
        for (int i = x * cell_px; i < end_x; ++i) {
          if (!view.mask.empty() && view.mask(i, j) == 0) continue;
          const std::uint8_t* rgb = &view.image(i, j);
          for (int c = 0; c < 3; ++c) sum[c] += rgb[c];
          ++count;
        }
      }
      if (count == 0) continue;
      shrunk.usable(x, y) = 255;
      for (int c = 0; c < 3; ++c) {
        const double mean = static_cast<double>(sum[c]) / count / 255;
        shrunk.light(x, y, c) = Exposed(LinearFromSrgb(mean), view.gain[c]);
      }
    }
  }
  return shrunk;
}

}  // namespace

ShrunkPhotos::Key ShrunkPhotos::KeyOf(const View& view, int cell_px) {
  const auto hash = [](const std::optional<StoredFile>& file) {
    return file ? file->sha256 : std::string();
  };
  return {&view,
          view.image.data().data(),
          view.mask.data().data(),
          hash(view.image_file),
          hash(view.mask_file),
          {view.gain.x(), view.gain.y(), view.gain.z()},
          cell_px};
}

/// Puts what it finds first.
std::shared_ptr<const ShrunkPhoto> ShrunkPhotos::Find(const Key& key) {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(kept_.begin(), kept_.end(), [&](const Kept& kept) { return kept.key == key; });
  if (found == kept_.end()) return nullptr;
  kept_.splice(kept_.begin(), kept_, found);
  return kept_.front().photo;
}

std::vector<std::shared_ptr<const ShrunkPhoto>> ShrunkPhotos::Of(
    const std::vector<const View*>& views, int cell_px, int threads) {
  std::vector<std::shared_ptr<const ShrunkPhoto>> photos(views.size());
  std::vector<size_t> missing;
  for (size_t i = 0; i < views.size(); ++i) {
    photos[i] = Find(KeyOf(*views[i], cell_px));
    if (!photos[i]) missing.push_back(i);
  }
  ParallelFor(0, static_cast<int>(missing.size()), threads, [&](int i) {
    const size_t k = missing[static_cast<size_t>(i)];
    photos[k] = std::make_shared<const ShrunkPhoto>(Shrink(*views[k], cell_px));
  });
  const std::lock_guard lock(mutex_);
  for (const size_t i : missing) {
    // A view has one photo: others in its place are of no more use.
    std::erase_if(kept_, [&](const Kept& kept) {
      return kept.key.view == views[i] && kept.key.cell_px == cell_px;
    });
    kept_.push_front({KeyOf(*views[i], cell_px), photos[i]});
  }
  ForgetTooMany(views.size());
  return photos;
}

void ShrunkPhotos::ForgetTooMany(size_t asked) {
  size_t bytes = 0, stay = 0;
  for (const Kept& kept : kept_) {
    bytes += kept.photo->light.data().size() * sizeof(double) + kept.photo->usable.data().size();
    if (stay >= asked && bytes > max_bytes_) break;
    ++stay;
  }
  kept_.resize(stay);
}

void ShrunkPhotos::Clear() {
  const std::lock_guard lock(mutex_);
  kept_.clear();
}

}  // namespace dtr
