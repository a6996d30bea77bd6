#include "stereo/complete/agreement.h"

#include <algorithm>
#include <cmath>

namespace dtr::stereo {
namespace {

constexpr float kSeenThroughPx = 2;  // cells of disparity
/// Levels between colours: at most of one surface, and at least of two.
constexpr float kOneSurface = 6, kTwoSurfaces = 18;

/// Bilinear; false where a cell around is masked.
bool ColourAt(const CellView& cells, float x, float y, float* rgb) {
  const float u = std::clamp(x - 0.5F, 0.0F, static_cast<float>(cells.colour.width() - 1));
  const float v = std::clamp(y - 0.5F, 0.0F, static_cast<float>(cells.colour.height() - 1));
  const int x0 = static_cast<int>(u), y0 = static_cast<int>(v);
  const int x1 = std::min(x0 + 1, cells.colour.width() - 1);
  const int y1 = std::min(y0 + 1, cells.colour.height() - 1);
  if (!cells.usable(x0, y0) || !cells.usable(x1, y0) || !cells.usable(x0, y1) ||
      !cells.usable(x1, y1)) {
    return false;
  }
  const float fx = u - static_cast<float>(x0), fy = v - static_cast<float>(y0);
  for (int c = 0; c < 3; ++c) {
    rgb[c] = (1 - fy) * ((1 - fx) * cells.colour(x0, y0, c) + fx * cells.colour(x1, y0, c)) +
             fy * ((1 - fx) * cells.colour(x0, y1, c) + fx * cells.colour(x1, y1, c));
  }
  return true;
}

}  // namespace

Agreement::Agreement(const CellView& view, std::span<const CellView* const> others,
                     std::span<const Grid<float>* const> completed, const AgreementWeights& weights)
    : view_(view), weights_(weights) {
  for (size_t i = 0; i < others.size(); ++i) {
    const CellView& other = *others[i];
    Eigen::Matrix3d k;
    k << other.camera.fx_px(), 0, other.camera.cx_px(), 0, other.camera.fy_px(),
        other.camera.cy_px(), 0, 0, 1;
    const Pose other_from_view = other.cam_from_world * view.cam_from_world.Inverse();
    others_.push_back({&other, completed.empty() ? nullptr : completed[i],
                       (k * other_from_view.rotation.toRotationMatrix()).cast<float>(),
                       (k * other_from_view.translation).cast<float>(),
                       kSeenThroughPx * other.pixel});
  }
}

/// What the views around say of one place.
struct Agreement::Answers {
  /// Of the two that agree best: others may not see the place, though nothing says so.
  float best[2];
  int asked = 0, answers = 0, hidden = 0, through = 0, elsewhere = 0;
  float unlike = 0;

  void AddColour(float difference) {
    ++answers;
    unlike += std::clamp((difference - kOneSurface) / (kTwoSurfaces - kOneSurface), 0.0F, 1.0F);
    if (difference < best[0]) {
      best[1] = best[0], best[0] = difference;
    } else {
      best[1] = std::min(best[1], difference);
    }
  }

  float Cost(const AgreementWeights& weights) const {
    float cost = weights.no_view;
    if (answers >= 2) {
      cost = (best[0] + best[1]) / 2;
    } else if (answers == 1) {
      cost = std::max(best[0], weights.one_view);
    }
    if (asked == 0) return cost;
    return cost + (weights.hidden * static_cast<float>(hidden) +
                   weights.through * static_cast<float>(through) +
                   weights.elsewhere * static_cast<float>(elsewhere)) /
                      static_cast<float>(asked);
  }
};

Agreement::Answers Agreement::AskAll(int x, int y, float w) const {
  const Eigen::Vector3f ray = view_.RayOf(x, y);
  Answers answers{{weights_.max_colour, weights_.max_colour}};
  for (const Other& other : others_) {
    const Eigen::Vector3f p = other.turn * ray + w * other.shift;
    if (p.z() > 0) Ask(other, p.x() / p.z(), p.y() / p.z(), w / p.z(), x, y, answers);
  }
  return answers;
}

float Agreement::CostAt(int x, int y, float w) const { return AskAll(x, y, w).Cost(weights_); }

std::optional<float> Agreement::ContradictionAt(int x, int y, float w) const {
  const Answers answers = AskAll(x, y, w);
  if (answers.asked == answers.hidden) return std::nullopt;
  return answers.unlike / static_cast<float>(answers.asked - answers.hidden);
}

void Agreement::Ask(const Other& other, float u, float v, float there, int x, int y,
                    Answers& answers) const {
  const CellView& cells = *other.cells;
  if (!(u >= 0 && v >= 0 && u < static_cast<float>(cells.colour.width()) &&
        v < static_cast<float>(cells.colour.height()))) {
    return;
  }
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  if (!cells.usable(i, j)) return;
  ++answers.asked;
  const float measured = cells.inverse_depth(i, j);
  if (measured > there + other.same) {
    ++answers.hidden;
    return;
  }
  // A cell that is measured in part may show another surface in the rest.
  if (measured > 0 && measured < there - other.same && !cells.shared(i, j)) ++answers.through;
  if (!(measured > 0) && other.completed != nullptr) {
    const Eigen::Vector3f plane((*other.completed)(i, j, 0), (*other.completed)(i, j, 1),
                                (*other.completed)(i, j, 2));
    answers.elsewhere += std::abs(plane.dot(cells.RayAt(u, v)) - there) > other.same;
  }
  float rgb[3];
  if (!ColourAt(cells, u, v, rgb)) return;
  float difference = 0;
  for (int c = 0; c < 3; ++c) difference += std::abs(rgb[c] - view_.colour(x, y, c)) / 3;
  answers.AddColour(difference);
}

}  // namespace dtr::stereo
