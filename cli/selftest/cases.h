// cli/selftest/cases.h -- what a stability case is, and the cases of every stage.
#pragma once
#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "dtr/render/result.h"
#include "dtr/render/scene.h"
#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace dtr::selftest {

/// How a value must lie to its bound. A value that is no number holds none of them.
enum class Relation { kAtMost, kAtLeast, kEquals };

/// One number of a case and what it must be.
struct Measure {
  std::string what;  ///< what is measured, its unit in the words
  double value = 0;
  Relation relation = Relation::kAtMost;
  double bound = 0;
  std::string reason;  ///< why this bound
};
bool Holds(const Measure& measure);

inline Measure AtMost(std::string what, double value, double bound, std::string reason) {
  return {std::move(what), value, Relation::kAtMost, bound, std::move(reason)};
}
inline Measure AtLeast(std::string what, double value, double bound, std::string reason) {
  return {std::move(what), value, Relation::kAtLeast, bound, std::move(reason)};
}
inline Measure Exactly(std::string what, double value, double bound, std::string reason) {
  return {std::move(what), value, Relation::kEquals, bound, std::move(reason)};
}

/// What a case found.
struct Outcome {
  std::vector<Measure> measures;
  long long not_finite = 0;  ///< NaNs and infinities among all that was put out; must be 0
  std::string
      rejection;  ///< how an input that cannot be solved is rejected, in the program's words

  void Add(Measure measure) { measures.push_back(std::move(measure)); }
  /// Counts what is not finite.
  void Look(double value) { not_finite += !std::isfinite(value); }
  template <typename Values>
  void LookAtAll(const Values& values) {
    for (const auto value : values) Look(static_cast<double>(value));
  }
};

/// Calls `work`, which must throw dtr::Error; its words are kept. A measure says whether it did.
void ExpectRejection(Outcome& outcome, const std::string& what, const std::function<void()>& work);

/// Any renderer: cpu::Render, or one that draws with OpenGL.
using RenderFunction =
    std::function<RenderResult(const RenderScene& scene, const PinholeCamera& novel,
                               const Pose& novel_from_world, const RenderOptions& options)>;

/// A renderer by name; every case makes its own.
struct NamedRenderer {
  std::string name;  ///< "cpu", "gl" or "simd"
  std::function<RenderFunction()> make;
  std::string missing = {};  ///< why this program or machine has none; its cases are skipped
  std::vector<RenderMethod> methods = {RenderMethod::kTwoPass, RenderMethod::kDeferred};
};

/// One stiff or extreme case. What it throws fails it.
struct Case {
  std::string stage, name;
  bool quick = false;  ///< part of the short form
  std::function<Outcome()> run;
  std::string skipped = {};  ///< why it cannot be run here; empty: it can
};

std::vector<Case> BundleCases();
std::vector<Case> StereoCases();
std::vector<Case> DepthCodingCases();
std::vector<Case> BlendingCases();
/// Every case once for each renderer.
std::vector<Case> RenderingCases(std::span<const NamedRenderer> renderers);
/// All of these, in the order of the table.
std::vector<Case> AllCases(std::span<const NamedRenderer> renderers);

}  // namespace dtr::selftest
