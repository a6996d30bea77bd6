// What the image must not depend on.
#include "tests/simd/invariance.h"

#include "dtr/simd/renderer.h"

namespace dtr::simd {
namespace {

class SimdInvariance : public ::testing::Test {
 protected:
  testing::InvarianceOf<Renderer> image_{RenderMethod::kDeferred};
};

TEST_F(SimdInvariance, OrderOfTheViews) { image_.ExpectNoOrderOfTheViews(); }
TEST_F(SimdInvariance, ThreadsAndRepeatedRuns) { image_.ExpectNoThreadsOrEarlierRuns(); }
TEST_F(SimdInvariance, UnitOfTheWorld) { image_.ExpectNoUnitOfTheWorld(); }
TEST_F(SimdInvariance, OriginOfTheWorld) { image_.ExpectNoOriginOfTheWorld(); }

}  // namespace
}  // namespace dtr::simd
