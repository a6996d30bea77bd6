// The program osgviewer with the plugin, as its users start it.
#include "tests/gl/gl_testing.h"
#include "tests/simd/exact_scenes.h"
// clang-format keeps this group apart.
#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <osg/ShapeDrawable>
#include <osgDB/WriteFile>

#include <nlohmann/json.hpp>
#include <thread>

#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "dtr/render/opening_view.h"
#include "tests/osg/osg_testing.h"
#include "tests/support/environment.h"
#include "tests/support/test_data.h"
#include "tests/support/x_screen.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 480, kHeight = 320;

/// osgviewer with a window at the screen's corner, ended with the scope.
class OsgViewerProgram {
 public:
  explicit OsgViewerProgram(const std::vector<std::string>& files) {
    std::vector<std::string> words{
        "osgviewer", "--window", "0", "0", std::to_string(kWidth), std::to_string(kHeight)};
    words.insert(words.end(), files.begin(), files.end());
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    program_ = fork();
    if (program_ != 0) return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    setenv("OSG_LIBRARY_PATH", DTR_OSG_PLUGINS, 1);
    execvp("osgviewer", arguments.data());
    _exit(127);
  }
  ~OsgViewerProgram() {
    kill(program_, SIGKILL);
    waitpid(program_, nullptr, 0);
  }
  OsgViewerProgram(const OsgViewerProgram&) = delete;
  OsgViewerProgram& operator=(const OsgViewerProgram&) = delete;
  bool Running() const { return waitpid(program_, nullptr, WNOHANG) == 0; }

 private:
  pid_t program_ = -1;
};

bool HasOsgViewer() { return std::system("command -v osgviewer >/dev/null") == 0; }

/// What the window shows, once `settled` says that it is there; nothing after a minute.
template <typename Settled>
std::optional<ImageRgb8> WaitFor(const OsgViewerProgram& program, const Settled& settled) {
  for (int i = 0; i < 300 && program.Running(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    ImageRgb8 image = ReadScreen(kWidth, kHeight);
    if (settled(image)) return image;
  }
  return std::nullopt;
}

void Keep(const std::string& name, const ImageRgb8& image) {
  if (const char* folder = std::getenv("DTR_TEST_PICTURES")) {
    io::WriteImage(std::string(folder) + "/" + name + ".png", image);
  }
}

/// What osgviewer should show from an input camera: its own lens, that camera's place.
RenderResult FromInputCamera(const DtrSet& set, const View& view,
                             const RenderOptions& options = {}) {
  const gl::EglContext context;
  gl::FittingRenderer renderer;
  // OpenSceneGraph's DisplaySettings: a screen 0.26 m high seen from 0.5 m.
  const double focal = kHeight * 0.5 / 0.26;
  return renderer.Render(MakeRenderScene(set),
                         {kWidth, kHeight, focal, focal, 0.5 * kWidth, 0.5 * kHeight},
                         view.cam_from_world, options);
}

double ShareOfEqual(const ImageRgb8& shown, const RenderResult& expected) {
  int equal = 0, seen = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (expected.coverage(x, y) == 0) continue;
      ++seen;
      equal += PixelDifference(shown, expected.image, x, y) <= 8;
    }
  }
  return static_cast<double>(equal) / seen;
}

// The manipulator turns poses into angles and back: some pixels fall into the one beside them.
constexpr double kEqualShare = 0.97;

int Red(const ImageRgb8& image) {
  int red = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      red += image(x, y, 0) > 200 && image(x, y, 1) < 20 && image(x, y, 2) < 20;
    }
  }
  return red;
}

class OsgViewerTest : public OsgTest {
 protected:
  void SetUp() override {
    OsgTest::SetUp();
    if (IsSkipped()) return;
    if (!HasOsgViewer()) GTEST_SKIP() << "osgviewer is missing (package openscenegraph)";
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "SKIPPED: osgviewer has no sanitizer and cannot load a plugin that has";
#endif
    NamedScene named = ExactScene("courtyard", 5, 240, 160);
    io::SetWriter writer(folder_ / "scene.dtr", "{}", false);
    for (View& view : named.set.frames[0].views) writer.WriteView(view, named.set.unit);
    writer.Finish(named.set);
    set_ = io::LoadSet(folder_ / "scene.dtr");
  }
  /// The view that viewers begin with, or `further` ones on.
  const View& Opening(size_t further = 0) const {
    std::vector<const View*> views;
    for (const View& view : set_.frames[0].views) views.push_back(&view);
    return *views[(OpeningView(views, set_.scene_center) + further) % views.size()];
  }
  TemporaryFolder folder_;
  DtrSet set_;
};

