// pipeline/prune/detail/prune_journal.h -- what `dtr prune` measured, kept in the working folder.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "dtr/prune/measurer.h"

namespace dtr::pipeline {

/// A line of JSON for each measurement: {"name": ..., "numbers": [...]}, appended as it is made and
/// on the disk from then on. A last line without its end, of a run that was killed, is passed over.
class PruneJournal : public prune::Journal {
 public:
  /// Reads what is there. Throws Error where the file cannot be written or is none of ours.
  explicit PruneJournal(const std::filesystem::path& file);

  std::optional<std::vector<double>> Find(const std::string& name, size_t least) const override;
  void Add(const std::string& name, const std::vector<double>& numbers) override;

 private:
  std::filesystem::path file_;
  std::map<std::string, std::vector<double>> known_;
};

}  // namespace dtr::pipeline
