// pipeline/bench/storage_sweep.h -- how a set lies on disk as a stage to sweep: codings of
// depth and images, planes that can be left out, by bytes and what is lost in images.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/eval/held_out.h"
#include "dtr/eval/sweep.h"
#include "dtr/io/set_io.h"

namespace dtr::pipeline {

struct StorageSweepOptions {
  std::filesystem::path set;
  std::filesystem::path work;  ///< existing folder for the set written; it is removed after use
  RenderOptions render;
  /// Called for every measurement, as renderers may remember views by their addresses.
  std::function<eval::RenderFunction()> make_renderer;
};

/// Cost: bytes of the source views' files. Error: RMS levels of images from the set read back.
/// What the set has lost when it was first written stays lost. Figure `load_cpu_ms`: processor time
/// of reading images and depth, median of three.
class StorageSweep {
 public:
  /// Throws Error for a broken set.
  StorageSweep(StorageSweepOptions options, Progress& progress);
  eval::SweepStage Stage() const;  ///< its functions borrow this object

 private:
  const std::string& Value(const eval::SweepSetting& setting, size_t axis) const;
  /// Stores a view of the set in memory; its pixels are gone afterwards.
  void Write(View& view, const eval::SweepSetting& setting, LengthUnit unit,
             io::SetWriter& writer) const;
  eval::SweepMeasurement Measure(const eval::SweepSetting& setting) const;

  StorageSweepOptions options_;
  Progress& progress_;
  std::vector<eval::SweepAxis> axes_;
};

}  // namespace dtr::pipeline
