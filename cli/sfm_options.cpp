#include "cli/sfm_options.h"

#include <fmt/format.h>

#include <map>
#include <string>

namespace dtr::cli {
namespace {

constexpr int kMinFeatures = 128, kSmallestPx = 64;  // with less no photos come together

}  // namespace

CLI::Option* AddSfmOptions(CLI::App& command, pipeline::SfmChoice& choice) {
  std::map<std::string, sfm::SfmEngine> engines;
  for (const auto engine :
       {sfm::SfmEngine::kColmap, sfm::SfmEngine::kGlobal, sfm::SfmEngine::kAuto}) {
    engines[sfm::NameOf(engine)] = engine;
  }
  command
      .add_option_function<std::string>(
          "--sfm",
          [&choice, engines](const std::string& name) { choice.engine = engines.at(name); },
          "Structure from motion: COLMAP's, our own (global), or our own with COLMAP's mapper "
          "where ours does not pass [auto]")
      ->check(CLI::IsMember({"colmap", "global", "auto"}))
      ->type_name("colmap|global|auto");
  command
      .add_option("--feature-size", choice.feature_size_px,
                  "Long side of the photos when SfM looks for features [2400, or what --memory "
                  "allows]")
      ->check(CLI::Range(kSmallestPx, 65536))
      ->type_name("PX");
  command
      .add_option("--features", choice.features,
                  fmt::format("Max features per photo [{}; of COLMAP {}, its limit]",
                              sfm::kMaxOwnFeatures, sfm::kMaxFeatures))
      ->check(CLI::Range(kMinFeatures, sfm::kMaxOwnFeatures))
      ->type_name("N");
  std::map<std::string, sfm::Matching> names;
  for (const auto matching : {sfm::Matching::kAuto, sfm::Matching::kExhaustive,
                              sfm::Matching::kPreselected, sfm::Matching::kSequential}) {
    names[sfm::NameOf(matching)] = matching;
  }
  command
      .add_option_function<std::string>(
          "--matching",
          [&choice, names](const std::string& name) { choice.matching = names.at(name); },
          "Photos matched with each other: all, those that resemble each other, or neighbours by "
          "name [auto: all up to 60 photos, then preselected]")
      ->check(CLI::IsMember({"auto", "exhaustive", "preselected", "sequential"}))
      ->type_name("auto|exhaustive|preselected|sequential");
  command
      .add_option("--lens-model", choice.lens_model,
                  "Distortion that SfM starts with, by COLMAP's names: SIMPLE_RADIAL, RADIAL, "
                  "OPENCV, of a fisheye RADIAL_FISHEYE or OPENCV_FISHEYE [RADIAL]")
      ->check(
          CLI::IsMember({"SIMPLE_RADIAL", "RADIAL", "OPENCV", "RADIAL_FISHEYE", "OPENCV_FISHEYE"}))
      ->type_name("MODEL");
  std::map<std::string, pipeline::CameraPer> sharing;
  for (const auto per : {pipeline::CameraPer::kAuto, pipeline::CameraPer::kFolder,
                         pipeline::CameraPer::kPhoto, pipeline::CameraPer::kSet}) {
    sharing[pipeline::NameOf(per)] = per;
  }
  return command
      .add_option_function<std::string>(
          "--camera-per",
          [&choice, sharing](const std::string& name) { choice.camera_per = sharing.at(name); },
          "Photos that share intrinsics: of a folder, none, or of equal size and orientation "
          "[auto: equal EXIF and size; folder where held-out observations need it]")
      ->check(CLI::IsMember({"auto", "folder", "photo", "set"}))
      ->type_name("auto|folder|photo|set");
}

}  // namespace dtr::cli
