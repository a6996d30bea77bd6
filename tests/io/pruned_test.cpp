// What `dtr info` says of a set that something was left out of.
#include "dtr/io/pruned.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dtr/base/error.h"

namespace dtr::io {
namespace {

DtrSet SetWith(const std::string& pruned) {
  DtrSet set;
  SetPrunedJson(set, pruned);
  return set;
}

TEST(DescribePruned, SaysWhatWasLeftOutWhatWasTakenBackAndWhatTheChecksFound) {
  const std::string told = DescribePruned(SetWith(R"({
    "max_loss_db": 0.5, "loss_db": 0.31,
    "probe_loss_db": 0.31, "probe_error_db": 0.04, "witness_loss_db": -0.02,
    "witness_error_db": 0.1,
    "removed": [{"kind": "images", "what": "JPEG 95", "loss_db": 0.011, "bytes_share": 0.25,
                 "frame_share": 0}],
    "put_back": [{"kind": "view", "what": "0003.jpg", "loss_db": 0.2, "bytes_share": 0.125,
                  "frame_share": 0.0625}],
    "render": {"views": 4, "method": "two-pass"}})"));
  EXPECT_EQ(told,
            "left out by dtr prune, 0.31 dB lost of 0.5 allowed:\n"
            "  images: JPEG 95, 0.011 dB, 25 % of the bytes\n"
            "  taken back: view: 0003.jpg, 0.2 dB, 12.5 % of the bytes, 6.25 % of a frame's work\n"
            "lost between input cameras: 0.31 +- 0.04 dB\n"
            "lost at photos that did not decide: -0.02 +- 0.1 dB\n"
            "rendered by default with: views 4, method two-pass\n");
}

TEST(DescribePruned, TellsWhatAnotherToolWroteAsFarAsItGoes) {
  EXPECT_EQ(DescribePruned(DtrSet()), "");
  EXPECT_EQ(DescribePruned(SetWith(
                R"({"put_back": [3, {"kind": "view"}], "removed": "all", "probe_loss_db": "much",
                    "witness_loss_db": 0.1})")),
            "left out by dtr prune:\n"
            "  taken back: view: ?\n"
            "lost at photos that did not decide: 0.1 dB\n"
            "rendered by default with: the usual options\n");
  // Sets of version 0.1.
  EXPECT_THAT(DescribePruned(SetWith(R"({"render_arguments": ["--views", "4"]})")),
              ::testing::EndsWith("rendered by default with: --views 4\n"));
  EXPECT_THROW(DescribePruned(SetWith(R"({"render": 3})")), Error);
}

}  // namespace
}  // namespace dtr::io
