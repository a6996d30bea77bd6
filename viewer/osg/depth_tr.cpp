#include "viewer/osg/depth_tr.h"

#include <osg/FrameStamp>
#include <osg/NodeVisitor>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/cpu/renderer.h"
#include "dtr/io/image_io.h"
#include "dtr/render/opening_view.h"
#include "dtr/render/valid_views.h"
#include "viewer/osg/dtr_drawable.h"
#include "viewer/osg/novel_camera.h"

namespace osgDTR {
namespace {

// What a matrix given in decimal digits may lack of a rotation.
constexpr double kRotationError = 1e-6;

osg::ref_ptr<osg::Image> ToOsgImage(const dtr::RenderResult& result, bool filled) {
  const int width = result.image.width(), height = result.image.height();
  osg::ref_ptr<osg::Image> image = new osg::Image;
  image->allocateImage(width, height, 1, GL_RGBA, GL_UNSIGNED_BYTE);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      unsigned char* out = image->data(x, height - 1 - y);
      for (int c = 0; c < 3; ++c) out[c] = result.image(x, y, c);
      out[3] = filled ? 255 : result.coverage(x, y);
    }
  }
  return image;
}

}  // namespace

DepthTR::DepthTR() { init(); }

DepthTR::DepthTR(const DepthTR& other, const osg::CopyOp& copyop) : osg::Geode(other, copyop) {
  // The children that Geode copied are the other's drawables, or copies without this node's state.
  removeDrawables(0, getNumDrawables());
  init();
  drawable_->state_->settings = other.drawable_->state_->Get();
  drawable_->dirtyBound();
  if (isLoaded()) ShowTimeStep(drawable_->state_->settings.time_step);
  setPlaying(other.playing_);
}

DepthTR::~DepthTR() = default;

void DepthTR::init() {
  drawable_ = new dtrDrawable;
  addDrawable(drawable_.get());
}

void DepthTR::load(const std::string& set_folder) { TakeSet(LoadSet(set_folder)); }
void DepthTR::setScene(dtr::DtrSet set) { TakeSet(MakeSet(std::move(set))); }

void DepthTR::TakeSet(std::shared_ptr<const LoadedSet> set) {
  novel_.reset();
  current_view_ = -1;
  played_from_s_.reset();
  drawable_->state_->Set([&](DrawSettings& settings) {
    settings.set = std::move(set);
    settings.time_step = 0;
  });
  drawable_->dirtyBound();
  ShowTimeStep(0);
}

std::shared_ptr<const LoadedScene> DepthTR::getScene() const {
  return drawable_->state_->Get().Scene();
}

dtr::RenderOptions DepthTR::getDefaultRenderOptions() const {
  const auto set = drawable_->state_->Get().set;
  return set ? set->defaults : dtr::RenderOptions();
}

void DepthTR::ShowTimeStep(size_t time_step) {
  drawable_->state_->Set([&](DrawSettings& settings) { settings.time_step = time_step; });
  input_views_.clear();
  for (const dtr::View* view : getScene()->scene.views) input_views_.emplace_back(*view);
  if (novel_) setNovelView(novel_->camera, novel_->cam_from_world);  // of these views now
}

int DepthTR::numberOfTimeSteps() const {
  const auto set = drawable_->state_->Get().set;
  return set ? static_cast<int>(set->time_steps.size()) : 0;
}

int DepthTR::getTimeStep() const { return static_cast<int>(drawable_->state_->Get().time_step); }

void DepthTR::setTimeStep(int time_step) {
  if (time_step < 0 || time_step >= numberOfTimeSteps()) {
    throw dtr::UsageError("DepthTR: expected a time step from 0 to " +
                          std::to_string(numberOfTimeSteps() - 1) + ", found " +
                          std::to_string(time_step));
  }
  played_from_s_.reset();  // goes on from here
  ShowTimeStep(static_cast<size_t>(time_step));
}

void DepthTR::setTime(double seconds) {
  if (!std::isfinite(seconds)) {
    throw dtr::UsageError("DepthTR: expected a finite time, found " + std::to_string(seconds));
  }
  const auto set = drawable_->state_->Get().set;
  if (set) setTimeStep(static_cast<int>(set->clock.FrameAt(seconds)));
}

