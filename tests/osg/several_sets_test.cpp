// Several sets in one window share its keys.
#include "tests/gl/gl_testing.h"
// clang-format keeps this group apart.
#include <osgGA/GUIEventAdapter>
#include <osgViewer/Viewer>

#include "tests/osg/osg_testing.h"
#include "viewer/osg/depth_tr.h"
#include "viewer/osg/key_handler.h"

namespace dtr::testing {
namespace {

using osgDTR::DepthTR;
using osgDTR::KeyHandler;

/// Two nodes of five views each with a handler each, as `osgviewer a.dtr b.dtr` has them.
class SeveralSets : public ::testing::Test {
 protected:
  void SetUp() override {
    for (size_t i = 0; i < 2; ++i) {
      nodes_[i] = new DepthTR;
      nodes_[i]->setScene(SquareBeforePlane());
      handlers_[i] = new KeyHandler(nodes_[i].get(), true);
    }
    Tell(osgGA::GUIEventAdapter::FRAME, 0);
  }
  /// As OpenSceneGraph hands an event round.
  bool Tell(osgGA::GUIEventAdapter::EventType type, int key) {
    const osg::ref_ptr<osgGA::GUIEventAdapter> event = new osgGA::GUIEventAdapter;
    event->setEventType(type);
    event->setKey(key);
    for (const auto& handler : handlers_) {
      if (handler->handle(*event, *view_)) event->setHandled(true);
    }
    return event->getHandled();
  }
  bool Press(int key) { return Tell(osgGA::GUIEventAdapter::KEYDOWN, key); }
  int Current(size_t node) const { return nodes_[node]->currentView(); }

  osg::ref_ptr<osgViewer::View> view_ = new osgViewer::View;
  osg::ref_ptr<DepthTR> nodes_[2];
  osg::ref_ptr<KeyHandler> handlers_[2];
};

TEST_F(SeveralSets, OptionsChangeForAllOfThemOnce) {
  EXPECT_TRUE(Press('r'));
  EXPECT_TRUE(Press('k'));
  EXPECT_TRUE(Press('['));
  for (const auto& node : nodes_) {
    EXPECT_EQ(node->getRenderOptions().resolution, 2);
    EXPECT_EQ(node->getRenderOptions().method, RenderMethod::kTwoPass);
    EXPECT_EQ(node->getRenderOptions().views, 5);
  }
  EXPECT_FALSE(Press('p'));
}

TEST_F(SeveralSets, InputCamerasAreGoneThroughOneSetAfterTheOther) {
  ASSERT_EQ(nodes_[0]->numberOfInputViews(), 5);
  EXPECT_EQ(Current(0), nodes_[0]->openingView()) << "the window starts in the first set's middle";
  EXPECT_EQ(Current(1), -1);
  nodes_[0]->nextView(-Current(0));
  std::vector<std::pair<int, int>> visited;
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(Press('n'));
    visited.emplace_back(Current(0), Current(1));
  }
  const std::vector<std::pair<int, int>> expected{{1, -1}, {2, -1}, {3, -1}, {4, -1}, {4, 0},
                                                  {4, 1},  {4, 2},  {4, 3},  {4, 4},  {0, 4}};
  EXPECT_EQ(visited, expected);
  EXPECT_TRUE(Press('N'));
  EXPECT_EQ(visited.back(), std::pair(0, 4));
  EXPECT_EQ(std::pair(Current(0), Current(1)), std::pair(0, 4)) << "back to the second set's last";
  EXPECT_TRUE(Press('N'));
  EXPECT_EQ(Current(1), 3);
}

TEST_F(SeveralSets, ASetThatIsGoneTakesItsPartAway) {
  nodes_[1] = nullptr;
  handlers_[1] = new KeyHandler(nodes_[0].get());
  EXPECT_TRUE(Press('r'));
  EXPECT_EQ(nodes_[0]->getRenderOptions().resolution, 2) << "two handlers of a node act once";
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(Press('n'));
  EXPECT_EQ(Current(0), nodes_[0]->openingView());
}

}  // namespace
}  // namespace dtr::testing
