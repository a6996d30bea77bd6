#include "dtr/render/semi_global.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "dtr/base/random.h"
#include "tests/support/instruction_sets.h"

namespace dtr {
namespace {

constexpr int kColumns = 9, kRows = 7;

struct Problem {
  size_t labels;
  LabelChanges changes;
  std::vector<float> costs;
  size_t At(int x, int y, size_t label) const {
    return (static_cast<size_t>(y) * kColumns + static_cast<size_t>(x)) * labels + label;
  }
};

Problem RandomProblem(size_t labels, const LabelChanges& changes, Random& random) {
  Problem problem{labels, changes, std::vector<float>(kColumns * kRows * labels)};
  for (float& cost : problem.costs) cost = static_cast<float>(random.Uniform(0, 40));
  return problem;
}

/// Hirschmueller's equation label by label, in the order of the sums that Solve keeps.
std::vector<float> PlainSums(const Problem& problem) {
  const auto& [labels, changes, costs] = problem;
  std::vector<float> sums(costs.size());
  const auto follow = [&](int x, int y, int dx, int dy) {
    std::vector<float> before(labels, 0), now(labels);
    for (; x >= 0 && y >= 0 && x < kColumns && y < kRows; x += dx, y += dy) {
      const float least = *std::min_element(before.begin(), before.end());
      for (size_t l = 0; l < labels; ++l) {
        float cheapest = std::min(before[l], least + changes.any);
        if (l < changes.steps && l > 0) cheapest = std::min(cheapest, before[l - 1] + changes.next);
        if (l + 1 < changes.steps) cheapest = std::min(cheapest, before[l + 1] + changes.next);
        now[l] = costs[problem.At(x, y, l)] + cheapest - least;
        sums[problem.At(x, y, l)] += now[l];
      }
      std::swap(before, now);
    }
  };
  for (int y = 0; y < kRows; ++y) follow(0, y, 1, 0), follow(kColumns - 1, y, -1, 0);
  for (int x = 0; x < kColumns; ++x) follow(x, 0, 0, 1), follow(x, kRows - 1, 0, -1);
  return sums;
}

void CheckSums() {
  Random random(7);
  for (const auto& [labels, steps] : {std::pair<size_t, size_t>{1, 0},
                                      {9, 0},
                                      {2, 1},
                                      {9, 8},
                                      {17, 16},
                                      {18, 16},
                                      {62, 61},
                                      {257, 256}}) {
    const Problem problem = RandomProblem(labels, {steps, 4, 24}, random);
    const std::vector<float> expected = PlainSums(problem);
    for (const int threads : {1, 3}) {
      SemiGlobal solver(kColumns, kRows, labels, problem.changes, threads);
      for (int y = 0; y < kRows; ++y) {
        for (int x = 0; x < kColumns; ++x) {
          for (size_t l = 0; l < labels; ++l) {
            solver.SetCost(x, y, l, problem.costs[problem.At(x, y, l)]);
          }
        }
      }
      solver.Solve();
      for (int y = 0; y < kRows; ++y) {
        for (int x = 0; x < kColumns; ++x) {
          const auto first = expected.begin() + static_cast<std::ptrdiff_t>(problem.At(x, y, 0));
          for (size_t l = 0; l < labels; ++l) {
            ASSERT_EQ(solver.SumOf(x, y, l), first[static_cast<std::ptrdiff_t>(l)])
                << labels << " labels, " << steps << " steps, label " << l;
          }
          const auto best = std::min_element(first, first + static_cast<std::ptrdiff_t>(labels));
          EXPECT_EQ(solver.Best(x, y), static_cast<size_t>(best - first));
        }
      }
    }
  }
}

TEST(SemiGlobal, GivesThePlainSumsToTheBitForAnyNumberOfLabelsAndThreads) {
  testing::WithEachInstructionSet([](auto) { CheckSums(); });
}

TEST(SemiGlobal, OfEqualLabelsTheFirstIsBest) {
  SemiGlobal solver(1, 1, 3, {2, 1, 1}, 1);
  for (const size_t label : {0, 1, 2}) solver.SetCost(0, 0, label, 5);
  solver.Solve();
  EXPECT_EQ(solver.Best(0, 0), 0u);
  SemiGlobal other(1, 1, 3, {2, 1, 1}, 1);
  for (const size_t label : {0, 1, 2}) other.SetCost(0, 0, label, label == 2 ? 4.0f : 5.0f);
  other.Solve();
  EXPECT_EQ(other.Best(0, 0), 2u);
}

}  // namespace
}  // namespace dtr
