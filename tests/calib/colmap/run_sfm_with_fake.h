// tests/calib/colmap/run_sfm_with_fake.h -- structure from motion of a few photos by a COLMAP that
// does as it is told.
#pragma once
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

#include "calib/colmap/model_io.h"
#include "calib/colmap/steps.h"
#include "calib/sfm/run/sfm.h"
#include "calib/sfm/run/workspace.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "tests/calib/colmap/fake_colmap.h"
#include "tests/support/test_data.h"

namespace dtr::colmap::testing {

// Notes what it is told, and can ask to stop once a stage has begun.
class Listener final : public Progress {
 public:
  void Stage(const std::string& name, int total) override {
    stages.push_back(name + "/" + std::to_string(total));
    if (name == stop_at) stop = true;
  }
  void Update(int done) override { updates.push_back(done); }
  void Note(const std::string& line) override { notes.push_back(line); }
  bool StopRequested() const override { return stop; }

  std::vector<std::string> stages, notes;
  std::vector<int> updates;
  std::string stop_at;
  std::atomic<bool> stop = false;
};

// Photos that only a fake COLMAP will ever open, named so that lists of names would break.
class RunSfmWithFake : public ::testing::Test {
 protected:
  RunSfmWithFake() {
    std::filesystem::create_directories(photos_ / "Über uns");
    for (const char* name : {"Über uns/b photo.JPG", "a b.jpg", "c.jpg", "d.png"}) {
      WriteFileAtomically(photos_ / name, std::string("photo ") + name);
      images_.push_back({name, 640, 480, 500.0, "camera one"});
    }
    options_.colmap = &kSteps;
    options_.engine = sfm::SfmEngine::kColmap;
    fake_.LeaveDatabase(Aliases());
    LeaveModel(0, 2);
    LeaveModel(1, 3);
  }

  // A model of the first `count` photos in order of names, under the names COLMAP sees.
  void LeaveModel(int number, size_t count) {
    calib::SfmModel model;
    model.cameras[1] = {calib::CameraModel::kSimpleRadial, 640, 480, {500, 320, 240, 0}};
    for (size_t i = 0; i < count; ++i) {
      calib::SfmImage image;
      image.id = static_cast<std::uint32_t>(i + 1);
      image.name = sfm::Workspace::AliasFor("", i, sorted_[i]);
      image.camera_id = 1;
      image.features.push_back({{320 + static_cast<double>(i), 240}, 9});
      model.images.push_back(image);
    }
    model.points[9] = {{0, 0, 5}, {1, 2, 3}, 0.5};
    const std::filesystem::path folder = fake_ / ("model." + std::to_string(number));
    std::filesystem::remove_all(folder);
    WriteModel(folder, model, Format::kBinary);
  }

  // Photos after those that every test has, by name too.
  void LeaveMorePhotos(int count) {
    for (int i = 0; i < count; ++i) {
      const std::string name = fmt::format("Über uns/c {:03}.jpg", i);
      WriteFileAtomically(photos_ / name, "photo " + name);
      images_.push_back({name, 640, 480, 500.0, "camera one"});
      sorted_.push_back(name);
    }
  }

  std::vector<std::string> Aliases() const {
    std::vector<std::string> aliases;
    for (size_t i = 0; i < sorted_.size(); ++i) {
      aliases.push_back(sfm::Workspace::AliasFor("", i, sorted_[i]));
    }
    return aliases;
  }

  sfm::SfmResult Run() {
    return sfm::RunSfm(photos_.path(), images_, workspace_ / "sfm", options_, listener_);
  }

  std::string MessageOfRun() {
    try {
      Run();
    } catch (const Error& error) {
      return error.what();
    }
    return "(no error)";
  }

  std::vector<std::string> sorted_ = {"a b.jpg", "c.jpg", "d.png", "Über uns/b photo.JPG"};
  const dtr::testing::TemporaryFolder photos_, workspace_;
  FakeColmap fake_;
  std::vector<sfm::SfmImageInput> images_;
  sfm::SfmOptions options_;
  Listener listener_;
};

}  // namespace dtr::colmap::testing
