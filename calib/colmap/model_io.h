// calib/colmap/model_io.h -- COLMAP's sparse models on disk, binary and text.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "calib/sfm_model.h"

namespace dtr::colmap {

enum class Format { kBinary, kText };

/// Reads the model in `folder`: cameras, images and points3D, as .bin where all three are there,
/// else as .txt. COLMAP's frames are ours (x right, y down, z forward; first pixel's centre at
/// (0.5, 0.5); cam_from_world), so nothing is converted. Images come back sorted by name. Poses are
/// those of frames.* and rigs.*, which COLMAP 3.12 and later write, where these are there in the
/// same format: COLMAP does not read the images' own then. `notes` gets one line where the two
/// differ.
///
/// Throws Error, naming file and record, on anything that is not a whole and consistent model:
/// truncation, counts beyond the file's end, values that are not finite, unknown camera models (by
/// number), duplicate ids or names, a feature of an absent point, an image of an absent camera, a
/// track that disagrees with the features, an image of no frame.
calib::SfmModel ReadModel(const std::filesystem::path& folder,
                          std::vector<std::string>* notes = nullptr);

/// The folder itself where it holds a model; else the one below it that COLMAP, its dense
/// workspaces and Gaussian splatting programs use: sparse/0, sparse or 0. Where there is none, or
/// sparse holds several models, the folder itself, for ReadModel to say what is wrong.
std::filesystem::path ModelFolderIn(const std::filesystem::path& folder);

/// Writes the three files of a model into `folder` (made when absent), the cameras last; where one
/// cannot be written none appears, and an earlier model stays as it is. Doubles
/// survive both formats bit for bit; reading the result gives the model back.
/// Throws Error on a model that ReadModel would reject, when the folder holds files of a model in
/// the other format, or when a file cannot be written.
void WriteModel(const std::filesystem::path& folder, const calib::SfmModel& model, Format format);

/// Throws UsageError where `folder` holds a binary model, or files of one that are not what a write
/// that was cut off left.
void RequireNoModel(const std::filesystem::path& folder);

/// The cameras of a cameras.txt alone, by id. Throws Error as ReadModel does.
std::map<std::uint32_t, calib::LensCamera> ReadCamerasText(const std::filesystem::path& file);

/// Writes a cameras.txt. Doubles survive bit for bit.
void WriteCamerasText(const std::filesystem::path& file,
                      const std::map<std::uint32_t, calib::LensCamera>& cameras);

}  // namespace dtr::colmap
