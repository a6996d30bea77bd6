// tests/cli/errors_left_out.h -- what docs/ERRORS.md need not hold, by its reason.
#pragma once

namespace dtr::testing {

struct LeftOut {
  const char* file;
  const char* words;  ///< of the line; "" for every line of the file
};

inline constexpr LeftOut kLeftOut[] = {
    // Single fields of readers that all say FILE: FIELD: expected X, found Y.
    {"calib/files/calibration_json.cpp", "cameras: params"},
    {"dtr/io/formats/json_fields.cpp", ""},
    {"dtr/io/formats/text_numbers.cpp", ""},

    // Reasons that stand beside what is left out, in a line of the page.
    {"calib/solve/choose_model.cpp", "held out, "},
    {"calib/solve/rig_system.cpp", "a corner left the field of view"},

    // Said to a program that calls a library wrongly: dtr has asked for the same before, as its own
    // lines on the page say, or never calls it so.
    {"calib/bundle/refine.cpp", "expected known intrinsics for camera"},
    {"calib/sfm/run/held_out.cpp", "expected every image of the model among the sources"},
    {"calib/sfm/run/known_poses.cpp", "expected at least two photos with poses, found"},
    {"calib/sfm/run/sfm.cpp", "depth needs a second position to look from"},
    {"calib/sfm/run/sfm_steps.cpp", "camera model: expected a name like"},
    {"calib/sfm/run/workspace.cpp", "expected every photo once"},
    {"calib/sfm/run/workspace.cpp", "expected a positive size"},
    {"calib/sfm/run/workspace.cpp", "expected images of this workspace only"},
    {"calib/files/opencv_yaml.cpp", "OpenCV has no camera model"},
    {"calib/scale.cpp", "expected a measured distance"},
    {"calib/scale.cpp", "scale: expected at least"},
    {"calib/similarity.cpp", "found NaN or infinity"},
    {"calib/solve/board_solve.cpp", "with the camera model"},
    {"calib/sparse_from_sfm.cpp", ""},
    {"calib/validation/reprojection.cpp", ""},
    {"capture/video/ingest_video.cpp", "expected a number of frames above 0"},
    {"pipeline/render/novel_frames.cpp", "expected one of --like"},
    {"pipeline/core/depth_settings.cpp", "--preset: expected"},
    {"pipeline/boards/validate_calibration.cpp", "expected one view per camera and frame"},
    {"pipeline/metres/detail/placed_points.cpp", "expected a view of the set"},
    {"datasets/layout.cpp", "views: expected 2 or more"},
    {"datasets/render_truth.cpp", "supersampling: expected"},
    {"datasets/render_truth.cpp", "noise: expected"},
    {"datasets/render_truth.cpp", "gain: expected"},
    {"dtr/eval/bench_rows.cpp", "the set has no frame"},
    {"dtr/eval/cross_depth.cpp", ""},
    {"dtr/eval/depth_truth.cpp", "depth truth: expected"},
    {"dtr/eval/held_out.cpp", "the set has no frame"},
    {"dtr/eval/held_out.cpp", "has no image in memory"},
    {"dtr/eval/visibility.cpp", ""},
    {"dtr/gl/context.cpp", "cannot be made current"},
    {"dtr/gl/program.cpp", "expected among the embedded shaders"},
    {"dtr/io/code_bands.cpp", "to write"},
    {"dtr/io/depth_coding.cpp", ""},
    {"dtr/io/depth_io.cpp", "to write"},
    {"dtr/io/depth_io.cpp", "within half's range"},
    {"dtr/io/formats/foreign_depth.cpp", "expected a positive depth unit"},
    {"pipeline/import/detail/import_views.cpp", "no camera of the list has it"},
    {"dtr/io/image_io.cpp", "to write"},
    {"dtr/io/image_io.cpp", "expected a name ending in .png"},
    {"dtr/io/image_io.cpp", "expected alpha of the image's size"},
    {"dtr/io/json_fields.cpp", "expected JSON with finite numbers"},
    {"dtr/io/json_fields.cpp", "rename the file it names"},
    {"dtr/io/oiio_files.cpp", "image cannot be encoded as"},
    {"dtr/io/set_json.cpp", "extra_json: expected"},
    {"dtr/io/set_writer.cpp", "expected an id of the characters"},
    {"dtr/io/set_writer.cpp", "expected no depth in a held-out view"},
    {"dtr/io/set_writer.cpp", "expected a depth scale that divides"},
    {"dtr/io/set_writer.cpp", "expected depth to store"},
    {"dtr/io/set_writer.cpp", "expected the image of a source view"},
    {"dtr/io/set_writer.cpp", "expected stored depth before its mesh"},
    {"dtr/prune/prune.cpp", "expected a loss of at least 0 dB"},
    {"dtr/render/adaptive_mesh.cpp", "block cover: expected"},
    {"dtr/render/camera_path.cpp", ""},
    {"dtr/render/frame.cpp", "expected a finite pose"},
    {"dtr/render/geometry.cpp", "the depth map must have the image's size"},
    {"dtr/render/geometry.cpp", "set: expected at least one frame"},
    {"dtr/render/time_steps.cpp", "set: expected at least one frame"},
    {"dtr/render/scene.cpp", ""},
    {"dtr/report/encode.cpp", ""},
    {"stereo/depth_maps.cpp", "depth ranges: expected one per view"},
    {"stereo/engine.cpp", "stereo engine: expected one of"},
    {"stereo/patchmatch/patchmatch_engine.cpp", "depth range, expected"},
    {"stereo/sgbm/grey_image.cpp", ""},
    {"stereo/sgbm/sgbm_engine.cpp", "depth range, expected"},

    // Said to the application that OpenSceneGraph's node is part of.
    {"viewer/osg/blending.cpp", ""},
    {"viewer/osg/depth_tr.cpp", ""},
    {"viewer/osg/loaded_scene.cpp", ""},
};

}  // namespace dtr::testing
