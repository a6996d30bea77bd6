// tests/cpu/exact_scenes.h -- the reference renderer on scenes whose depth and poses are exact.
#pragma once
#include <cstdio>
#include <mutex>
#include <string>

#include "datasets/layout.h"
#include "datasets/render_truth.h"
#include "datasets/scene.h"
#include "dtr/cpu/renderer.h"
#include "dtr/eval/held_out.h"
#include "dtr/eval/visibility.h"
#include "dtr/render/geometry.h"

namespace dtr::testing {

/// Means over the held-out views.
struct ExactSceneFigures {
  double psnr_covered_db = 0, psnr_db = 0;
  double visible_coverage = 0;  ///< of the pixels whose true surface some source view sees
};

/// Photographs `name` from its default layout, holds out every 4th view, renders those from the
/// others with the default options and compares. Prints one line.
inline ExactSceneFigures MeasureExactScene(const std::string& name, int views, int width_px,
                                           int height_px, int supersampling) {
  const datasets::Scene scene = datasets::MakeScene(name, 1);
  const std::vector<Pose> poses =
      datasets::MakeLayout(scene, scene.framing().layouts.front(), views);
  const PinholeCamera camera = datasets::MakeCamera(width_px, height_px);
  datasets::PhotoOptions photo;
  photo.supersampling = supersampling;

  DtrSet set;
  set.frames.resize(1);
  std::vector<DepthImage> truth;
  for (size_t i = 0; i < poses.size(); ++i) {
    View view;
    view.id = view.name = std::to_string(1000 + i);
    view.camera = camera;
    view.cam_from_world = poses[i];
    view.image = datasets::RenderPhoto(scene, camera, poses[i], photo);
    truth.push_back(datasets::RenderDepth(scene, camera, poses[i]));
    view.role = i % 4 == 0 ? ViewRole::kHeldOut : ViewRole::kSource;
    if (view.role == ViewRole::kSource) view.depth = truth.back();
    set.frames[0].views.push_back(std::move(view));
  }
  FinishGeometry(set);

  ExactSceneFigures figures;
  int count = 0;
  eval::EvaluateOptions options;
  std::mutex mutex;
  options.on_rendered = [&](const View& held_out, const RenderResult& result) {
    const std::lock_guard lock(mutex);
    eval::TrueView novel;
    std::vector<eval::TrueView> sources;
    for (size_t i = 0; i < poses.size(); ++i) {
      const eval::TrueView view{camera, poses[i], &truth[i]};
      if (set.frames[0].views[i].id == held_out.id) novel = view;
      if (set.frames[0].views[i].role == ViewRole::kSource) sources.push_back(view);
    }
    figures.visible_coverage += eval::VisibleCoverage(novel, sources, result.coverage);
    ++count;
  };
  SilentProgress progress;
  const auto report = eval::EvaluateHeldOut(set, options, &cpu::Render, progress);
  figures.visible_coverage /= count;
  figures.psnr_covered_db = *report.mean.psnr_covered_db;
  figures.psnr_db = *report.mean.psnr_db;
  std::printf(
      "%-10s %dx%d  psnr_covered_db %.2f  psnr_db %.2f  seen of the visible %.2f %%  seen of all "
      "%.2f %%\n",
      name.c_str(), width_px, height_px, figures.psnr_covered_db, figures.psnr_db,
      100 * figures.visible_coverage, 100 * report.mean.coverage);
  return figures;
}

}  // namespace dtr::testing
