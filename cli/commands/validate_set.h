// cli/commands/validate_set.h -- what `dtr validate` does with sets, and with cameras of others.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "cli/command.h"
#include "dtr/types/dtr_set.h"
#include "pipeline/validate/validate.h"

namespace dtr::cli {

/// A set with its validation.
struct ValidatedSet {
  DtrSet set;
  pipeline::SetValidation report;
};

/// Validates a set and prints a line per camera and test.
ValidatedSet ValidateOneSet(const std::filesystem::path& set, const pipeline::SetLimits& limits,
                            const Context& context);

/// Writes the page where asked for, which calls the set `name`.
void WritePage(const std::optional<std::filesystem::path>& page, const std::filesystem::path& set,
               const ValidatedSet& validated, const std::string& name,
               const std::string& conclusion, Console& console);

struct ValidateCamerasOptions {
  std::filesystem::path cameras;  ///< a file or folder of a format that CameraFormats() names
  std::string format;             ///< one of them; empty: by the content
  std::filesystem::path images;   ///< folder; empty: a capture's own
  std::optional<std::filesystem::path> page;
  pipeline::SetLimits limits;
};

/// Whether it is to be taken so: `format` is given, or the content is of such a format, or it is a
/// folder that is no set, and `images` are given. A file of one camera is a calibration.
bool AreCamerasOfPhotos(const std::filesystem::path& file, const std::string& format,
                        bool images_given);

/// Exit codes kDone: the cameras are right, kFailed: wrong, kUndecided: the photos do not show it.
int RunValidateCameras(const ValidateCamerasOptions& options, const Context& context);

}  // namespace dtr::cli
