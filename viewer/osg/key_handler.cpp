#include "viewer/osg/key_handler.h"

#include <osg/Notify>
#include <osg/UserDataContainer>
#include <osgGA/CameraManipulator>
#include <osgViewer/View>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace osgDTR {
namespace {

using dtr::BlendWeight;
using dtr::RenderOptions;

/// The camera at an input view, in the world's coordinates: rigid, however the node is scaled.
struct Eye {
  osg::Vec3d position, target, up;
};

Eye EyeOf(const DepthTR& node, int vn) {
  const osg::MatrixList to_world = node.getWorldMatrices();
  const osg::Matrixd world_from_local = to_world.empty() ? osg::Matrixd() : to_world.front();
  const osg::Matrixd local_from_eye = osg::Matrixd::inverse(node.getInputViewMatrix(vn));
  const osg::Vec3d position = osg::Vec3d(0, 0, 0) * local_from_eye;
  const osg::Vec3d forward = osg::Matrixd::transform3x3(osg::Vec3d(0, 0, -1), local_from_eye);
  const osg::Vec3d up = osg::Matrixd::transform3x3(osg::Vec3d(0, 1, 0), local_from_eye);
  // Manipulators turn about the target: as far away as the scene's centre.
  const Eigen::Vector3d center = node.getScene()->scene.center;
  const double distance = (osg::Vec3d(center.x(), center.y(), center.z()) - position).length();
  Eye eye;
  eye.position = position * world_from_local;
  eye.target = (position + forward * std::max(distance, 1e-6)) * world_from_local;
  eye.up = osg::Matrixd::transform3x3(up, world_from_local);
  eye.up.normalize();
  return eye;
}

const char* Next(BlendWeight& blend) {
  static constexpr const char* kNames[] = {"cosine", "exponential", "angle", "inverse-angle",
                                           "k-nearest"};
  blend = static_cast<BlendWeight>((static_cast<int>(blend) + 1) % 5);
  return kNames[static_cast<int>(blend)];
}

/// Deferred, two passes with meshes, two passes with splats.
const char* NextMethod(RenderOptions& options) {
  if (options.method == dtr::RenderMethod::kDeferred) {
    options.method = dtr::RenderMethod::kTwoPass;
    options.primitive = dtr::Primitive::kMesh;
    return "two passes, meshes";
  }
  if (options.primitive == dtr::Primitive::kMesh) {
    options.primitive = dtr::Primitive::kSplat;
    return "two passes, splats";
  }
  options.method = dtr::RenderMethod::kDeferred;
  options.primitive = dtr::Primitive::kMesh;
  return "deferred";
}

/// None, when still, every image.
const char* NextFilling(DepthTR& node, RenderOptions& options) {
  if (!options.fill_holes) {
    options.fill_holes = true;
    node.setFillTime(FillTime::kWhenStill);
    return "when still";
  }
  if (node.getFillTime() == FillTime::kWhenStill) {
    node.setFillTime(FillTime::kAlways);
    return "every image";
  }
  options.fill_holes = false;
  return "off";
}

constexpr int kCoarsestResolution = 4;

/// The keys of dynamic sets; false for others, and for sets that stand still.
bool HandleTime(int key, DepthTR& node) {
  const int count = node.numberOfTimeSteps();
  if (count < 2) return false;
  switch (key) {
    case ',':
    case '.':
      node.setPlaying(false);
      node.setTimeStep((node.getTimeStep() + (key == '.' ? 1 : count - 1)) % count);
      OSG_NOTICE << "D+TR time step: " << node.getTimeStep() << " of " << count << ", "
                 << node.getTimeStepTime(node.getTimeStep()) << " s" << std::endl;
      return true;
    case 'j':
      node.setPlaying(!node.isPlaying());
      OSG_NOTICE << "D+TR: " << (node.isPlaying() ? "playing" : "still") << std::endl;
      return true;
    default:
      return false;
  }
}

}  // namespace

