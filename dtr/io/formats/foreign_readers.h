// dtr/io/formats/foreign_readers.h -- readers of other programs' cameras, one a format.
//
// All of them throw Error "file: entry: ..." for a file that is cut short, numbers that are not
// finite, poses that are no rotations (kPrintedRotationTolerance) and camera models that ours do
// not contain, by name. Lengths are in pixels with the origin in the outer corner of the first
// pixel once they are read; the conventions of each format stand in docs/CONVENTIONS.md.
#pragma once
#include <filesystem>

#include "dtr/io/formats/foreign_scene.h"

namespace dtr::io {

/// Agisoft Metashape, File > Export > Export Cameras, XML: sensors of the types frame and fisheye,
/// cameras of the largest component, with the transforms of component and chunk. Source: Metashape
/// Professional manual, appendix "Camera models".
ForeignScene ReadMetashapeXml(const std::filesystem::path& file);

/// RealityScan and RealityCapture, Export > Registration, "Internal/External camera parameters" and
/// its "OpenCV-compliant" form. Columns are found by the names in the first line.
ForeignScene ReadRealityScanCsv(const std::filesystem::path& file);

/// OpenSfM and OpenDroneMap, reconstruction.json. Of several reconstructions the one with most
/// shots. Points with their observations where tracks.csv lies beside.
/// Source: opensfm.org/docs, "Geometric models".
ForeignScene ReadOpenSfmJson(const std::filesystem::path& file);

/// Bundler v0.3, bundle.out, with the list of its images beside (one of BundlerLists).
/// Source: Bundler's manual, "Output format and scene representation".
ForeignScene ReadBundlerOut(const std::filesystem::path& file);
/// Where the list of the images of a bundle.out may lie, likeliest first.
std::vector<std::filesystem::path> BundlerLists(const std::filesystem::path& file);

/// VisualSFM, .nvm (NVM_V3): the first model. Source: VisualSFM's documentation, "NVM".
ForeignScene ReadNvm(const std::filesystem::path& file);

/// OpenMVG, sfm_data.json as cereal writes it. Source: openMVG/sfm/sfm_data_io_cereal.
ForeignScene ReadOpenMvgJson(const std::filesystem::path& file);

/// AliceVision and Meshroom, .sfm or .json. Source: aliceVision/sfmDataIO/jsonIO.
ForeignScene ReadAliceVisionJson(const std::filesystem::path& file);

/// MVSNet (Yao et al. 2018): a folder of cams/NNNNNNNN_cam.txt, or cams itself. Photos are called
/// by the number. `dtr export --format mvsnet` adds dtr.json, which has unit and origin.
ForeignScene ReadMvsnetFolder(const std::filesystem::path& folder);

/// MPEG immersive video (TMIV, RVS, OpenDIBR), the JSON of a sequence: perspective cameras.
ForeignScene ReadMivJson(const std::filesystem::path& file);

}  // namespace dtr::io
