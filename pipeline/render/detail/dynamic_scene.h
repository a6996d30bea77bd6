// pipeline/render/detail/dynamic_scene.h -- the frames of a set, one at a time, to draw images
// from.
#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "dtr/types/dtr_set.h"
#include "pipeline/core/set_stream.h"

namespace dtr::pipeline {

/// Gives the stream of one frame after the other; the pixels of one frame at a time are in memory.
class DynamicScene {
 public:
  /// `described` is as io::ReadSet gives it; `excluded` names views to leave out (--exclude).
  DynamicScene(std::filesystem::path folder, const DtrSet& described, std::string excluded,
               const StreamLimits& limits, Progress& console);

  /// The stream of that frame, until the next call. Throws as AtFrame and DescribeRenderScene.
  ViewStream& At(size_t frame);

  /// Views that could not be read, of the frames left and the present one.
  std::vector<ViewStream::Lost> lost() const;

 private:
  void Leave();

  std::filesystem::path folder_;
  const DtrSet& described_;
  std::string excluded_;
  StreamLimits limits_;
  Progress& console_;
  /// Frames stay once they were there, without their pixels: renderers know views by their place.
  std::map<size_t, DtrSet> frames_;
  size_t present_ = 0;
  std::unique_ptr<ViewStream> stream_;
  std::vector<ViewStream::Lost> lost_;
};

}  // namespace dtr::pipeline
