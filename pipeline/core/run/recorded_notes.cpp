#include "pipeline/core/run/recorded_notes.h"

namespace dtr::pipeline {

void RecordedNotes::Note(const std::string& line) {
  listener_.Note(line);
  const std::lock_guard lock(mutex_);
  lines_.push_back(line);
}

std::vector<std::string> RecordedNotes::lines() const {
  const std::lock_guard lock(mutex_);
  return lines_;
}

}  // namespace dtr::pipeline
