// The exported page of one file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/cpu/renderer.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "dtr/render/opening_view.h"
#include "dtr/types/inverse_depth_code.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/web_page_bytes.h"
#include "tests/viewer/web/in_browser.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Of the image's pixels: a dark pixel of a photo may be black.
constexpr double kBlackShare = 0.001;
// Single precision, 8-bit targets and another JPEG decoder; away from depth edges.
constexpr int kStepsOf255 = 2;
constexpr double kAgreeing = 0.99;

class WebPage : public InChromium {
 protected:
  void SetUp() override {
    InChromium::SetUp();
    if (IsSkipped()) return;
    DtrOk({"export", (folder_ / "set.dtr").string(), "--format", "web", "-o", Page().string()});
  }
  fs::path Page() const { return folder_ / "page.html"; }
  nlohmann::json Driven(const std::string& camera = "") const {
    std::vector<std::string> words = {DTR_DRIVE_PAGE, Page().string(), kChromium};
    if (!camera.empty()) words.push_back(camera);
    return Found(words);
  }
  // Puts `by` over the page's bytes from `at` behind the mark on.
  void Damage(const std::string& mark, size_t at, const std::string& by) const {
    std::string page = Text(Page());
    const size_t from = page.find(mark);
    ASSERT_NE(from, std::string::npos);
    page.replace(from + mark.size() + at, by.size(), by);
    WriteFileAtomically(Page(), page);
  }
};

TEST_F(WebPage, ShowsTheSceneAndDoesWhatMouseKeysAndFingersAsk) {
  const nlohmann::json found = Driven();
  EXPECT_THAT(found["messages"], IsEmpty()) << found;
  EXPECT_EQ(found["problem"], "");
  EXPECT_GT(found["loaded"], 2);
  EXPECT_LT(found["black"], kBlackShare);
  for (const char* what : {"orbits", "dollies", "flies", "oneFinger", "twoFingers"}) {
    EXPECT_EQ(found[what], true) << what;
  }
  const DtrSet set = io::ReadSet(folder_ / "set.dtr");
  std::vector<const View*> views;
  for (const View& view : set.frames[0].views) {
    if (view.role == ViewRole::kSource) views.push_back(&view);
  }
  std::sort(views.begin(), views.end(), [](const View* a, const View* b) { return a->id < b->id; });
  EXPECT_EQ(found["photoAtStart"], OpeningView(views, set.scene_center));
  EXPECT_EQ(found["span"], CameraSpan(views, set.scene_center));
  EXPECT_THAT(found["photo"].get<std::string>(), HasSubstr(found["next"].get<std::string>()));
  EXPECT_THAT(found["outside"], IsEmpty()) << "buttons on a phone: " << found["outside"];
  EXPECT_EQ(found["compares"], "true");
  EXPECT_THAT(found["distance"].get<std::string>(), EndsWith(" m"));  // the set is metric
}

// The set as its page holds it: photos as JPEG, depth in steps.
DtrSet AsPageHolds(const fs::path& folder, const std::string& page, DtrSet set) {
  const auto json = nlohmann::json::parse(Between(page, "id=\"set\">", "</script>"));
  size_t index = 0;
  for (View& view : set.frames.front().views) {
    if (view.role != ViewRole::kSource) continue;
    const auto& described = json["views"][index];
    const std::string bytes =
        BytesOfText(Between(page, "id=\"view-" + std::to_string(index++) + "\">", "</script>"),
                    described["bytes"]);
    const size_t image = described["parts"]["image"], places = described["parts"]["depth_places"],
                 depth = described["parts"]["depth"];
    WriteFileAtomically(folder / "photo.jpg", bytes.substr(0, image));
    view.image = io::ReadImage(folder / "photo.jpg");
    const Grid<std::uint16_t> codes =
        DecodedMap(bytes.substr(image, places), bytes.substr(image + places, depth),
                   view.depth.width(), view.depth.height());
    const auto& range = described["depth"];
    const InverseDepthCode code(range["near_z"], range["far_z"], range["steps"]);
    for (int y = 0; y < codes.height(); ++y) {
      for (int x = 0; x < codes.width(); ++x) view.depth(x, y) = code.Decode(codes(x, y));
    }
    view.mesh.reset();  // of the depth before
  }
  return set;
}

// No depth within two pixels is more than a twentieth away.
bool IsAwayFromEdges(const DepthImage& depth, int x, int y) {
  float low = 1e30f, high = 0;
  for (int v = std::max(y - 2, 0); v <= std::min(y + 2, depth.height() - 1); ++v) {
    for (int u = std::max(x - 2, 0); u <= std::min(x + 2, depth.width() - 1); ++u) {
      low = std::min(low, depth(u, v));
      high = std::max(high, depth(u, v));
    }
  }
  return low > 0 && high <= 1.05f * low;
}

