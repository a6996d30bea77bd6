// cli/sweep_store.h -- what a sweep measured, kept in a file so that the same command goes on.
#pragma once
#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "dtr/eval/sweep.h"

namespace dtr::cli {

/// The results of all stages in one JSON file:
/// {format:1, measurements:[{stage,context,setting,cost,cost_least,cost_most,error,psnr_db,
///  machine_ms,figures:{...}}]}. Written again, atomically, after every measurement. What other
///  sets
/// and conditions left there stays.
class SweepFile {
 public:
  /// Reads the file where it exists. Throws Error naming file and field when it is not one of ours.
  explicit SweepFile(std::filesystem::path file);

  /// The results of one stage under one set of conditions (`context`: a hash of all that decides
  /// what is measured). The file must outlive it.
  std::unique_ptr<eval::SweepStore> Of(const eval::SweepStage& stage, const std::string& context);

  /// Identifies a measurement: stage, context, setting.
  using Key = std::array<std::string, 3>;

 private:
  class Part;
  void Write() const;

  std::filesystem::path file_;
  std::map<Key, eval::SweepMeasurement> measurements_;
};

}  // namespace dtr::cli