/// The handlers of one window, in the order in which they met it.
class KeyHandler::Fellows : public osg::Object {
 public:
  Fellows() = default;
  Fellows(const Fellows& other, const osg::CopyOp& copyop) : osg::Object(other, copyop) {}
  META_Object(osgDTR, Fellows)

      void Join(KeyHandler* handler) {
    std::erase_if(all_, [](const auto& one) { return !one.valid(); });
    if (std::find(all_.begin(), all_.end(), handler) == all_.end()) all_.emplace_back(handler);
  }
  /// True for the first of those that are there together: several home positions would be that of
  /// the last.
  bool TakeStart(KeyHandler* handler) {
    if (started_by_.valid()) return false;
    started_by_ = handler;
    return true;
  }

  /// One handler of each node: two of one node would undo each other's keys.
  template <typename Do>
  void ForEachNode(const Do& what) const {
    std::vector<osg::ref_ptr<DepthTR>> met;
    for (const auto& one : all_) {
      osg::ref_ptr<KeyHandler> handler;
      osg::ref_ptr<DepthTR> node;
      if (!one.lock(handler) || !handler->node_.lock(node)) continue;
      if (std::find(met.begin(), met.end(), node) != met.end()) continue;
      met.push_back(node);
      what(*handler, *node);
    }
  }

  /// The handler whose node has the next input view after this step; it is the node's current one.
  KeyHandler* Step(int step) {
    std::vector<KeyHandler*> with_views;
    ForEachNode([&](KeyHandler& handler, DepthTR& node) {
      if (node.numberOfInputViews() > 0) with_views.push_back(&handler);
    });
    if (with_views.empty()) return nullptr;
    const size_t count = with_views.size();
    if (at_ >= count) at_ = 0;
    const osg::ref_ptr<DepthTR> node = with_views[at_]->node_.get();
    const int before = node->currentView(), now = node->nextView(step);
    const bool round = before >= 0 && (step > 0 ? now <= before : now >= before);
    if (!round || count == 1) return with_views[at_];
    node->nextView(-step);  // stays at its end
    at_ = (at_ + (step > 0 ? 1 : count - 1)) % count;
    const osg::ref_ptr<DepthTR> other = with_views[at_]->node_.get();
    const int end = step > 0 ? 0 : other->numberOfInputViews() - 1;
    other->nextView(end - other->currentView());
    return with_views[at_];
  }

 private:
  std::vector<osg::observer_ptr<KeyHandler>> all_;
  size_t at_ = 0;
  osg::observer_ptr<KeyHandler> started_by_;
};

osg::ref_ptr<KeyHandler::Fellows> KeyHandler::FellowsOf(osgGA::GUIActionAdapter& viewer) {
  osg::View* const view = viewer.asView();
  if (view == nullptr) return new Fellows;  // alone
  osg::UserDataContainer& data = *view->getOrCreateUserDataContainer();
  for (unsigned i = 0; i < data.getNumUserObjects(); ++i) {
    if (auto* const known = dynamic_cast<Fellows*>(data.getUserObject(i))) return known;
  }
  osg::ref_ptr<Fellows> fellows = new Fellows;
  data.addUserObject(fellows);
  return fellows;
}

KeyHandler::KeyHandler(DepthTR* node, bool starts_at_input)
    : node_(node), starts_at_input_(starts_at_input) {}

void KeyHandler::GoTo(int vn, const osgGA::GUIEventAdapter& event,
                      osgGA::GUIActionAdapter& viewer) const {
  osg::ref_ptr<DepthTR> node;
  if (vn < 0 || !node_.lock(node)) return;
  const Eye eye = EyeOf(*node, vn);
  osg::View* const view = viewer.asView();
  if (auto* const with_manipulator = dynamic_cast<osgViewer::View*>(view);
      with_manipulator != nullptr && with_manipulator->getCameraManipulator() != nullptr) {
    osgGA::CameraManipulator& manipulator = *with_manipulator->getCameraManipulator();
    manipulator.setAutoComputeHomePosition(false);
    manipulator.setHomePosition(eye.position, eye.target, eye.up);
    manipulator.home(event, viewer);
  } else if (view != nullptr) {
    view->getCamera()->setViewMatrixAsLookAt(eye.position, eye.target, eye.up);
  }
  viewer.requestRedraw();
}

