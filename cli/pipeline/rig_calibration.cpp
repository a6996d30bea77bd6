#include "cli/pipeline/rig_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "calib/files/opencv_yaml.h"
#include "calib/solve/choose_model.h"
#include "cli/pipeline/board_calibration.h"
#include "dtr/base/error.h"

namespace dtr::pipeline {
namespace {

std::vector<calib::BoardView> ViewsOf(const RigPhotos& photos, size_t camera) {
  std::vector<calib::BoardView> views;
  for (const calib::RigView& view : photos.views) {
    if (view.camera == camera) views.push_back(view.seen);
  }
  return views;
}

// Each camera with its model: given, named, or chosen by this camera's own held-out views.
std::vector<calib::RigCameraInput> InputsOf(const calib::Board& board, const RigPhotos& photos,
                                            const RigCalibrationOptions& options) {
  std::vector<calib::RigCameraInput> inputs;
  for (size_t c = 0; c < photos.cameras.size(); ++c) {
    const RigPhotoCamera& camera = photos.cameras[c];
    const auto given = options.given.find(camera.name);
    if (given != options.given.end()) {
      const calib::LensCamera& lens = given->second.given.value();
      if (lens.width_px != camera.width_px || lens.height_px != camera.height_px) {
        throw Error(fmt::format("--camera {}: expected a lens of {} x {} px, found {} x {}",
                                camera.name, camera.width_px, camera.height_px, lens.width_px,
                                lens.height_px));
      }
      inputs.push_back({camera.name, given->second.model, camera.width_px, camera.height_px, lens});
      continue;
    }
    calib::BoardModel model = calib::BoardModel::kPinhole;
    if (options.model) {
      model = *options.model;
    } else {
      calib::ChoiceOptions choose;
      choose.solve = options.solve;
      choose.threads = options.threads;
      choose.seed = options.seed;
      try {
        const auto choice = calib::ChooseModel(board, ViewsOf(photos, c), camera.width_px,
                                               camera.height_px, choose);
        model = choice.scores[choice.chosen].model;
      } catch (const Error& error) {
        throw Error(fmt::format("camera {}: {}", camera.name, error.what()));
      }
    }
    inputs.push_back({camera.name, model, camera.width_px, camera.height_px, {}});
  }
  return inputs;
}

void RequireGiven(const RigPhotos& photos, const RigCalibrationOptions& options) {
  if (options.given.empty()) return;
  for (const RigPhotoCamera& camera : photos.cameras) {
    if (!options.given.contains(camera.name)) {
      throw UsageError(
          fmt::format("--camera: expected a lens for every camera or for none, found "
                      "none for {}",
                      camera.name));
    }
  }
  for (const auto& [name, lens] : options.given) {
    if (std::none_of(photos.cameras.begin(), photos.cameras.end(),
                     [&](const auto& camera) { return camera.name == name; })) {
      throw UsageError(fmt::format("--camera {}: no such camera; the first one is {}", name,
                                   photos.cameras.front().name));
    }
  }
}

}  // namespace

calib::Calibration CalibrateRig(const calib::Board& board, const RigPhotos& photos,
                                const RigCalibrationOptions& options, RigSummary* summary) {
  RequireGiven(photos, options);
  calib::RigOptions rig_options;
  rig_options.solve = options.solve;
  rig_options.free_lenses = !options.fixed_lenses && options.given.empty();
  const auto inputs = InputsOf(board, photos, options);
  calib::FreeRunning solved;
  if (options.free_running) {
    solved =
        calib::SolveFreeRunning(board, inputs, photos.views, photos.frames.size(), rig_options);
  } else {
    solved.solution =
        calib::SolveRig(board, inputs, photos.views, photos.frames.size(), rig_options);
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

namespace {

// COLMAP's models of one focal length, as the ones of two that say the same.
calib::LensCamera WithTwoFocalLengths(calib::LensCamera camera) {
  using calib::LensModel;
  static const std::map<LensModel, LensModel> kWider{
      {LensModel::kSimplePinhole, LensModel::kPinhole},
      {LensModel::kSimpleRadial, LensModel::kOpenCv},
      {LensModel::kRadial, LensModel::kOpenCv},
      {LensModel::kSimpleRadialFisheye, LensModel::kOpenCvFisheye},
      {LensModel::kRadialFisheye, LensModel::kOpenCvFisheye}};
  const auto wider = kWider.find(camera.model);
  if (wider == kWider.end()) return camera;
  camera.model = wider->second;
  camera.params.insert(camera.params.begin(), camera.params.front());
  camera.params.resize(static_cast<size_t>(calib::ParameterCount(camera.model)), 0);
  return camera;
}

}  // namespace

calib::RigCameraInput GivenLens(const calib::LensCamera& given, const std::string& where) {
  const calib::LensCamera camera = WithTwoFocalLengths(given);
  calib::RigCameraInput input;
  for (const calib::BoardModel model : calib::kBoardModels) {
    // The first model, so the one with the fewest coefficients, that says the same.
    if (calib::LensModelOf(model) != camera.model) continue;
    const auto first_unused = camera.params.begin() + calib::FreeParameterCount(model);
    if (std::any_of(first_unused, camera.params.end(), [](double p) { return p != 0; })) continue;
    input.model = model;
    input.given = camera;
    return input;
  }
  throw Error(fmt::format("{}: expected a lens that boards are solved with, found {}", where,
                          calib::NameOf(camera.model)));
}

void WriteRigFile(const std::filesystem::path& file, const calib::Calibration& calibration) {
  const std::string extension = file.extension().string();
  if (extension != ".yml" && extension != ".yaml") {
    WriteCameraFile(file, calibration);
    return;
  }
  if (calibration.cameras.size() != 2) {
    throw Error(fmt::format("{}: OpenCV's stereo file has 2 cameras, found {}; write a .json",
                            file.string(), calibration.cameras.size()));
  }
  calib::WriteOpenCvStereoYaml(file, calibration.cameras[0].camera, calibration.cameras[1].camera,
                               calibration.cameras[1].cam_from_rig);
}

}  // namespace dtr::pipeline
