// The measure of parity_test.cpp on larger images: the figures of docs/accuracy/RENDERING.md.
#include <gtest/gtest.h>

#include "tests/gl/gl_testing.h"
#include "tests/simd/parity_matrix.h"

namespace dtr::gl {
namespace {

using namespace dtr::testing;

class FullParity : public GlTest, public ::testing::WithParamInterface<std::string> {};

TEST_P(FullParity, HoldsForEveryMethodWeightPrimitiveAndResolution) {
  Renderer renderer;
  ExpectParityOfAll(renderer, ExactOrDamagedScene(GetParam(), 9, 480, 320), 8);
}

INSTANTIATE_TEST_SUITE_P(, FullParity, ::testing::ValuesIn(ExactSceneNames()),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace dtr::gl
