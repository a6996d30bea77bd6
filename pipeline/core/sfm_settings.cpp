#include "pipeline/core/sfm_settings.h"

namespace dtr::pipeline {

const char* NameOf(CameraPer per) {
  switch (per) {
    case CameraPer::kAuto:
      return "auto";
    case CameraPer::kFolder:
      return "folder";
    case CameraPer::kPhoto:
      return "photo";
    case CameraPer::kSet:
      return "set";
  }
  return "";
}

}  // namespace dtr::pipeline
