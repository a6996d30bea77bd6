// viewer/osg/key_handler.h -- the founding report's keys (its section 3.2.3).
#pragma once
#include <osg/observer_ptr>
#include <osgGA/GUIEventHandler>

#include "viewer/osg/depth_tr.h"

namespace osgDTR {

/// Keys for a DepthTR: n N next and previous input view, v blend weight, k method and primitive,
/// r resolution, [ ] number of views, u hole filling, x the report's read-back path; of dynamic
/// sets , . previous and next time step, j playing. Add it to a viewer's event handlers, or to a
/// node's event callbacks, as the osgDB plugin does. Handlers of one window share its keys: options
/// change for all their nodes, and n N go through the input views of one after those of the other.
class KeyHandler : public osgGA::GUIEventHandler {
 public:
  /// `starts_at_input`: home, which is where viewers start, becomes DepthTR::openingView().
  explicit KeyHandler(DepthTR* node, bool starts_at_input = false);

  using osgGA::GUIEventHandler::handle;
  bool handle(const osgGA::GUIEventAdapter& event, osgGA::GUIActionAdapter& viewer) override;
  void getUsage(osg::ApplicationUsage& usage) const override;

 private:
  class Fellows;
  static osg::ref_ptr<Fellows> FellowsOf(osgGA::GUIActionAdapter& viewer);
  /// What a key does to its own node; false for keys that do nothing to it.
  bool Act(int key);
  void GoTo(int vn, const osgGA::GUIEventAdapter& event, osgGA::GUIActionAdapter& viewer) const;

  const osg::observer_ptr<DepthTR> node_;
  bool starts_at_input_;
};

}  // namespace osgDTR
