// pipeline/evaluate/detail/comparison_images.h -- the images that an evaluation writes.
#pragma once
#include <functional>
#include <optional>

#include "dtr/types/dtr_set.h"
#include "pipeline/core/run/output_folder.h"
#include "pipeline/evaluate/evaluate.h"

namespace dtr::pipeline {

/// Rendered image | photo | difference of each view that is evaluated, as ID.png in the folder that
/// the request names; nothing where it names none.
class ComparisonImages {
 public:
  /// `described`: the set with all its time steps. Throws as OutputFolder.
  ComparisonImages(const EvaluateRequest& request, const DtrSet& described);
  /// For eval::EvaluateOptions; must not outlive this.
  std::function<void(const View&, const RenderResult&)> Writer() const;
  void Finish();

 private:
  std::optional<OutputFolder> folder_;
};

}  // namespace dtr::pipeline
