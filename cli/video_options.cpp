#include "cli/video_options.h"

#include "cli/number_checks.h"

namespace dtr::cli {

void AddVideoOptions(CLI::App& command, capture::VideoOptions& options) {
  auto* every =
      command
          .add_option("--every", options.every,
                      "Of a video: every N-th frame, instead of a choice by motion and sharpness")
          ->check(kPositive)
          ->type_name("N");
  command
      .add_option("--motion", options.motion,
                  "Of a video: motion between two frames, of the image's long side [0.06]")
      ->excludes(every)
      ->type_name("SHARE");
  command
      .add_option("--max-frames", options.most,
                  "Of a video: at most so many frames, the sharpest of equal parts")
      ->check(kPositive)
      ->type_name("N");
  command.add_flag("--synchronised", options.synchronised,
                   "The videos are a rig's, begun at one moment: the same frames of each");
}

}  // namespace dtr::cli
