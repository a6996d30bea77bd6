// dtr/render/options.h -- what every renderer understands (docs/RENDER_SPEC.md numbers the steps).
#pragma once
#include <numbers>
#include <optional>

namespace dtr {

enum class RenderMethod {
  kTwoPass,   ///< SPEC 4: the founding report's algorithm
  kDeferred,  ///< SPEC 5: depth first, then one pass per pixel over the views
};

enum class Primitive {
  kMesh,   ///< SPEC 2: implied triangulation, two triangles per 2x2 block
  kSplat,  ///< SPEC 3: one footprint per depth pixel
};

/// SPEC 4.5: weight of a view from the angle t at the 3D point between the directions to the
/// view's centre and to the novel centre.
enum class BlendWeight {
  kCosine,        ///< max(0, cos t)^exponent
  kExponential,   ///< e^(-falloff t); the report lost the minus sign
  kAngle,         ///< max(0, 1 - t / max_angle)
  kInverseAngle,  ///< 1 / (t + t_pixel)^blend_k
  kKNearest,      ///< max(0, 1 - t / t_(k+1)), k = blend_k
};

/// Options of `dtr render`, by the same names. Thresholds are in pixels of disparity at the view's
/// reference baseline, so they mean the same at any scale of the world.
struct RenderOptions {
  RenderMethod method = RenderMethod::kDeferred;
  Primitive primitive = Primitive::kMesh;  ///< of kTwoPass; says nothing to kDeferred
  int views = 8;            ///< K: at most so many of the valid views, the nearest by angle
  int resolution = 1;       ///< R: every R-th depth pixel per axis
  double point_size = 1.0;  ///< splats: factor on the footprint
  // Defaults are what held-out views of real photos liked best, docs/accuracy/RENDERING.md.
  BlendWeight blend = BlendWeight::kInverseAngle;
  double exponent = 8.0;                        ///< n of kCosine
  double falloff = 8.0;                         ///< c of kExponential, per radian
  int blend_k = 2;                              ///< k of kKNearest, power of kInverseAngle
  double max_angle_rad = std::numbers::pi / 3;  ///< valid views, SPEC 1
  double delta_px = 1.0;                        ///< Delta of SPEC 4, pixels of disparity
  double depth_break_px = 1.0;     ///< break threshold of SPEC 2.3, pixels of disparity
  double mesh_tolerance_px = 0.7;  ///< of SPEC 5.1's reduced mesh, pixels of disparity
  /// The report's absolute thresholds, in scene units; when set they replace the scale-free ones.
  std::optional<double> absolute_delta;
  std::optional<double> absolute_depth_break;
  bool blend_in_linear_light = false;  ///< else in sRGB values
  bool fill_holes = false;             ///< SPEC 7, a separate step; never counted as seen
  bool smooth_edges = false;           ///< SPEC 8, a separate step
  bool operator==(const RenderOptions&) const = default;
};

/// The defaults of programs that show images: holes filled, edges smoothed.
RenderOptions WholeFrames();

/// Throws dtr::UsageError naming the option when a value has no meaning.
void CheckRenderOptions(const RenderOptions& options);

}  // namespace dtr
