#include "cli/commands/validate_set.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/validation/conclusion.h"
#include "dtr/base/files.h"
#include "dtr/io/formats/file_look.h"
#include "dtr/io/set_io.h"
#include "dtr/render/time_steps.h"
#include "pipeline/core/cameras/camera_formats.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;

void SayReport(const pipeline::SetValidation& report, Console& console) {
  console.Say(fmt::format("{:<24} {:>7} {:>8} {:>8} {:>8} {:>8}", "camera (held-out, px)", "count",
                          "RMS", "median", "95 %", "worst"));
  for (const auto& camera : report.cameras) {
    const auto& held_out = camera.held_out;
    console.Say(fmt::format("{:<24} {:>7} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.3f}", camera.name,
                            held_out.count, held_out.rms_px, held_out.median_px, held_out.p95_px,
                            held_out.worst_px));
  }
  for (const Check& test : report.tests) console.Say(calib::LineOf(test));
  if (!report.adjustment.not_validated.empty()) {
    console.Say("not validated by a fresh bundle adjustment: " + report.adjustment.not_validated);
  }
  for (const std::string& name : report.untested) {
    console.Say("not tested, too few observations: " + name);
  }
  for (const std::string& name : report.kept_apart) {
    console.Say("not tested, held out without observations; dtr evaluate measures by it: " + name);
  }
}

}  // namespace

ValidatedSet ValidateOneSet(const fs::path& set, const pipeline::SetLimits& limits,
                            const Context& context) {
  ValidatedSet validated;
  validated.set = io::ReadSet(set);
  RequireOneFrame(validated.set);
  const SparseScene sparse = io::LoadSparse(set, validated.set);
  validated.report = pipeline::ValidateSet(set, validated.set, sparse, limits, context.console);
  SayReport(validated.report, context.console);
  return validated;
}

void WritePage(const std::optional<fs::path>& page, const fs::path& set,
               const ValidatedSet& validated, const std::string& name,
               const std::string& conclusion, Console& console) {
  if (!page) return;
  WriteFileAtomically(*page, pipeline::ValidationPage(set, validated.set, validated.report,
                                                      "Calibration of " + name, conclusion));
  console.Say("report: " + page->string());
}

bool AreCamerasOfPhotos(const fs::path& file, const std::string& format, bool images_given) {
  if (!format.empty()) return true;
  if (!fs::exists(file) || fs::exists(file / "set.json")) return false;
  const io::FileLook look = io::LookAt(file);
  const auto& formats = pipeline::CameraFormatTable();
  return (look.is_folder && images_given) ||
         std::any_of(formats.begin(), formats.end(),
                     [&](const pipeline::CameraFormat& one) { return one.looks_so(file, look); });
}

}  // namespace dtr::cli
