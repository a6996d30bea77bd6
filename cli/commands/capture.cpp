#include "capture/capture.h"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/command.h"

namespace dtr::cli {
namespace {

using Json = nlohmann::ordered_json;

std::string ToJson(const capture::Capture& capture) {
  Json json;
  json["photos"] = Json::array();
  for (const auto& photo : capture.photos) {
    json["photos"].push_back(
        {{"name", photo.name},
         {"width_px", photo.width_px},
         {"height_px", photo.height_px},
         {"focal_prior_px", photo.focal_prior_px ? Json(*photo.focal_prior_px) : Json(nullptr)},
         {"camera_group", photo.camera_group}});
  }
  json["skipped"] = Json::array();
  for (const auto& skipped : capture.skipped) {
    json["skipped"].push_back({{"name", skipped.name}, {"reason", skipped.reason}});
  }
  return json.dump(1);
}

}  // namespace

void AddCaptureCommand(CLI::App& app) {
  struct Options {
    std::filesystem::path source, output;
  };
  AddCommand(
      app, "capture", "Ingest a folder of photos: orientation, EXIF priors, screening",
      "dtr capture photos/ -o capture/", [](CLI::App& command) -> Action {
        auto options = std::make_shared<Options>();
        command.add_option("SRC", options->source, "Folder of photos")->required();
        command.add_option("-o,--output", options->output, "Folder to write")->required();
        return [options](const Context& context) -> int {
          const auto ingested = capture::IngestPhotos(options->source, {}, context.console);
          capture::WriteCapture(ingested, options->output, context.common.threads);
          context.console.Say(
              fmt::format("{}: {} photos", options->output.string(), ingested.photos.size()));
          for (const auto& skipped : ingested.skipped) {
            context.console.Say(fmt::format("  skipped: {}: {}", skipped.name, skipped.reason));
          }
          context.EmitJson(ToJson(ingested));
          return kDone;
        };
      });
}

}  // namespace dtr::cli
