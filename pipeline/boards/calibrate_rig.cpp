#include "pipeline/boards/calibrate_rig.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/files/opencv_yaml.h"
#include "calib/solve/choose_model.h"
#include "dtr/base/error.h"
#include "pipeline/boards/calibrate_board.h"

namespace dtr::pipeline {
namespace {

std::vector<calib::BoardView> ViewsOf(const RigPhotos& photos, size_t camera) {
  std::vector<calib::BoardView> views;
  for (const calib::RigView& view : photos.views) {
    if (view.camera == camera) views.push_back(view.seen);
  }
  return views;
}

struct Inputs {
  std::vector<calib::RigCameraInput> cameras;
  std::vector<std::vector<calib::ModelScore>> scores;  // empty where the model was not chosen here
};

// Each camera with its model: given, named, or chosen by this camera's own held-out views.
Inputs InputsOf(const calib::Board& board, const RigPhotos& photos,
                const RigCalibrationOptions& options, Progress& progress) {
  Inputs all;
  std::vector<calib::RigCameraInput>& inputs = all.cameras;
  all.scores.resize(photos.cameras.size());
  for (size_t c = 0; c < photos.cameras.size(); ++c) {
    const RigPhotoCamera& camera = photos.cameras[c];
    const auto given = options.given.find(camera.name);
    if (given != options.given.end()) {
      const calib::LensCamera& lens = given->second.given.value();
      if (lens.width_px != camera.width_px || lens.height_px != camera.height_px) {
        throw Error(fmt::format(
            "`camera` {}: expected intrinsics of {} x {} px as its photos are, found {} x {}; give "
            "the "
            "intrinsics of this camera",
            camera.name, camera.width_px, camera.height_px, lens.width_px, lens.height_px));
      }
      inputs.push_back({.name = camera.name,
                        .model = given->second.model,
                        .width_px = camera.width_px,
                        .height_px = camera.height_px,
                        .given = lens});
      continue;
    }
    calib::BoardModel model = calib::BoardModel::kPinhole;
    if (options.model) {
      model = *options.model;
    } else {
      calib::ChoiceOptions choose;
      choose.solve = options.solve;
      choose.seed = options.seed;
      choose.progress = &progress;
      choose.stage = "choosing the camera model of " + camera.name;
      try {
        auto choice = calib::ChooseModel(board, ViewsOf(photos, c), camera.width_px,
                                         camera.height_px, choose);
        model = choice.scores[choice.chosen].model;
        all.scores[c] = std::move(choice.scores);
      } catch (const Interrupted&) {
        throw;
      } catch (const Error& error) {
        throw Error(fmt::format("camera {}: {}", camera.name, error.what()));
      }
    }
    inputs.push_back({camera.name, model, camera.width_px, camera.height_px, {}});
  }
  return all;
}

// A model that a camera's own views held, and whose distortion turns back when all cameras are
// solved together, gives way to the best simpler one; false where there is none.
bool TakeSimplerModel(size_t camera, Inputs& inputs, RigSummary& summary) {
  calib::RigCameraInput& input = inputs.cameras[camera];
  const calib::ModelScore* simpler = nullptr;
  for (const calib::ModelScore& score : inputs.scores[camera]) {
    if (!score.refused.empty() ||
        calib::ComplexityOf(score.model) >= calib::ComplexityOf(input.model)) {
      continue;
    }
    if (simpler == nullptr || score.held_out_rms_px < simpler->held_out_rms_px) simpler = &score;
  }
  if (simpler == nullptr) return false;
  summary.simpler.push_back(
      fmt::format("{}: {}, for in the rig {} folds back before the corner of the image", input.name,
                  NameOf(simpler->model), NameOf(input.model)));
  input.model = simpler->model;
  return true;
}

calib::FreeRunning Solve(const calib::Board& board, const RigPhotos& photos, Inputs& inputs,
                         bool free_running, const calib::RigOptions& options, RigSummary& summary) {
  while (true) {
    try {
      if (free_running) {
        return calib::SolveFreeRunning(board, inputs.cameras, photos.views, photos.frames.size(),
                                       options);
      }
      calib::FreeRunning solved;
      solved.solution =
          calib::SolveRig(board, inputs.cameras, photos.views, photos.frames.size(), options);
      return solved;
    } catch (const calib::LensTurnsBack& turned) {
      if (!TakeSimplerModel(turned.camera(), inputs, summary)) throw;
    }
  }
}

void RequireGiven(const RigPhotos& photos, const RigCalibrationOptions& options) {
  if (options.given.empty()) return;
  for (const RigPhotoCamera& camera : photos.cameras) {
    if (!options.given.contains(camera.name)) {
      throw UsageError(
          fmt::format("`camera`: expected intrinsics for every camera or for none, found "
                      "none for {}",
                      camera.name));
    }
  }
  for (const auto& given : options.given) {
    const std::string& name = given.first;  // Clang 14 captures no structured binding
    if (std::none_of(photos.cameras.begin(), photos.cameras.end(),
                     [&](const auto& camera) { return camera.name == name; })) {
      throw UsageError(fmt::format("`camera` {}: no such camera; the first one is {}", name,
                                   photos.cameras.front().name));
    }
  }
}

}  // namespace

calib::Calibration CalibrateRig(const calib::Board& board, const RigPhotos& photos,
                                const RigCalibrationOptions& options, RigSummary* summary,
                                Progress& progress) {
  RequireGiven(photos, options);
  calib::RigOptions rig_options;
  rig_options.solve = options.solve;
  rig_options.solve.progress = &progress;
  rig_options.free_lenses = !options.fixed_lenses && options.given.empty();
  Inputs inputs = InputsOf(board, photos, options, progress);
  const calib::FreeRunning solved =
      Solve(board, photos, inputs, options.free_running, rig_options, *summary);
  if (!options.free_running) {
    summary->delays = calib::DelaysOf(board, solved.solution);
  }
  const calib::RigSolution& solution = solved.solution;
  summary->unsteady = calib::TestUnsteadyClocks(solution);
  calib::Calibration calibration;
  calibration.board = board;
  calibration.lenses_given = !rig_options.free_lenses;
  for (size_t c = 0; c < solution.rig.cameras.size(); ++c) {
    const calib::RigCamera& camera = solution.rig.cameras[c];
    const int count = calib::FreeParameterCount(camera.model);
    calib::CalibratedCamera out{camera.name,
                                camera.model,
                                camera.camera,
                                Eigen::MatrixXd::Zero(count, count),
                                solution.camera_rms_px[c],
                                solution.sigma_px,
                                camera.cam_from_rig,
                                {}};
    const int lens = solution.layout.LensAt(c), place = solution.layout.PlaceAt(c);
    if (lens >= 0) out.covariance = solution.covariance.block(lens, lens, count, count);
    if (place >= 0) out.place_covariance = solution.covariance.block(place, place, 6, 6);
    if (options.free_running && c > 0 && solved.delays[c]) {
      out.delay = {solved.delays[c]->frames, solved.delays[c]->sigma, solved.moved[c]};
    }
    calibration.cameras.push_back(std::move(out));
  }
  for (const calib::RigView& view : solution.rig.views) {
    calibration.views.push_back(
        {view.seen, view.camera, view.frame,
         solution.rig.cameras[view.camera].cam_from_rig * solution.rig.rig_from_board[view.frame],
         view.outliers});
  }
  calibration.left_out = photos.left_out;
  calibration.left_out.insert(calibration.left_out.end(), solution.left_out.begin(),
                              solution.left_out.end());
  summary->frames = solution.rows.size();
  summary->corners = solution.corners;
  summary->outliers = solution.outliers;
  summary->rms_px = solution.rms_px;
  summary->sigma_px = solution.sigma_px;
  summary->flipped = solution.flipped;
  summary->passes = solved.passes;
  return calibration;
}

calib::RigCameraInput GivenLens(const calib::LensCamera& given, const std::string& where) {
  const calib::LensCamera camera = calib::WithTwoFocalLengths(given);
  calib::RigCameraInput input;
  for (const calib::BoardModel model : calib::kBoardModels) {
    // The first model, so the one with the fewest coefficients, that says the same.
    if (calib::CameraModelOf(model) != camera.model) continue;
    const auto first_unused = camera.params.begin() + calib::FreeParameterCount(model);
    if (std::any_of(first_unused, camera.params.end(), [](double p) { return p != 0; })) continue;
    input.model = model;
    input.given = camera;
    return input;
  }
  throw Error(fmt::format("{}: expected intrinsics that boards are solved with, found {}", where,
                          calib::NameOf(camera.model)));
}

void WriteRigFile(const std::filesystem::path& file, const calib::Calibration& calibration) {
  const std::string extension = file.extension().string();
  if (extension != ".yml" && extension != ".yaml") {
    WriteCameraFile(file, calibration);
    return;
  }
  if (calibration.cameras.size() != 2) {
    throw Error(fmt::format(
        "{}: expected 2 cameras, as OpenCV's stereo files have, found {}; write a .json",
        file.string(), calibration.cameras.size()));
  }
  calib::WriteOpenCvStereoYaml(file, calibration.cameras[0].camera, calibration.cameras[1].camera,
                               calibration.cameras[1].cam_from_rig);
}

}  // namespace dtr::pipeline