double DepthTR::getTimeStepTime(int time_step) const {
  const auto set = drawable_->state_->Get().set;
  return set ? set->clock.StartOf(static_cast<size_t>(time_step)) : 0;
}

void DepthTR::setPlaying(bool playing) {
  if (playing == playing_) return;
  playing_ = playing;
  played_from_s_.reset();
  // Update visitors pass by nodes that nothing below of asks for them.
  const unsigned asking = getNumChildrenRequiringUpdateTraversal();
  setNumChildrenRequiringUpdateTraversal(playing ? asking + 1 : asking - 1);
}

void DepthTR::PlayAt(double simulation_time_s) {
  const DrawSettings shown = drawable_->state_->Get();
  if (!shown.set) return;
  const dtr::FrameClock& clock = shown.set->clock;
  if (!played_from_s_) played_from_s_ = simulation_time_s - clock.StartOf(shown.time_step);
  const size_t time_step = clock.FrameAt(simulation_time_s - *played_from_s_);
  if (time_step != shown.time_step) ShowTimeStep(time_step);
}

void DepthTR::traverse(osg::NodeVisitor& visitor) {
  if (playing_ && visitor.getVisitorType() == osg::NodeVisitor::UPDATE_VISITOR &&
      visitor.getFrameStamp() != nullptr) {
    PlayAt(visitor.getFrameStamp()->getSimulationTime());
  }
  osg::Geode::traverse(visitor);
}

void DepthTR::setRenderOptions(const dtr::RenderOptions& options) {
  dtr::CheckRenderOptions(options);
  drawable_->state_->Set([&](DrawSettings& settings) { settings.options = options; });
}
dtr::RenderOptions DepthTR::getRenderOptions() const { return drawable_->state_->Get().options; }

void DepthTR::setDrawPath(DrawPath path) {
  drawable_->state_->Set([&](DrawSettings& settings) { settings.path = path; });
}
DrawPath DepthTR::getDrawPath() const { return drawable_->state_->Get().path; }

void DepthTR::setFillTime(FillTime time) {
  drawable_->state_->Set([&](DrawSettings& settings) { settings.fill_time = time; });
}
FillTime DepthTR::getFillTime() const { return drawable_->state_->Get().fill_time; }

void DepthTR::setMode(Mode mode) {
  drawable_->state_->Set([&](DrawSettings& settings) {
    settings.options.method = dtr::RenderMethod::kTwoPass;
    settings.options.primitive = mode == SPLATTING ? dtr::Primitive::kSplat : dtr::Primitive::kMesh;
  });
}

InputView& DepthTR::At(int vn) {
  if (vn < 0 || vn >= numberOfInputViews()) {
    throw dtr::UsageError("DepthTR: expected an input view from 0 to " +
                          std::to_string(numberOfInputViews() - 1) + ", found " +
                          std::to_string(vn));
  }
  return input_views_[static_cast<size_t>(vn)];
}
const InputView& DepthTR::At(int vn) const { return const_cast<DepthTR*>(this)->At(vn); }

osg::Matrixd DepthTR::getInputViewMatrix(int vn) const {
  return ViewMatrixOf(At(vn).view().cam_from_world);
}

int DepthTR::openingView() const {
  if (input_views_.empty()) return -1;
  std::vector<const dtr::View*> views;
  for (const InputView& input : input_views_) views.push_back(&input.view());
  return static_cast<int>(dtr::OpeningView(views, getScene()->scene.center));
}

int DepthTR::nextView(int step) {
  const int count = numberOfInputViews();
  if (count == 0) return -1;
  if (current_view_ < 0 && step < 0) current_view_ = 0;  // backwards from the first is the last
  current_view_ = ((current_view_ + step) % count + count) % count;
  return current_view_;
}

