#include "viewer/glfw/inspector.h"

#include <chrono>
#include <cmath>
#include <exception>
#include <utility>

#include "dtr/base/thread_if_any.h"
#include "viewer/glfw/error_text.h"

namespace dtr::viewer {

void Inspector::Look(bool whole, const RenderOptions& options, const Eigen::Vector2d& cursor_px) {
  if (std::exchange(picture_, from_.schedule.count()) != picture_) {
    other_made_.reset();
    probed_.reset();
  }
  if (!whole) {
    inspection_.under_cursor.reset();
    probed_.reset();
    return;
  }
  try {
    if (inspection_.LooksAtPixels()) from_.maker.BringPixels();
    const auto other = OptionsOf(inspection_.compared, options);
    if (other && !(other_made_ && *other_made_ == *other)) {
      from_.maker.MakeOther(*other);
      other_made_ = *other;
    }
    if (cursor_px != last_cursor_) {
      last_cursor_ = cursor_px;
      cursor_rests_.Restart();
    }
    const bool rests = cursor_rests_.seconds() >= kStillAfterSeconds;
    if (inspection_.magnifier && rests && probed_ != cursor_px) {
      inspection_.under_cursor = ProbeAt(cursor_px);
      probed_ = cursor_px;
    }
    for (const Eigen::Vector2d& pixel : std::exchange(to_mark_, {})) {
      if (const auto probe = ProbeAt(pixel)) inspection_.Mark(*probe);
    }
  } catch (const std::exception& error) {
    inspection_.compared = Compared::kNothing;
    inspection_.magnifier = false;  // would fail again with every frame
    from_.tell(Said(error));
  }
}

std::optional<Probe> Inspector::ProbeAt(const Eigen::Vector2d& pixel) {
  const int x = static_cast<int>(std::floor(pixel.x()));
  const int y = static_cast<int>(std::floor(pixel.y()));
  const MadeFrame& picture = from_.maker.picture();
  const DepthImage& depth = from_.maker.Result().depth;
  if (!depth.Contains(x, y) || DepthImage::IsHole(depth(x, y))) return std::nullopt;
  from_.maker.BringPixels();
  return ProbePixel(picture.scene, picture.camera, picture.options, x, y, depth(x, y),
                    from_.sigma_of);
}

void Inspector::AskForValidations() {
  if (!inspection_.cameras || !from_.validations) return;
  if (!std::exchange(validations_asked_, true)) {
    validations_coming_ = std::async(kThreadIfAny, from_.validations);
  }
  if (validations_coming_.valid() &&
      validations_coming_.wait_for(std::chrono::seconds(0)) != std::future_status::timeout) {
    try {
      validations_ = validations_coming_.get();
    } catch (const std::exception& error) {
      from_.tell(Said(error));
    }
  }
}

void Inspector::Draw(const RenderOptions& options) {
  AskForValidations();
  const Controller& controller = from_.controller;
  const auto nearest = controller.nearest_view();
  photos_.Tend();
  if (inspection_.compared == Compared::kPhoto && nearest) {
    overlay_.DrawPhoto(inspection_, *controller.surroundings().cameras[*nearest],
                       controller.camera(), photos_);
  } else if (other_made_ && inspection_.compared != Compared::kNothing) {
    overlay_.DrawCompared(inspection_, from_.maker.other(), options, *other_made_);
  }
  if (inspection_.cameras) {
    overlay_.DrawCameras(controller, inspection_, validations_, from_.maker, photos_);
  }
  overlay_.DrawMarks(inspection_, controller.camera());
  if (inspection_.magnifier) overlay_.DrawMagnifier(inspection_, from_.maker.picture().texture);
}

const View* Inspector::photo() const {
  if (inspection_.compared != Compared::kPhoto) return nullptr;
  const auto nearest = from_.controller.nearest_view();
  const View* view = nearest ? from_.controller.surroundings().cameras[*nearest] : nullptr;
  return view == overlay_.photo_of() ? view : nullptr;
}

}  // namespace dtr::viewer
