// tests/pipeline/exact_export.h -- a set whose surfaces are known exactly, for exports.
#pragma once
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pipeline/export/export.h"
#include "tests/pipeline/exact_set.h"
#include "tests/support/noted_lines.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

class ExactExport : public ::testing::Test {
 protected:
  void Make(const ExactSetOptions& options) {
    views_ = ExactViews(options);
    WriteExactSet(folder_ / "set.dtr", views_, options);
  }
  /// With view 3 held out, without depth.
  void MakeWithHeldOut(const ExactSetOptions& options) {
    views_ = ExactViews(options);
    views_[3].role = ViewRole::kHeldOut;
    DropDepth(views_[3]);
    WriteExactSet(folder_ / "set.dtr", views_, options);
  }
  pipeline::ExportRequest Request(const std::string& name) const {
    pipeline::ExportRequest request;
    request.set = folder_ / "set.dtr";
    request.output = folder_ / name;
    return request;
  }

  TemporaryFolder folder_;
  NotedLines noted_;
  std::vector<View> views_;
};

}  // namespace dtr::testing
