// An image in a host's framebuffer, wherever it lies: what the host drew before stays where it is
// nearer, and where the image has nothing. Held to a sum in double precision, pixel by pixel.
#include "dtr/gl/compositor.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dtr/gl/driver.h"
#include "dtr/gl/objects.h"
#include "tests/gl/gl_testing.h"

namespace dtr::gl {
namespace {

using testing::NamedScene;
using testing::ParityScenes;

// Float32 near 1, and the 24 bits of the depth buffer, leave 1.1e-7; the worst found was 9.4e-8.
constexpr double kDepthApart = 2e-7;
// Pixels whose depth is that near to a plane or to what was there may fall to either side; none
// did.
constexpr int kUndecided = 3;
// Of the host's framebuffer: no pixel's centre lies between two of an image of 86x64.
constexpr int kWidth = 132, kHeight = 128;
constexpr float kBehind = 0.9F, kBefore = 0.05F;
constexpr std::array<std::uint8_t, 3> kHosts = {10, 200, 30};

/// What a host has set when it asks for an image.
struct HostState {
  const char* name;
  double near_z = 1, far_z = 100;
  double range[2] = {0, 1};
  bool zero_to_one = false, top_first = false, clamps = false;
  Viewport viewport{0, 0, kWidth, kHeight};
};

std::vector<HostState> States() {
  HostState plain{"plain"}, cut{"near and far cut"}, ranged{"depth range"};
  HostState reversed{"reversed depth range"}, clamped{"depth clamp"};
  HostState small{"part of the window"}, zero{"zero to one, top row first"};
  cut.near_z = 6, cut.far_z = 9;
  ranged.range[0] = 0.2, ranged.range[1] = 0.7;
  reversed.range[0] = 0.8, reversed.range[1] = 0.1;
  clamped.near_z = 6, clamped.far_z = 9, clamped.clamps = true;
  small.viewport = {13, 21, 86, 64};
  zero.zero_to_one = zero.top_first = true;
  std::vector<HostState> states{plain, cut, ranged, reversed, clamped, small};
  if (HasClipControl()) states.push_back(zero);
  return states;
}

DepthProjection ProjectionOf(const HostState& state) {
  const double n = state.near_z, f = state.far_z;
  if (state.zero_to_one) return {f / (f - n), -f * n / (f - n)};
  return {(f + n) / (f - n), -2 * f * n / (f - n)};
}

/// Colour and depth of a framebuffer, the bottom row first.
struct Shown {
  std::vector<std::uint8_t> rgba = std::vector<std::uint8_t>(4 * kWidth * kHeight);
  std::vector<float> depth = std::vector<float>(kWidth * kHeight);
};

/// A framebuffer whose right third the host has drawn something near in, the rest something far.
class Host {
 public:
  Host() {
    color_ = MakeBuffer(GL_RGBA8, GL_COLOR_ATTACHMENT0);
    depth_ = MakeBuffer(GL_DEPTH_COMPONENT24, GL_DEPTH_ATTACHMENT);
  }
  ~Host() {
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glDeleteRenderbuffers(1, &color_);
    glDeleteRenderbuffers(1, &depth_);
  }
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  static float DepthBefore(int x) { return x < 2 * kWidth / 3 ? kBehind : kBefore; }

  template <typename Draw>
  Shown With(const HostState& state, const Draw& draw) {
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
    glClearColor(kHosts[0] / 255.0F, kHosts[1] / 255.0F, kHosts[2] / 255.0F, 0.5F);
    glEnable(GL_SCISSOR_TEST);
    for (int x = 0; x < kWidth; ++x) {
      glScissor(x, 0, 1, kHeight);
      glClearDepthf(DepthBefore(x));
      glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    }
    glDisable(GL_SCISSOR_TEST);
    glEnable(GL_DEPTH_TEST);
    glDepthRange(state.range[0], state.range[1]);
    if (state.clamps) glEnable(GL_DEPTH_CLAMP);
    if (HasClipControl()) {
      glClipControl(state.top_first ? GL_UPPER_LEFT : GL_LOWER_LEFT,
                    state.zero_to_one ? GL_ZERO_TO_ONE : GL_NEGATIVE_ONE_TO_ONE);
    }
    const Viewport& v = state.viewport;
    glViewport(v.x, v.y, v.width, v.height);
    draw();
    if (HasClipControl()) glClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
    glDisable(GL_DEPTH_CLAMP);
    glDepthRange(0, 1);
    glDisable(GL_DEPTH_TEST);
    Shown shown;
    glReadPixels(0, 0, kWidth, kHeight, GL_RGBA, GL_UNSIGNED_BYTE, shown.rgba.data());
    glReadPixels(0, 0, kWidth, kHeight, GL_DEPTH_COMPONENT, GL_FLOAT, shown.depth.data());
    return shown;
  }

