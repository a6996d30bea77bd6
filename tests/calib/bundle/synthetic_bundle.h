// tests/calib/bundle/synthetic_bundle.h -- the bundles whose truth is known, by the tests' names.
#pragma once
#include "datasets/exact/bundle.h"

namespace dtr::testing {
using namespace bundle;
}  // namespace dtr::testing
