// dtr/io/run_record.h -- reads back what io::WriteRunRecord wrote.
#pragma once
#include <filesystem>
#include <vector>

#include "dtr/io/set_io.h"

namespace dtr::io {

/// The stages of report/run.json; empty where a set has none, or one of another program. What is
/// missing or no number is 0. Throws Error when the file is no JSON.
std::vector<RunStage> ReadRunStages(const std::filesystem::path& set_folder);

}  // namespace dtr::io
