// dtr/io/run_record_json.h -- internal to this project: run records with more fields.
#pragma once
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "dtr/io/set_io.h"

namespace dtr::io {

/// As WriteRunRecord, with the fields of the object `extra` after those of the record, but for
/// names that these have.
void WriteRunRecord(const std::filesystem::path& set_folder, const RunRecord& record,
                    const nlohmann::ordered_json& extra);

}  // namespace dtr::io