 private:
  GLuint MakeBuffer(GLenum format, GLenum attachment) {
    GLuint name = 0;
    glGenRenderbuffers(1, &name);
    glBindRenderbuffer(GL_RENDERBUFFER, name);
    glRenderbufferStorage(GL_RENDERBUFFER, format, kWidth, kHeight);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, name);
    return name;
  }
  Framebuffer framebuffer_ = Framebuffer::Make();
  GLuint color_ = 0, depth_ = 0;
};

/// Pixels of `shown` that are not what `image`, with `depth` in it, makes of the host's.
/// Filled pixels are where `image` saw nothing and `depth` has something.
struct Apart {
  int pixels = 0, of_picture = 0, of_host = 0;
};
Apart ApartFrom(const Shown& shown, const RenderResult& picture, const Grid<float>& depth,
                const HostState& state) {
  const DepthProjection projection = ProjectionOf(state);
  const double least = state.zero_to_one ? 0 : -1, far_step = 0.9999999;
  const Viewport& v = state.viewport;
  const int width = picture.image.width(), height = picture.image.height();
  Apart apart;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const auto p = static_cast<size_t>(y) * kWidth + static_cast<size_t>(x);
      double expected = Host::DepthBefore(x);
      const std::uint8_t* color = kHosts.data();
      if (x >= v.x && x < v.x + v.width && y >= v.y && y < v.y + v.height) {
        const int i = static_cast<int>((x - v.x + 0.5) * width / v.width);
        const int row = static_cast<int>((y - v.y + 0.5) * height / v.height);
        const int j = state.top_first ? row : height - 1 - row;
        const double z = depth(i, j);
        const bool filled = picture.coverage(i, j) == 0;
        const double device = projection.at_infinity + projection.per_inverse_depth / z;
        const double inside = std::clamp(device, least, 1.0);
        const bool drawn = z > 0 && (filled || state.clamps || inside == device);
        const double share = std::min((inside - least) / (1 - least), filled ? far_step : 1.0);
        const double window = state.range[0] + (state.range[1] - state.range[0]) * share;
        if (drawn && window < expected) {
          expected = window;
          color = &picture.image.data()[3 * (static_cast<size_t>(j) * static_cast<size_t>(width) +
                                             static_cast<size_t>(i))];
        }
      }
      ++(color == kHosts.data() ? apart.of_host : apart.of_picture);
      const bool same = std::equal(color, color + 3, &shown.rgba[4 * p]) &&
                        std::abs(shown.depth[p] - expected) <= kDepthApart;
      apart.pixels += same ? 0 : 1;
    }
  }
  return apart;
}

class CompositorTest : public testing::GlTest {
 protected:
  /// The damaged scene: holes, masks, a step.
  const NamedScene scene_ = ParityScenes()[3];
  const RenderScene views_ = MakeRenderScene(scene_.set);

  DrawnFrame Draw(FittingRenderer& renderer) const {
    return renderer.Draw(views_, scene_.novel.camera, scene_.novel.cam_from_world, {});
  }
  RenderResult Render(Drawer drawer = Drawer::kOpenGl) const {
    FittingRenderer renderer({}, drawer);
    return renderer.Render(views_, scene_.novel.camera, scene_.novel.cam_from_world, {});
  }
};

TEST_F(CompositorTest, ATextureAndAPictureInMemoryAreShownWhereTheyAreInFront) {
  for (const bool in_memory : {false, true}) {
    const Drawer drawer = in_memory ? Drawer::kSimd : Drawer::kOpenGl;
    const RenderResult picture = Render(drawer);
    FittingRenderer renderer({}, drawer);
    Compositor compositor;
    Host host;
    const DrawnFrame drawn = Draw(renderer);
    ASSERT_EQ(drawn.rgba != nullptr, in_memory);
    for (const HostState& state : States()) {  // one image, whose depth is mapped ever again
      const Shown shown =
          host.With(state, [&] { compositor.Composite(drawn, ProjectionOf(state)); });
      const Apart apart = ApartFrom(shown, picture, picture.depth.grid(), state);
      EXPECT_LE(apart.pixels, kUndecided) << state.name << ", in memory: " << in_memory;
      EXPECT_GT(apart.of_picture, 300) << state.name;
      EXPECT_GT(apart.of_host, 300) << state.name;
    }
  }
}