bool KeyHandler::handle(const osgGA::GUIEventAdapter& event, osgGA::GUIActionAdapter& viewer) {
  osg::ref_ptr<DepthTR> node;
  if (!node_.lock(node) || !node->isLoaded()) return false;
  const auto type = event.getEventType();
  if (type != osgGA::GUIEventAdapter::FRAME && type != osgGA::GUIEventAdapter::KEYDOWN)
    return false;
  const osg::ref_ptr<Fellows> fellows = FellowsOf(viewer);
  fellows->Join(this);
  if (type == osgGA::GUIEventAdapter::FRAME) {
    if (std::exchange(starts_at_input_, false) && fellows->TakeStart(this)) {
      GoTo(node->nextView(node->openingView() - node->currentView()), event, viewer);
    }
    return false;
  }
  if (event.getHandled()) return false;
  const int key = event.getKey();
  if (key == 'n' || key == 'N') {
    KeyHandler* const goes = fellows->Step(key == 'n' ? 1 : -1);
    if (goes == nullptr) return false;
    const osg::ref_ptr<DepthTR> its_node = goes->node_.get();
    goes->GoTo(its_node->currentView(), event, viewer);
    return true;
  }
  bool handled = false;
  fellows->ForEachNode([&](KeyHandler& handler, DepthTR&) { handled |= handler.Act(key); });
  if (handled) viewer.requestRedraw();
  return handled;
}

bool KeyHandler::Act(int key) {
  osg::ref_ptr<DepthTR> node;
  if (!node_.lock(node) || !node->isLoaded()) return false;
  RenderOptions options = node->getRenderOptions();
  switch (key) {
    case 'v':
      OSG_NOTICE << "D+TR blend weight: " << Next(options.blend) << std::endl;
      break;
    case 'k':
      OSG_NOTICE << "D+TR method: " << NextMethod(options) << std::endl;
      break;
    case 'r':
      options.resolution = options.resolution >= kCoarsestResolution ? 1 : 2 * options.resolution;
      OSG_NOTICE << "D+TR resolution: " << options.resolution << std::endl;
      break;
    case '[':
    case ']':
      options.views = std::clamp(options.views + (key == ']' ? 1 : -1), 1,
                                 std::max(1, node->numberOfInputViews()));
      OSG_NOTICE << "D+TR views: " << options.views << std::endl;
      break;
    case 'u':
      OSG_NOTICE << "D+TR hole filling: " << NextFilling(*node, options) << std::endl;
      break;
    case 'x': {
      const bool gpu = node->getDrawPath() == DrawPath::kReadBack;
      node->setDrawPath(gpu ? DrawPath::kGpu : DrawPath::kReadBack);
      OSG_NOTICE << "D+TR path: " << (gpu ? "GPU" : "read back, two passes") << std::endl;
      return true;
    }
    default:
      return HandleTime(key, *node);
  }
  node->setRenderOptions(options);
  return true;
}

void KeyHandler::getUsage(osg::ApplicationUsage& usage) const {
  usage.addKeyboardMouseBinding("D+TR: n, N", "Go to the next, the previous input camera");
  usage.addKeyboardMouseBinding("D+TR: v", "Next blend weight");
  usage.addKeyboardMouseBinding("D+TR: k", "Deferred, two passes with meshes, with splats");
  usage.addKeyboardMouseBinding("D+TR: r", "Every pixel, 2nd, 4th pixel of the depth maps");
  usage.addKeyboardMouseBinding("D+TR: [, ]", "One view less, one more");
  usage.addKeyboardMouseBinding("D+TR: u",
                                "Fill what no view saw: when still, in every image, not");
  usage.addKeyboardMouseBinding("D+TR: comma, full stop",
                                "Previous, next time step of a dynamic set");
  usage.addKeyboardMouseBinding("D+TR: j", "Play a dynamic set, stop");
  usage.addKeyboardMouseBinding("D+TR: x", "Read back and blend on the processor, on and off");
}

}  // namespace osgDTR
