// dtr/render/fill_holes.h -- SPEC 7: a guess for what no view saw, apart from rendering.
#pragma once
#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "dtr/render/scene.h"
#include "dtr/render/shrunk_photos.h"

namespace dtr {

/// SPEC 7.1. Fills the image where coverage is 0; covered pixels, depth, coverage, view counts and
/// coverage_share stay as they are: a guess is never counted as seen. Push-pull (Gortler et al.,
/// The Lumigraph, 1996) in linear light that takes colours from the background: of the cells around
/// a hole the farthest has the most say, for what a view did not see was hidden by something
/// nearer. Work is linear in the pixels. An image without any covered pixel stays black.
void FillHoles(RenderResult& result);

/// SPEC 7.2. The same, but the guess is of depth: push-pull gives each hole a range of inverse
/// depth, of which the nearest counts that no view sees through; the views used show what colour
/// they see at that point (where they see nothing nearer), and only
/// what none of them shows is filled from its surroundings. Skies and textureless walls, where
/// depth maps have holes and photos do not, come out as photographed. `result` is the image
/// Render made of `scene` with the other arguments, before any filling. Does not depend on the
/// number of threads.
void FillHolesFromViews(const RenderScene& scene, const PinholeCamera& novel,
                        const Pose& novel_from_world, const RenderOptions& options,
                        RenderResult& result);

/// FillHolesFromViews for many images of a scene, to the same bytes: keeps what depends on the
/// views alone (ShrunkPhotos). Several threads may fill images of theirs at once.
class HoleFiller {
 public:
  /// Returns where what the image shows now lies, for hosts that hide other things by it (SPEC
  /// 7.5): plane z, seen or guessed; 0 where it is still empty, as nothing at all was seen.
  /// result.depth stays.
  Grid<float> Fill(const RenderScene& scene, const PinholeCamera& novel,
                   const Pose& novel_from_world, const RenderOptions& options,
                   RenderResult& result);
  /// Views of the same address may be others from here on.
  void Forget() { photos_.Clear(); }

 private:
  ShrunkPhotos photos_;
};

}  // namespace dtr
