// tests/support/noted_lines.h -- a Progress that remembers what it was told.
#pragma once
#include <string>
#include <vector>

#include "dtr/base/progress.h"

namespace dtr::testing {

class NotedLines final : public Progress {
 public:
  void Stage(const std::string&, int) override {}
  void Update(int) override {}
  void Note(const std::string& line) override { lines.push_back(line); }
  std::vector<std::string> lines;
};

}  // namespace dtr::testing
