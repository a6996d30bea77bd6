#include "pipeline/render/detail/dynamic_scene.h"

#include "dtr/io/set_io.h"
#include "dtr/render/scene.h"
#include "dtr/render/time_steps.h"
#include "dtr/render/view_stream.h"
#include "pipeline/core/view_names.h"

namespace dtr::pipeline {

DynamicScene::DynamicScene(std::filesystem::path folder, const DtrSet& described,
                           std::string excluded, const StreamLimits& limits, Progress& console)
    : folder_(std::move(folder)),
      described_(described),
      excluded_(std::move(excluded)),
      limits_(limits),
      console_(console) {}

ViewStream& DynamicScene::At(size_t frame) {
  if (stream_ && frame == present_) return *stream_;
  Leave();
  const auto [at, is_new] = frames_.try_emplace(frame);
  DtrSet& set = at->second;
  if (is_new) set = AtFrame(described_, frame);
  const auto excluded = ResolveViewNames(set, excluded_);
  if (is_new) io::CollapseDuplicates(set);
  stream_ = StreamOf(folder_, set, {DescribeRenderScene(set, excluded)}, limits_, console_);
  present_ = frame;
  return *stream_;
}

void DynamicScene::Leave() {
  if (!stream_) return;
  lost_ = lost();
  stream_.reset();
  for (View& view : frames_.at(present_).frames.front().views) DropPixels(view);
}

std::vector<ViewStream::Lost> DynamicScene::lost() const {
  std::vector<ViewStream::Lost> all = lost_;
  if (stream_) all.insert(all.end(), stream_->lost().begin(), stream_->lost().end());
  return all;
}

}  // namespace dtr::pipeline
