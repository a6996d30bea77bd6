// dtr/render/shrunk_photos.h -- the views' photos averaged over cells, kept from image to
// image.
#pragma once
#include <array>
#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "dtr/types/view.h"

namespace dtr {

/// A photo times its view's gain, averaged over cells in sRGB values.
struct ShrunkPhoto {
  Grid<double> light;  ///< R, G, B in linear light, at most 1
  Mask usable;         ///< 0 where a cell is masked altogether
};

/// Makes a view's shrunk photo once; of the views asked for longest ago it forgets those that are
/// too many, but never one of the last call's. Several threads may ask.
class ShrunkPhotos {
 public:
  static constexpr size_t kMaxBytes = size_t{64} << 20;  ///< some 30 photos of 5 Mpx
  explicit ShrunkPhotos(size_t most_bytes = kMaxBytes) : max_bytes_(most_bytes) {}

  /// In the order of the views; missing ones are made on up to `threads` threads. Photos whose
  /// views are loaded again are noticed.
  std::vector<std::shared_ptr<const ShrunkPhoto>> Of(const std::vector<const View*>& views,
                                                     int cell_px, int threads);
  void Clear();

 private:
  /// Tells one photo from another that came into its place.
  struct Key {
    const View* view = nullptr;
    const void *image_data = nullptr, *mask_data = nullptr;
    std::string image_sha256, mask_sha256;
    std::array<double, 3> gain = {1, 1, 1};
    int cell_px = 0;
    bool operator==(const Key&) const = default;
  };
  struct Kept {
    Key key;
    std::shared_ptr<const ShrunkPhoto> photo;
  };
  static Key KeyOf(const View& view, int cell_px);
  std::shared_ptr<const ShrunkPhoto> Find(const Key& key);
  /// Those asked for longest ago, beyond the last call's `asked`. The mutex is held.
  void ForgetTooMany(size_t asked);

  const size_t max_bytes_;
  std::mutex mutex_;
  std::list<Kept> kept_;  ///< asked for last first
};

}  // namespace dtr