TEST_F(OsgViewerTest, ShowsASetFromItsMiddleCameraAndGoesOnToTheNext) {
  const RenderResult first = FromInputCamera(set_, Opening());
  const RenderResult second = FromInputCamera(set_, Opening(1));
  const OsgViewerProgram program({(folder_ / "scene.dtr").string()});
  const auto shown = WaitFor(
      program, [&](const ImageRgb8& image) { return ShareOfEqual(image, first) > kEqualShare; });
  Keep("osgviewer", ReadScreen(kWidth, kHeight));
  ASSERT_TRUE(shown) << ShareOfEqual(ReadScreen(kWidth, kHeight), first);
  ASSERT_LT(ShareOfEqual(*shown, second), 0.9);
  SendKey('n', kWidth / 2, kHeight / 2);
  EXPECT_TRUE(WaitFor(program, [&](const ImageRgb8& image) {
    return ShareOfEqual(image, second) > kEqualShare;
  })) << ShareOfEqual(ReadScreen(kWidth, kHeight), second);
  Keep("osgviewer next", ReadScreen(kWidth, kHeight));
}

// As shells complete the names of folders.
TEST_F(OsgViewerTest, ShowsASetWhoseNameEndsWithASlash) {
  const RenderResult first = FromInputCamera(set_, Opening());
  const OsgViewerProgram program({(folder_ / "scene.dtr").string() + "/"});
  EXPECT_TRUE(WaitFor(program, [&](const ImageRgb8& image) {
    return ShareOfEqual(image, first) > kEqualShare;
  })) << ShareOfEqual(ReadScreen(kWidth, kHeight), first);
}

TEST_F(OsgViewerTest, FindsASetOnItsPathAndDrawsItAsItWasPrunedFor) {
  const fs::path file = folder_ / "scene.dtr/set.json";
  nlohmann::json json = nlohmann::json::parse(ReadFile(file, 1 << 20));
  json["pruned"]["render"] = {{"method", "two-pass"}, {"resolution", 12}};
  WriteFileAtomically(file, json.dump());
  RenderOptions pruned;
  pruned.method = RenderMethod::kTwoPass;
  pruned.resolution = 12;
  const View& view = Opening();
  const RenderResult coarse = FromInputCamera(set_, view, pruned);
  ASSERT_LT(ShareOfEqual(FromInputCamera(set_, view).image, coarse), 0.9);
  const Environment path("OSG_FILE_PATH", folder_.path().string());
  const OsgViewerProgram program({"scene.dtr"});
  EXPECT_TRUE(WaitFor(program, [&](const ImageRgb8& image) {
    return ShareOfEqual(image, coarse) > kEqualShare;
  })) << ShareOfEqual(ReadScreen(kWidth, kHeight), coarse);
}

TEST_F(OsgViewerTest, ShowsASetAndAModel) {
  osg::ref_ptr<osg::ShapeDrawable> box =
      new osg::ShapeDrawable(new osg::Box(osg::Vec3(0, 1.0F, 1.2F), 1.0F));
  box->setColor({1, 0, 0, 1});
  osg::ref_ptr<osg::Geode> model = new osg::Geode;
  model->addDrawable(box);
  model->getOrCreateStateSet()->setMode(GL_LIGHTING, osg::StateAttribute::OFF);
  ASSERT_TRUE(osgDB::writeNodeFile(*model, (folder_ / "model.osgt").string()));
  const RenderResult alone = FromInputCamera(set_, Opening());
  const OsgViewerProgram program(
      {(folder_ / "scene.dtr").string(), (folder_ / "model.osgt").string()});
  const auto shown = WaitFor(program, [&](const ImageRgb8& image) {
    return Red(image) > 500 && ShareOfEqual(image, alone) > 0.7;
  });
  Keep("osgviewer with model", ReadScreen(kWidth, kHeight));
  EXPECT_TRUE(shown) << Red(ReadScreen(kWidth, kHeight)) << " red pixels";
}

}  // namespace
}  // namespace dtr::testing
