// dtr/io/hand_over.h -- unfinished work on a set that a run with other options may go on with.
#pragma once
#include <filesystem>
#include <string>

namespace dtr::io {

/// Where the unfinished work on the set `target` is of the fingerprint `from_json` (SetWriter), it
/// becomes that of `to_json`. Nothing where there is none or it is of another. Throws Error where
/// the file cannot be written.
void HandOver(const std::filesystem::path& target, const std::string& from_json,
              const std::string& to_json);

/// Puts right what a run left beside the set `target` that was killed on its way into place, as
/// SetWriter does before it writes. Throws Error, UsageError while another process is at it.
void Recover(const std::filesystem::path& target);

}  // namespace dtr::io
