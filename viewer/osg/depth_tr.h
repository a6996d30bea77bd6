// viewer/osg/depth_tr.h -- a D+TR scene as a node among ordinary models (docs/OSG.md). Names are
// those of the founding report, its section 3.2 and appendix III; methods are written as
// OpenSceneGraph's own.
#pragma once
#include <osg/Geode>
#include <osg/Image>
#include <osg/Matrixd>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "viewer/osg/input_view.h"
#include "viewer/osg/loaded_scene.h"

namespace osgDTR {

/// The report's names of the primitives.
enum Mode { TRIANGULATION = 1, SPLATTING = 2 };

/// Which way a frame goes.
enum class DrawPath {
  kGpu,       ///< dtr/gl: nothing leaves the GPU
  kReadBack,  ///< the report's: views are read back one by one and blended on the processor; slow
};

/// When holes are filled, where the options say that they are.
enum class FillTime {
  kAlways,     ///< every new image, also while the camera moves
  kWhenStill,  ///< once nothing has changed for a moment: moving images need not be read back
};

/// A scene of depth images that is drawn for the camera that looks at it. A leaf of the scene graph
/// as any other: under transforms that turn, shift and scale evenly, switches and levels of detail,
/// any number of times, in any number of windows. Its own coordinates are those of the set
/// (set.json: world relative to world_origin).
///
/// Drawing may run on any threads beside setters of options, which take hold with the next frame;
/// load(), setScene() and setTimeStep() belong into the update phase, as every change of a scene
/// graph's shape.
/// The report's own operations (setNovelView to saveProjectedImage) keep their results here, belong
/// to one thread at a time and never touch what is drawn.
class DepthTR : public osg::Geode {
 public:
  DepthTR();
  /// The copy shares the set in memory; options are its own.
  DepthTR(const DepthTR& other, const osg::CopyOp& copyop = osg::CopyOp::SHALLOW_COPY);
  META_Node(osgDTR, DepthTR)

      /// Reads a set. Throws dtr::Error, one line; what was loaded before stays then.
      void load(const std::string& set_folder);
  /// A set in memory, whose source views have image and depth.
  void setScene(dtr::DtrSet set);
  /// What the set was pruned for, else whole frames as `dtr render` draws them; loading does not
  /// set them.
  dtr::RenderOptions getDefaultRenderOptions() const;
  bool isLoaded() const { return getScene() != nullptr; }
  /// The time step that is shown; null without a set.
  std::shared_ptr<const LoadedScene> getScene() const;

  // Moving sets. All time steps are in memory; to show another is a change for the update phase.

  int numberOfTimeSteps() const;  ///< 1 of a still scene, 0 without a set
  int getTimeStep() const;
  /// From 0; throws dtr::UsageError for others.
  void setTimeStep(int time_step);
  /// The time step at so many seconds from the first one's start, where the set has come round any
  /// number of times: for hosts with a clock of their own. Throws dtr::UsageError for a time that
  /// is not finite.
  void setTime(double seconds);
  /// Seconds from the first time step to this one.
  double getTimeStepTime(int time_step) const;
  /// Goes on from the shown time step with the viewer's simulation time, round and round, or stops.
  void setPlaying(bool playing);
  bool isPlaying() const { return playing_; }
  void traverse(osg::NodeVisitor& visitor) override;

  /// How it is drawn; with `fill_holes` what no view saw is drawn, too, and hides and is hidden by
  /// the depth that filling gives it. Throws dtr::UsageError for options without a meaning.
  void setRenderOptions(const dtr::RenderOptions& options);
  dtr::RenderOptions getRenderOptions() const;
  void setDrawPath(DrawPath path);
  DrawPath getDrawPath() const;
  /// kAlways by default. A viewer that draws on demand must go on drawing for a moment (twice
  /// dtr::viewer::kStillAfterSeconds) after the last change to show what kWhenStill fills.
  void setFillTime(FillTime time);
  FillTime getFillTime() const;
  /// TRIANGULATION or SPLATTING by two passes, as in the report. By default it is neither: the
  /// deferred method (RENDER_SPEC 5).
  void setMode(Mode mode);

  /// The source views of the time step that is shown.
  const std::vector<InputView>& inputViews() const { return input_views_; }
  int numberOfInputViews() const { return static_cast<int>(input_views_.size()); }
  /// OpenSceneGraph's view matrix of an input camera, from this node's coordinates.
  osg::Matrixd getInputViewMatrix(int vn) const;
  /// The next input camera in the order of the views, round and round: the report's NextView().
  int nextView(int step = 1);
  /// The one that nextView went to last; -1 before.
  int currentView() const { return current_view_; }
  /// The one to begin with, in the middle of the others (dtr::OpeningView); -1 without a set.
  int openingView() const;

  // The report's operations: by the reference renderer (dtr/cpu); no graphics context is needed.

