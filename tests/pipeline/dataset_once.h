// tests/pipeline/dataset_once.h -- photos whose truth is known, made once for all tests of a suite.
#pragma once
#include <gtest/gtest.h>

#include <string>

#include "datasets/make.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

class DatasetOnce : public ::testing::Test {
 protected:
  static datasets::DatasetSpec Scene(const std::string& name, int views, int width_px) {
    datasets::DatasetSpec spec;
    spec.scene = name;
    spec.views = views;
    spec.width_px = width_px;
    spec.supersampling = 2;
    return spec;
  }
  /// For SetUpTestSuite: in `name` below folder_.
  static void Make(const datasets::DatasetSpec& spec, const std::string& name) {
    folder_ = new TemporaryFolder;
    SilentProgress silent;
    datasets::MakeDataset(spec, *folder_ / name, silent);
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  inline static TemporaryFolder* folder_ = nullptr;
};

}  // namespace dtr::testing
