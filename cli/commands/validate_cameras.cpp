// Cameras of other programs are imported into a set that is gone afterwards; it has points and no
// depth.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "calib/validation/conclusion.h"
#include "cli/commands/validate_set.h"
#include "dtr/base/error.h"
#include "dtr/base/temporary_folder.h"
#include "pipeline/import/import.h"

namespace dtr::cli {
namespace {

using Json = nlohmann::ordered_json;
using calib::Answer;

const char* WordOf(Answer answer) {
  switch (answer) {
    case Answer::kRight:
      return "right";
    case Answer::kWrong:
      return "wrong";
    case Answer::kUndecided:
      return "not decidable";
  }
  return "";
}

int ExitCodeOf(Answer answer) {
  switch (answer) {
    case Answer::kRight:
      return kDone;
    case Answer::kWrong:
      return kFailed;
    case Answer::kUndecided:
      return kUndecided;
  }
  return kFailed;
}

Json JsonOf(Answer answer, const std::string& conclusion, Json json) {
  json["answer"] = WordOf(answer);
  json["conclusion"] = conclusion;
  return json;
}

/// Import gave up: its error is the answer.
int AnswerByError(Answer answer, const std::string& error, const Context& context) {
  const std::string line = fmt::format("{}: {}", WordOf(answer), error);
  context.EmitJson(JsonOf(answer, line, Json::object()));
  context.console.Say(line);
  return ExitCodeOf(answer);
}

int ImportAndValidate(const ValidateCamerasOptions& options, const Context& context) {
  const TemporaryFolder folder;
  pipeline::ImportRequest request;
  request.cameras = options.cameras;
  request.format = options.format;
  request.images = options.images;
  request.cameras_alone = true;
  request.allow_missing = true;
  request.output = folder.path() / "cameras.dtr";
  request.seed = context.common.seed;
  const pipeline::ImportReport imported = pipeline::Import(request, context.console);
  const ValidatedSet validated = ValidateOneSet(request.output, options.limits, context);
  const pipeline::SetValidation& report = validated.report;
  const Answer answer = calib::AnswerOf(report.tests);
  const std::string line = calib::AnswerLine(report.tests, imported.views, report.held_out.p95_px);
  WritePage(options.page, request.output, validated,
            options.cameras.lexically_normal().filename().string(), line, context.console);
  Json json = JsonOf(answer, line, Json::parse(pipeline::ToJson(report)));
  json["notes"] = imported.notes;
  context.EmitJson(json);
  context.console.Say(line);
  return ExitCodeOf(answer);
}

}  // namespace

int RunValidateCameras(const ValidateCamerasOptions& options, const Context& context) {
  try {
    return ImportAndValidate(options, context);
  } catch (const NotDecidable& error) {
    return AnswerByError(Answer::kUndecided, error.what(), context);
  } catch (const CamerasContradicted& error) {
    return AnswerByError(Answer::kWrong, error.what(), context);
  }
}

}  // namespace dtr::cli
