// viewer/glfw/photo_cache.h -- photos of views that no image was drawn from, read in the
// background.
#pragma once
#include <deque>
#include <functional>
#include <future>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "dtr/types/view.h"

namespace dtr::viewer {

/// Reads one photo at a time: a small image of each view that is asked for, and whole the one
/// that was asked for last. All members belong to one thread. Views outlive it.
class PhotoCache {
 public:
  /// Throws where it cannot read; called on a thread of its own, with a copy of the view.
  using Load = std::function<ImageRgb8(const View&)>;
  /// `small_px`: long side of small images. Without `load` there are no photos.
  PhotoCache(Load load, int small_px) : load_(std::move(load)), small_px_(small_px) {}
  /// Waits for what is being read just now.
  ~PhotoCache();
  PhotoCache(const PhotoCache&) = delete;
  PhotoCache& operator=(const PhotoCache&) = delete;

  /// Null until it is read, which begins soon.
  const ImageRgb8* Small(const View& view);
  /// The same of the whole photo, before all small ones. The one before is forgotten.
  const ImageRgb8* Whole(const View& view);
  /// Why a view's photo could not be read; null where it could, or was not tried.
  const std::string* RejectionOf(const View& view) const;
  /// Those of the views that could not be read and that `again` says yes to are tried again when
  /// they are asked for.
  void ForgetRejections(const std::function<bool(const View&)>& again) {
    std::erase_if(rejections_, [&](const auto& refused) { return again(*refused.first); });
  }
  /// To be called every frame: takes over what was read and goes on.
  void Tend();
  /// True until all that was asked for is there or rejected.
  bool reading() const;

 private:
  struct Read {
    const View* view = nullptr;
    ImageRgb8 photo;
    std::string rejection;
  };
  void Begin(const View& view);

  const Load load_;
  const int small_px_;
  std::future<Read> reading_;
  std::deque<const View*> small_wanted_;
  std::set<const View*> small_asked_;
  std::map<const View*, ImageRgb8> small_;
  std::map<const View*, std::string> rejections_;
  const View* whole_wanted_ = nullptr;
  const View* whole_of_ = nullptr;
  ImageRgb8 whole_;
};

}  // namespace dtr::viewer