  /// The novel camera, and with it which views are valid. `model`: the first three rows of
  /// cam_from_world (rotation and translation; x right, y down, z forward); `calib`: K. Pixel
  /// centres lie at (0.5, 0.5). Throws dtr::Error for what is no rotation or no camera.
  void setNovelView(const double model[3][4], const double calib[3][3], int width, int height);
  void setNovelView(const dtr::PinholeCamera& novel, const dtr::Pose& novel_from_world);
  /// The same from OpenSceneGraph's matrices, of this node's coordinates.
  void setNovelView(const osg::Matrixd& modelview, const osg::Matrixd& projection, int width,
                    int height);
  /// The novel view, RGBA with alpha 0 where nothing was seen (unless the options say to fill
  /// that), first row at the bottom as OSG has it; from at most `reqNumber` views. Throws
  /// std::logic_error before setNovelView.
  osg::ref_ptr<osg::Image> getNovelView(dtr::BlendWeight blendType, int reqNumber);
  /// Of the last getNovelView: image, depth, coverage, views used.
  const dtr::RenderResult& getNovelResult() const;
  /// Draws input view `vn` alone as seen from the novel camera.
  void projectView(int vn, Mode type, int resolution, float pointSize);
  /// Image, depth and holes of the last projectView of this view (std::logic_error without one).
  const ProjectedView& getProjectedDT(int vn) const;
  /// Writes them: `file` (PNG, holes transparent).
  void saveProjectedImage(int vn, const std::string& file) const;

  // The report's blend functions: shares of views by their angles (radians) to the novel camera,
  // RENDER_SPEC 4.5 and 4.6. `flags`: which views count; `positions`: indices of views, those that
  // are weighed. Shares of these sum to 1, all others are 0; `weights` gets the length of `angles`.

  /// Of the flagged views the `reqNumber` at the smallest angles, by any of the five.
  void computeWeights(int reqNumber, dtr::BlendWeight blendType, const std::vector<double>& angles,
                      std::vector<double>& weights, const std::vector<bool>& flags) const;
  void angleBlending(const std::vector<double>& angles, std::vector<double>& weights,
                     const std::vector<bool>& flags, const std::vector<int>& positions) const;
  void exponentialAngleBlending(const std::vector<double>& angles, std::vector<double>& weights,
                                const std::vector<bool>& flags,
                                const std::vector<int>& positions) const;
  void cosAngleBlending(const std::vector<double>& angles, std::vector<double>& weights,
                        const std::vector<bool>& flags, const std::vector<int>& positions) const;
  void newAngleBlending(int k, const std::vector<double>& angles, std::vector<double>& weights,
                        const std::vector<bool>& flags, const std::vector<int>& positions) const;
  void inverseAngleBlending(int k, const std::vector<double>& angles, std::vector<double>& weights,
                            const std::vector<bool>& flags,
                            const std::vector<int>& positions) const;

  class dtrDrawable;
  dtrDrawable* getDtrDrawable() { return drawable_.get(); }
  const dtrDrawable* getDtrDrawable() const { return drawable_.get(); }

 protected:
  ~DepthTR() override;

 private:
  struct NovelView {
    dtr::PinholeCamera camera;
    dtr::Pose cam_from_world;
    std::optional<dtr::RenderResult> result;
  };
  void init();  // Shared constructor code, generates the drawable
  void TakeSet(std::shared_ptr<const LoadedSet> set);
  void ShowTimeStep(size_t time_step);
  void PlayAt(double simulation_time_s);
  NovelView& RequireNovelView();
  void BlendBy(dtr::BlendWeight blend, std::optional<int> k, const std::vector<double>& angles,
               std::vector<double>& weights, const std::vector<bool>& flags,
               const std::vector<int>& positions) const;
  InputView& At(int vn);
  const InputView& At(int vn) const;

  osg::ref_ptr<dtrDrawable> drawable_;
  std::vector<InputView> input_views_;
  std::optional<NovelView> novel_;
  int current_view_ = -1;
  bool playing_ = false;
  /// The simulation time at which the first time step began; none until the next update.
  std::optional<double> played_from_s_;
};

/// What a DepthTR draws with. May hang under several Geodes.
class DepthTR::dtrDrawable : public osg::Drawable {
 public:
  dtrDrawable();
  dtrDrawable(const dtrDrawable& other, const osg::CopyOp& copyop = osg::CopyOp::SHALLOW_COPY);
  META_Node(osgDTR, dtrDrawable)

      /// Draws the scene into what the camera draws to, with depth. Cameras that it cannot be drawn
      /// for (see NovelCameraOf) and errors of the driver are told to osg::notify, once each.
      void drawImplementation(osg::RenderInfo& info) const override;
  osg::BoundingBox computeBoundingBox() const override;
  void releaseGLObjects(osg::State* state = nullptr) const override;

  /// Graphics contexts that hold something of it now.
  size_t contextCount() const;

 protected:
  ~dtrDrawable() override;

 private:
  friend class DepthTR;
  struct State;
  void Draw(osg::RenderInfo& info) const;
  const std::unique_ptr<State> state_;
};

}  // namespace osgDTR
