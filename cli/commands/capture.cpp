#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "capture/capture.h"
#include "capture/contents_json.h"
#include "cli/command.h"
#include "cli/panorama_options.h"
#include "cli/video_options.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "pipeline/build/capture.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct CaptureArguments {
  fs::path source, output;
  capture::VideoOptions video;
  capture::PanoramaUse panoramas = capture::PanoramaUse::kAuto;
  std::vector<std::string> drop;
  bool force = false;
};

Json ToJson(const capture::Photo& photo) {
  Json json{{"name", photo.name},
            {"width_px", photo.width_px},
            {"height_px", photo.height_px},
            {"focal_prior_px", photo.focal_prior_px ? Json(*photo.focal_prior_px) : Json(nullptr)},
            {"camera_group", photo.camera_group}};
  if (const auto& frame = photo.video_frame) {
    json["video"] = frame->video;
    json["frame"] = frame->number;
    json["time_s"] = frame->time_s;
  }
  if (const auto& face = photo.face) {
    json["panorama"] = face->panorama;
    json["panorama_view"] = face->face;
  }
  if (const auto& screening = photo.screening) {
    json["sharpness"] = screening->sharpness;
    json["overexposed_share"] = screening->overexposed_share;
    json["underexposed_share"] = screening->underexposed_share;
    json["faults"] = Json::array();
    for (const capture::Fault fault : screening->faults) {
      json["faults"].push_back(capture::NameOf(fault));
    }
    json["remarks"] = screening->remarks;
  }
  return json;
}

Json ToJson(const capture::Capture& capture) {
  Json json;
  json["photos"] = Json::array();
  for (const auto& photo : capture.photos) json["photos"].push_back(ToJson(photo));
  json["skipped"] = Json::array();
  for (const auto& skipped : capture.skipped) {
    json["skipped"].push_back({{"name", skipped.name}, {"reason", skipped.reason}});
  }
  json["remarks"] = Json::array();
  for (const auto& remark : capture.remarks) {
    json["remarks"].push_back({{"name", remark.name}, {"text", remark.text}});
  }
  json["contents"] = capture::JsonOf(capture.contents);
  return json;
}

std::vector<capture::Fault> FaultsIn(const std::vector<std::string>& names) {
  std::vector<capture::Fault> faults;
  for (const std::string& name : names) {
    const auto fault = capture::FaultCalled(name);
    if (!fault) {
      throw UsageError(
          fmt::format("--drop {}: expected blurred, overexposed, underexposed or duplicate", name));
    }
    faults.push_back(*fault);
  }
  return faults;
}

void Say(const capture::Capture& capture, const fs::path& output, Console& console) {
  console.Say(fmt::format("{}: {} photos", output.string(), capture.photos.size()));
  for (const auto& photo : capture.photos) {
    if (!photo.screening) continue;
    for (const auto& remark : photo.screening->remarks) {
      console.Say(fmt::format("  {}: {}", photo.name, remark));
    }
  }
  for (const auto& remark : capture.remarks) {
    console.Say(fmt::format("  {}: {}", remark.name, remark.text));
  }
  for (const auto& skipped : capture.skipped) {
    console.Say(fmt::format("  skipped: {}: {}", skipped.name, skipped.reason));
  }
  console.Say(fmt::format("  to look at: {}", (output / capture::kPageFile).string()));
}

int Run(const CaptureArguments& options, const Context& context) {
  const std::vector<capture::Fault> drop = FaultsIn(options.drop);
  const capture::StoreOptions store{options.force, options.video.memory_gb};
  const fs::path output = WithoutTrailingSlash(options.output);
  capture::CaptureWriter writer(output, store);
  capture::VideoOptions video = options.video;
  capture::Capture ingested = pipeline::Ingest(
      options.source, video, options.panoramas,
      [&] { return writer.Open() / capture::kFramesFolder; }, context.console);
  capture::DropFaulty(ingested, drop);
  if (ingested.photos.empty()) {
    throw Error(fmt::format(
        "{}: expected photos without the faults of --drop, found none; leave out --drop "
        "to see what each is",
        options.source.string()));
  }
  const auto look = pipeline::LookAt(ingested, "Photos of " + options.source.filename().string(),
                                     store.memory_gb, context.console);
  const fs::path unfinished = writer.Open();
  io::WriteImage(unfinished / capture::kContactSheetFile, look.contact_sheet);
  WriteFileAtomically(unfinished / capture::kPageFile, look.page);
  writer.Write(ingested, context.console);
  Say(ingested, output, context.console);
  context.EmitJson(ToJson(ingested));
  return kDone;
}

}  // namespace

void AddCaptureCommand(CLI::App& app) {
  AddCommand(app, "capture", "Ingest photos or videos: frames, orientation, EXIF priors, screening",
             "dtr capture walk.mp4 -o capture/ --max-frames 100", [](CLI::App& command) -> Action {
               auto options = std::make_shared<CaptureArguments>();
               command
                   .add_option("SRC", options->source,
                               "Folder of photos, a video, or a folder of nothing but videos")
                   ->required();
               command.add_option("-o,--output", options->output, "Folder to write")->required();
               command
                   .add_option(
                       "--drop", options->drop,
                       "Leave photos with these faults out: blurred, overexposed, underexposed, "
                       "duplicate; else they are only named")
                   ->delimiter(',')
                   ->type_name("FAULT,...");
               AddVideoOptions(command, options->video);
               AddPanoramaOption(command, options->panoramas);
               AddMemoryOption(command, options->video.memory_gb,
                               "Memory for photos that are looked at at a time [4]");
               command.add_flag("--force", options->force, "Replace a capture that exists");
               return [options](const Context& context) { return Run(*options, context); };
             });
}

}  // namespace dtr::cli
