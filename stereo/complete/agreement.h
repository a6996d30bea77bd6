// stereo/complete/agreement.h -- how well the views around agree that a surface is at a depth.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "stereo/complete/cells.h"

namespace dtr::stereo {

/// What a disagreement costs. All costs are in levels of sRGB.
struct AgreementWeights {
  float max_colour = 12;  ///< of a difference of colours, at most
  float one_view = 2;     ///< at least, where a single other view shows the place
  float no_view = 7;      ///< where none does
  float hidden = 3;       ///< times the share of views from which something nearer hides the place
  float through = 40;     ///< times the share of views that see through it
  float elsewhere = 4;    ///< times the share of views whose completed surface is another
};

/// Asks the views around one view. What is passed must outlive it.
class Agreement {
 public:
  /// `completed`: planes that an earlier pass gave for the others, 3 channels, in their order;
  /// empty in the first pass.
  Agreement(const CellView& view, std::span<const CellView* const> others,
            std::span<const Grid<float>* const> completed, const AgreementWeights& weights);

  /// What it costs to put cell (x, y) at inverse depth w along its ray; 0 is infinitely far.
  float CostAt(int x, int y, float w) const;

  /// By how much the views from which nothing measured hides the place contradict it, all of them,
  /// by its colour: 0 to 1; empty where there is no such view.
  std::optional<float> ContradictionAt(int x, int y, float w) const;

 private:
  struct Other {
    const CellView* cells;
    const Grid<float>* completed;
    Eigen::Matrix3f turn;   ///< homogeneous cell of the other, of a ray's end at infinity
    Eigen::Vector3f shift;  ///< and what 1/z adds to it
    float same;             ///< difference of its inverse depth up to which it is one surface
  };
  struct Answers;
  Answers AskAll(int x, int y, float w) const;
  /// Of a view, what it has at its position (u, v) to say of cell (x, y) at inverse depth `there`
  /// before that view.
  void Ask(const Other& other, float u, float v, float there, int x, int y, Answers& answers) const;

  const CellView& view_;
  const AgreementWeights& weights_;
  std::vector<Other> others_;
};

}  // namespace dtr::stereo