void DepthTR::setNovelView(const double model[3][4], const double calib[3][3], int width,
                           int height) {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) rotation(row, column) = model[row][column];
    translation[row] = model[row][3];
  }
  const Eigen::Matrix3d error = rotation * rotation.transpose() - Eigen::Matrix3d::Identity();
  if (!(error.cwiseAbs().maxCoeff() < kRotationError) || !(rotation.determinant() > 0)) {
    throw dtr::UsageError("DepthTR::setNovelView: model: expected a rotation, found none");
  }
  if (calib[0][1] != 0 || calib[1][0] != 0 || calib[2][0] != 0 || calib[2][1] != 0 ||
      calib[2][2] != 1) {
    throw dtr::UsageError(
        "DepthTR::setNovelView: calib: expected K = (fx 0 cx; 0 fy cy; 0 0 1), found another");
  }
  try {
    setNovelView(
        dtr::PinholeCamera(width, height, calib[0][0], calib[1][1], calib[0][2], calib[1][2]),
        dtr::Pose{Eigen::Quaterniond(rotation).normalized(), translation});
  } catch (const std::invalid_argument& error_of_camera) {
    throw dtr::UsageError(std::string("DepthTR::setNovelView: ") + error_of_camera.what());
  }
}

void DepthTR::setNovelView(const osg::Matrixd& modelview, const osg::Matrixd& projection, int width,
                           int height) {
  const NovelCamera novel = NovelCameraOf(modelview, projection, width, height);
  setNovelView(novel.camera, novel.cam_from_local);
}

void DepthTR::setNovelView(const dtr::PinholeCamera& novel, const dtr::Pose& novel_from_world) {
  novel_ = NovelView{novel, novel_from_world, {}};
  for (InputView& view : input_views_) view.valid = false, view.angle = 0, view.weight = 0;
  const auto scene = getScene();
  if (!scene) return;
  dtr::RenderOptions all = getRenderOptions();
  all.views = std::max(1, numberOfInputViews());
  const dtr::ViewSelection selection = dtr::SelectViews(scene->scene, novel_from_world, all);
  for (size_t i = 0; i < selection.views.size(); ++i) {
    InputView& view = input_views_[static_cast<size_t>(selection.views[i])];
    view.valid = true;
    view.angle = selection.angles_rad[i];
  }
}

DepthTR::NovelView& DepthTR::RequireNovelView() {
  if (!novel_) throw std::logic_error("DepthTR: setNovelView comes first");
  return *novel_;
}

osg::ref_ptr<osg::Image> DepthTR::getNovelView(dtr::BlendWeight blendType, int reqNumber) {
  NovelView& novel = RequireNovelView();
  const auto scene = getScene();
  if (!scene) throw std::logic_error("DepthTR: load comes first");
  dtr::RenderOptions options = getRenderOptions();
  options.blend = blendType;
  options.views = reqNumber;
  novel.result = dtr::cpu::Render(scene->scene, novel.camera, novel.cam_from_world, options);
  std::vector<double> angles, weights;
  std::vector<bool> flags;
  for (const InputView& view : input_views_) {
    angles.push_back(view.angle);
    flags.push_back(view.valid);
  }
  computeWeights(reqNumber, blendType, angles, weights, flags);
  for (size_t i = 0; i < weights.size(); ++i) input_views_[i].weight = weights[i];
  return ToOsgImage(*novel.result, options.fill_holes);
}

const dtr::RenderResult& DepthTR::getNovelResult() const {
  if (!novel_ || !novel_->result) throw std::logic_error("DepthTR: getNovelView comes first");
  return *novel_->result;
}

void DepthTR::projectView(int vn, Mode type, int resolution, float pointSize) {
  const NovelView& novel = RequireNovelView();
  dtr::RenderOptions options = getRenderOptions();
  options.primitive = type == SPLATTING ? dtr::Primitive::kSplat : dtr::Primitive::kMesh;
  options.resolution = resolution;
  options.point_size = static_cast<double>(pointSize);
  At(vn).projectView(novel.camera, novel.cam_from_world, options);
}

const ProjectedView& DepthTR::getProjectedDT(int vn) const {
  const ProjectedView& projected = At(vn).projected();
  if (projected.empty()) throw std::logic_error("DepthTR: projectView comes first");
  return projected;
}

void DepthTR::saveProjectedImage(int vn, const std::string& file) const {
  const ProjectedView& projected = getProjectedDT(vn);
  dtr::Mask seen = projected.holes;
  for (std::uint8_t& value : seen.data()) value = value == 0 ? 255 : 0;
  dtr::io::WriteImageWithAlpha(file, projected.projectedImage, seen, dtr::io::Mark::kRendered);
}

}  // namespace osgDTR
