// tests/cli/fake_sfm.h -- a COLMAP that finds a model which is known beforehand.
#pragma once
#include "calib/colmap/model_io.h"
#include "tests/calib/colmap/fake_colmap.h"
#include "tests/cli/small_courtyard.h"

namespace dtr::testing {

/// Photos of the model's images, by order of names, get its cameras.
inline void LeaveModel(const colmap::testing::FakeColmap& colmap, calib::SfmModel model) {
  colmap.LeaveDatabase(NumberImages(model));
  colmap::WriteModel(colmap / "model.0", model, colmap::Format::kBinary);
}

}  // namespace dtr::testing
