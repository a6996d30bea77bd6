#include "pipeline/evaluate/detail/comparison_images.h"

#include <string>
#include <vector>

#include "dtr/eval/held_out.h"
#include "dtr/io/image_io.h"

namespace dtr::pipeline {
namespace {

std::string ComparisonFileOf(const View& view) { return view.id + ".png"; }

}  // namespace

ComparisonImages::ComparisonImages(const EvaluateRequest& request, const DtrSet& described) {
  if (request.images.empty()) return;
  const ViewRole evaluated = request.leave_one_out ? ViewRole::kSource : ViewRole::kHeldOut;
  std::vector<std::string> names;
  for (const Frame& frame : described.frames) {
    for (const View& view : frame.views) {
      if (view.role == evaluated) names.push_back(ComparisonFileOf(view));
    }
  }
  folder_.emplace(request.images, "comparison", names, request.force);
}

std::function<void(const View&, const RenderResult&)> ComparisonImages::Writer() const {
  if (!folder_) return {};
  return [this](const View& view, const RenderResult& rendered) {
    io::WriteImage(folder_->path() / ComparisonFileOf(view),
                   eval::ComparisonImage(rendered.image, view.image, view.mask),
                   io::kDefaultJpegQuality, io::Mark::kRendered);
  };
}

void ComparisonImages::Finish() {
  if (folder_) folder_->Finish();
}

}  // namespace dtr::pipeline
