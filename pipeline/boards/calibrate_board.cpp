#include "pipeline/boards/calibrate_board.h"

#include <algorithm>
#include <cctype>
#include <map>

#include "calib/colmap/model_io.h"
#include "calib/files/opencv_yaml.h"
#include "calib/solve/choose_model.h"
#include "dtr/base/lower_case.h"

namespace dtr::pipeline {
namespace {

std::vector<calib::TriedModel> TriedModels(const calib::ModelChoice& choice) {
  std::vector<calib::TriedModel> tried;
  for (size_t i = 0; i < choice.scores.size(); ++i) {
    const calib::ModelScore& score = choice.scores[i];
    calib::TriedModel model{score.model,  i == choice.chosen, {},
                            score.low_px, score.high_px,      score.refused};
    if (score.refused.empty()) model.held_out_rms_px = score.held_out_rms_px;
    tried.push_back(std::move(model));
  }
  return tried;
}

void AddViews(const BoardPhotos& photos, const calib::BoardSolution& solution,
              calib::Calibration& calibration) {
  for (const calib::SolvedView& solved : solution.views) {
    const auto seen = std::find_if(photos.views.begin(), photos.views.end(),
                                   [&](const auto& view) { return view.name == solved.name; });
    calibration.views.push_back(
        {*seen, 0, calibration.views.size(), solved.cam_from_board, solved.outliers});
  }
  calibration.left_out = photos.left_out;
  calibration.left_out.insert(calibration.left_out.end(), solution.left_out.begin(),
                              solution.left_out.end());
}

}  // namespace

calib::Calibration CalibrateBoard(const calib::Board& board, const BoardPhotos& photos,
                                  const std::string& name, const BoardCalibrationOptions& options,
                                  Progress& progress) {
  calib::Calibration calibration;
  calibration.board = board;
  calib::BoardSolution solution;
  if (options.model) {
    progress.Stage("solving for the camera", 0);
    solution = calib::SolveBoard(board, photos.views, photos.width_px, photos.height_px,
                                 *options.model, options.solve);
  } else {
    calib::ChoiceOptions choose;
    choose.solve = options.solve;
    choose.seed = options.seed;
    choose.progress = &progress;
    const calib::ModelChoice choice =
        calib::ChooseModel(board, photos.views, photos.width_px, photos.height_px, choose);
    calibration.models = TriedModels(choice);
    solution = *choice.scores[choice.chosen].solution;
  }
  calibration.cameras.push_back({name, solution.model, solution.camera, solution.covariance,
                                 solution.rms_px, solution.sigma_px});
  AddViews(photos, solution, calibration);
  return calibration;
}

void WriteCameraFile(const std::filesystem::path& file, const calib::Calibration& calibration) {
  const std::string extension = LowerExtension(file);
  if (extension == ".json") {
    calib::WriteCalibration(file, calibration);
  } else if (extension == ".txt") {
    std::map<std::uint32_t, calib::LensCamera> cameras;
    for (const auto& camera : calibration.cameras) {
      cameras.emplace(static_cast<std::uint32_t>(cameras.size() + 1), camera.camera);
    }
    colmap::WriteCamerasText(file, cameras);
  } else {
    calib::WriteOpenCvYaml(file, calibration.cameras.at(0).camera);
  }
}

}  // namespace dtr::pipeline