TEST_F(WebPage, DrawsWhatTheReferenceRendererDraws) {
  const DtrSet set = AsPageHolds(folder_.path(), Text(Page()), io::LoadSet(folder_ / "set.dtr"));
  const std::vector<View>& views = set.frames.front().views;
  const auto source = std::find_if(views.begin(), views.end(),
                                   [](const View& view) { return view.role == ViewRole::kSource; });
  // Beside an input camera, turned a little.
  Pose novel_from_world = source->cam_from_world;
  novel_from_world.translation += Eigen::Vector3d(0.05, -0.02, 0.1);
  novel_from_world.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.03, Eigen::Vector3d::UnitY())) *
      novel_from_world.rotation;
  const PinholeCamera& camera = source->camera;
  const RenderResult expected =
      cpu::Render(MakeRenderScene(set), camera, novel_from_world, WholeFrames());

  const Eigen::Quaterniond& q = novel_from_world.rotation;
  const Eigen::Vector3d& t = novel_from_world.translation;
  const nlohmann::json novel = {{"width", camera.width_px()},
                                {"height", camera.height_px()},
                                {"fx", camera.fx_px()},
                                {"fy", camera.fy_px()},
                                {"cx", camera.cx_px()},
                                {"cy", camera.cy_px()},
                                {"rotation", {q.w(), q.x(), q.y(), q.z()}},
                                {"translation", {t.x(), t.y(), t.z()}}};
  WriteFileAtomically(folder_ / "camera.json", novel.dump());
  EXPECT_THAT(Driven((folder_ / "camera.json").string())["messages"], IsEmpty());
  const std::string pixels = Text(folder_ / "camera.rgba");
  ASSERT_EQ(pixels.size(), 4u * expected.coverage.data().size());
  int away = 0, within = 0;
  for (int y = 0; y < camera.height_px(); ++y) {
    for (int x = 0; x < camera.width_px(); ++x) {
      if (!IsAwayFromEdges(expected.depth, x, y)) continue;
      const size_t at = 4 * static_cast<size_t>(y * camera.width_px() + x);
      int worst = 0;
      for (int c = 0; c < 3; ++c) {
        const int drawn = static_cast<unsigned char>(pixels[at + static_cast<size_t>(c)]);
        worst = std::max(worst, std::abs(drawn - expected.image(x, y, c)));
      }
      ++away;
      if (worst <= kStepsOf255) ++within;
    }
  }
  EXPECT_GT(away, 6000);  // of 24576: the courtyard has many edges
  EXPECT_GT(within, kAgreeing * away) << within << " of " << away;
}

// Without a GPU a frame takes as long as many views take to decode.
TEST_F(WebPage, DrawsSeldomWhileViewsArriveAndAtTheEndFromAllThatItNeeds) {
  const nlohmann::json found = Found({DTR_DRIVE_LOADING, Page().string(), kChromium});
  EXPECT_THAT(found["messages"], IsEmpty()) << found;
  EXPECT_GT(found["loaded"], 4);
  EXPECT_GE(found["images"], 1);
  EXPECT_LE(2 * found["images"].get<int>(), found["loaded"].get<int>())
      << "one for each without pace";
  EXPECT_EQ(found["drawn"], found["wanted"]);
}

TEST_F(WebPage, ShowsEachEyeOfAHeadsetFromWhereItIs) {
  const nlohmann::json found = Found({DTR_DRIVE_HEADSET, Page().string(), kChromium});
  EXPECT_THAT(found["messages"], IsEmpty()) << found;
  EXPECT_EQ(found["offered"], true);
  EXPECT_EQ(found["worst"], 0);  // the same image, copied
  EXPECT_GT(found["bright"], 0.5);
  EXPECT_NEAR(found["apart"].get<double>(), 0.064, 1e-6);  // metres
  EXPECT_EQ(found["right"], true);
  EXPECT_GT(found["differing"], 0.02);
  EXPECT_EQ(found["back"], true);
}

TEST_F(WebPage, OneDamagedPhotoIsNamedAndTheOthersAreShown) {
  Damage("id=\"view-1\">", 400, "AAAA");
  const nlohmann::json found = Driven();
  EXPECT_THAT(found["problem"].get<std::string>(), HasSubstr("expected bytes of its checksum"));
  EXPECT_GT(found["loaded"], 1);
}

TEST_F(WebPage, APageThatIsCutShortSaysSo) {
  std::string page = Text(Page());
  page.resize(page.find("id=\"view-0\">") + 1000);
  WriteFileAtomically(Page(), page);
  EXPECT_THAT(Driven()["problem"].get<std::string>(), HasSubstr("cut short"));
}

TEST_F(WebPage, AViewThatIsCutShortIsNamedAndTheOthersAreShown) {
  std::string page = Text(Page());
  const size_t from = page.find("id=\"view-2\">") + 12;
  page.erase(from, (page.find("</script>", from) - from) / 2);
  WriteFileAtomically(Page(), page);
  const nlohmann::json found = Driven();
  EXPECT_THAT(found["problem"].get<std::string>(), HasSubstr(" bytes, found "));
  EXPECT_GT(found["loaded"], 1);
}

// Bytes and checksum are whole, the map within is not: its parts begin elsewhere.
TEST_F(WebPage, AMapOfOtherBytesIsRejected) {
  const std::string page = Text(Page());
  const auto parts =
      nlohmann::json::parse(Between(page, "id=\"set\">", "</script>"))["views"][0]["parts"];
  const std::string places = parts["depth_places"].dump(), depth = parts["depth"].dump();
  const auto changed = [](const nlohmann::json& size, int by) {
    return std::to_string(size.get<int>() + by);
  };
  std::string moved = page;
  const std::string stands = "\"depth_places\":" + places + ",\"depth\":" + depth;
  moved.replace(moved.find(stands), stands.size(),
                "\"depth_places\":" + changed(parts["depth_places"], 40) +
                    ",\"depth\":" + changed(parts["depth"], -40));
  WriteFileAtomically(Page(), moved);
  const nlohmann::json found = Driven();
  EXPECT_THAT(found["problem"].get<std::string>(), HasSubstr("depth"));
  EXPECT_GT(found["loaded"], 1);
}

TEST_F(WebPage, SizesThatAreNoneAreRejectedBeforeAnythingIsAllocated) {
  Damage("\"width\":", 0, "-9");
  const nlohmann::json found = Driven();
  EXPECT_THAT(found["problem"].get<std::string>(), HasSubstr("expected"));
}

}  // namespace
}  // namespace dtr::testing
