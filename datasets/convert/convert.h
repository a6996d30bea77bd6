// datasets/convert/convert.h -- public data sets with known cameras, in our layout.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace dtr::datasets {

/// Writes `out`/cameras.json, `out`/images/, and where the set has them `out`/depth/*.exr (float32
/// plane z, scene units, holes 0) and `out`/masks/*.png, ready for `dtr import` and
/// `dtr build --poses`. Images are copied byte by byte, except lego's.
///
///   kind         source: what it is, what is converted (docs/CONVENTIONS.md has the list)
///   fountain     Strecha fountain-P11: .camera files of full-size images; metres
///   dtu          DTU scan with cameras_half_par.txt: millimetres become metres
///   temple       Middlebury templeSparseRing: par file, pixel centres at integers; metres
///   lego         NeRF synthetic: OpenGL poses; RGBA becomes colour on black and a mask of the
///                opaque pixels; 8-bit ray distance becomes z; unit arbitrary
///   livingroom   Open3D RGB-D: camera-to-world log, PrimeSense intrinsics, mm become m
///   7scenes      7-Scenes RGB-D: camera-to-world poses, mm become m
///   fern         LLFF: poses_bounds.npy, lens distortion ignored as LLFF does; unit arbitrary
///   plaza        ours: copied
///
/// `out` appears whole or not at all. Throws UsageError for another kind or when `out` exists;
/// Error, naming the file, when the source is not as it must be.
void ConvertDataset(const std::string& kind, const std::filesystem::path& source,
                    const std::filesystem::path& out);

/// The kinds ConvertDataset knows.
std::vector<std::string> ConvertibleKinds();

}  // namespace dtr::datasets
