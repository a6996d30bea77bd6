// What the image must not depend on, both methods.
#include "tests/simd/invariance.h"

#include "tests/gl/gl_testing.h"

namespace dtr::gl {
namespace {

using namespace dtr::testing;

class Invariance : public GlTest, public ::testing::WithParamInterface<RenderMethod> {
 protected:
  InvarianceOf<Renderer> image_{GetParam()};
};

INSTANTIATE_TEST_SUITE_P(, Invariance,
                         ::testing::Values(RenderMethod::kTwoPass, RenderMethod::kDeferred),
                         [](const auto& test) {
                           return test.param == RenderMethod::kTwoPass ? "TwoPass" : "Deferred";
                         });

TEST_P(Invariance, OrderOfTheViews) { image_.ExpectNoOrderOfTheViews(); }
TEST_P(Invariance, ThreadsAndRepeatedRuns) { image_.ExpectNoThreadsOrEarlierRuns(); }
TEST_P(Invariance, UnitOfTheWorld) { image_.ExpectNoUnitOfTheWorld(); }
TEST_P(Invariance, OriginOfTheWorld) { image_.ExpectNoOriginOfTheWorld(); }

}  // namespace
}  // namespace dtr::gl