TEST_F(CompositorTest, DepthThatIsMappedAsItIsDrawnIsTheSame) {
  const RenderResult picture = Render(Drawer::kSimd);
  FittingRenderer renderer({}, Drawer::kSimd);
  Compositor compositor;
  Host host;
  for (const HostState& state : States()) {
    for (const bool as_said : {true, false}) {  // else the host's planes move in between
      const Shown shown = host.With(state, [&] {
        DepthProjection projection = ProjectionOf(state);
        if (!as_said) projection.at_infinity *= 1.01;
        const simd::WindowDepthMapping mapping = CurrentMapping(projection);
        const DrawnFrame drawn =
            renderer.Draw(views_, scene_.novel.camera, scene_.novel.cam_from_world, {}, mapping);
        EXPECT_NE(drawn.window_z, nullptr);
        EXPECT_EQ(drawn.mapping, mapping);
        compositor.Composite(drawn, ProjectionOf(state));
      });
      const Apart apart = ApartFrom(shown, picture, picture.depth.grid(), state);
      EXPECT_LE(apart.pixels, kUndecided) << state.name << ", as said: " << as_said;
      EXPECT_GT(apart.of_picture, 300) << state.name;
    }
  }
}

TEST_F(CompositorTest, TheNextPictureTakesThePlaceOfTheLast) {
  FittingRenderer renderer({}, Drawer::kSimd);
  Compositor compositor;
  Host host;
  const HostState plain = States().front();
  host.With(plain, [&] { compositor.Composite(Draw(renderer), ProjectionOf(plain)); });
  RenderOptions nearest;
  nearest.views = 1;
  const DrawnFrame drawn =
      renderer.Draw(views_, scene_.novel.camera, scene_.novel.cam_from_world, nearest);
  const Shown shown = host.With(plain, [&] { compositor.Composite(drawn, ProjectionOf(plain)); });
  const RenderResult picture = renderer.ReadBack();
  EXPECT_LE(ApartFrom(shown, picture, picture.depth.grid(), plain).pixels, kUndecided);
}

TEST_F(CompositorTest, FilledPixelsAreNeverCutOff) {
  const RenderResult picture = Render();
  Grid<float> depth = picture.depth.grid();
  int filled = 0;
  for (size_t p = 0; p < depth.data().size(); ++p) {
    if (picture.coverage.data()[p] != 0) continue;
    constexpr float kFilledZ[] = {2, 8, 1e9F, 0};  // before, between and beyond the planes; none
    depth.data()[p] = kFilledZ[filled++ % 4];
  }
  ASSERT_GT(filled, 40);
  Compositor compositor;
  Host host;
  for (HostState state : States()) {
    const DrawnFrame taken = compositor.TakeFilled(picture, depth);
    const Shown shown = host.With(state, [&] { compositor.Composite(taken, ProjectionOf(state)); });
    EXPECT_LE(ApartFrom(shown, picture, depth, state).pixels, kUndecided) << state.name;
  }
}

TEST_F(CompositorTest, LeavesTheHostsStateAsItWas) {
  FittingRenderer renderer({}, Drawer::kSimd);
  Compositor compositor;
  Host host;
  const DrawnFrame drawn = Draw(renderer);
  const Texture array = Texture::Make(), plain = Texture::Make(), other = Texture::Make();
  // Textures are made as the first image comes; unit 15 is where the renderer makes its own.
  constexpr GLenum kUnits[] = {GL_TEXTURE0, GL_TEXTURE15};
  host.With(States().front(), [&] {
    for (const GLenum unit : kUnits) {
      glActiveTexture(unit);
      glBindTexture(GL_TEXTURE_2D, other.name());
    }
    glActiveTexture(GL_TEXTURE1);
    glBindTexture(GL_TEXTURE_2D_ARRAY, array.name());
    glBindTexture(GL_TEXTURE_2D, plain.name());
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 17);
    glDepthMask(GL_FALSE);
    compositor.Composite(drawn, {1, -1});
    const auto value = [](GLenum name) {
      GLint v = 0;
      glGetIntegerv(name, &v);
      return v;
    };
    EXPECT_EQ(value(GL_ACTIVE_TEXTURE), GL_TEXTURE1);
    EXPECT_EQ(value(GL_TEXTURE_BINDING_2D_ARRAY), static_cast<GLint>(array.name()));
    EXPECT_EQ(value(GL_TEXTURE_BINDING_2D), static_cast<GLint>(plain.name()));
    for (const GLenum unit : kUnits) {
      glActiveTexture(unit);
      EXPECT_EQ(value(GL_TEXTURE_BINDING_2D), static_cast<GLint>(other.name())) << unit;
      glBindTexture(GL_TEXTURE_2D, 0);
    }
    glActiveTexture(GL_TEXTURE1);
    EXPECT_EQ(value(GL_UNPACK_ROW_LENGTH), 17);
    EXPECT_EQ(value(GL_DEPTH_WRITEMASK), GL_FALSE);
    EXPECT_EQ(value(GL_CURRENT_PROGRAM), 0);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
    glDepthMask(GL_TRUE);
    glBindTexture(GL_TEXTURE_2D_ARRAY, 0);
    glBindTexture(GL_TEXTURE_2D, 0);
    glActiveTexture(GL_TEXTURE0);
  });
}

}  // namespace
}  // namespace dtr::gl
