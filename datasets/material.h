// datasets/material.h -- procedural surfaces: what a point's albedo is.
#pragma once
#include <Eigen/Core>
#include <cstdint>

#include "datasets/primitive.h"

namespace dtr::datasets {

/// A matt surface pattern. Colours are linear RGB albedos in [0, 1]; lengths in scene units.
struct Material {
  enum class Pattern {
    kFlat,      ///< `color` alone: nothing for a matcher to hold on to
    kPlaster,   ///< stained, speckled: `color` with `color2` stains
    kBrick,     ///< rows of bricks of `color`, joints of `color2`, one row `cell` high
    kPaving,    ///< irregular stones (Voronoi cells) about `cell` wide, joints of `color2`
    kPlanks,    ///< boards `cell` wide along local y
    kTiles,     ///< overlapping roof tiles, rows `cell` high along local y
    kPainting,  ///< overlapping patches of many colours, the largest `cell` wide
    kMarble,    ///< veins of `color2`
    kFoliage,   ///< leaves: strong contrast at all scales
    kSky,       ///< by direction from the local origin: clouds above a wooded skyline
  };
  Pattern pattern = Pattern::kFlat;
  Eigen::Vector3d color = Eigen::Vector3d::Constant(0.5);
  Eigen::Vector3d color2 = Eigen::Vector3d::Constant(0.25);
  double cell = 0.5;
  double contrast = 0.45;  ///< of the noise that covers every pattern except kFlat
  std::uint32_t seed = 0;
  bool shines = false;  ///< radiance = albedo, whatever the light (the sky)
};

/// Albedo at a surface point. Flat shapes are textured in the plane of their face, round ones in
/// space (so they have no seam). `footprint`: scene units per pixel, for band limiting only.
Eigen::Vector3d AlbedoAt(const Material& material, const Primitive& primitive,
                         const Eigen::Vector3d& p_in_world, double footprint);

}  // namespace dtr::datasets
