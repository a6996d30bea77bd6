#include "calib/sfm/matching/pair_journal.h"

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>

#include "calib/sfm/matching/photo_blocks.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "tests/calib/sfm/matching/match_world.h"
#include "tests/support/test_data.h"

namespace dtr::sfm {
namespace {

using namespace matching;

constexpr std::uintmax_t kLimit = 1 << 26;

void ExpectSame(const ViewGraph& x, const ViewGraph& y) {
  ASSERT_EQ(x.cameras.size(), y.cameras.size());
  for (size_t c = 0; c < x.cameras.size(); ++c) EXPECT_EQ(x.cameras[c].params, y.cameras[c].params);
  ASSERT_EQ(x.pairs.size(), y.pairs.size());
  for (size_t i = 0; i < x.pairs.size(); ++i) {
    EXPECT_EQ(x.pairs[i].image_a, y.pairs[i].image_a);
    EXPECT_EQ(x.pairs[i].image_b, y.pairs[i].image_b);
    EXPECT_EQ(x.pairs[i].kind, y.pairs[i].kind);
    EXPECT_EQ(x.pairs[i].b_rotation_a, y.pairs[i].b_rotation_a);
    EXPECT_EQ(x.pairs[i].b_translation_a, y.pairs[i].b_translation_a);
    EXPECT_EQ(x.pairs[i].parallax_rad, y.pairs[i].parallax_rad);
    EXPECT_EQ(x.pairs[i].matches, y.pairs[i].matches);
  }
}

// Stops after so many updates of all stages together.
class StopsAfter final : public Progress {
 public:
  explicit StopsAfter(int updates) : left_(updates) {}
  void Stage(const std::string&, int) override {}
  void Update(int) override { --left_; }
  void Note(const std::string&) override {}
  bool StopRequested() const override { return left_ <= 0; }

 private:
  std::atomic<int> left_;
};

// Photos whose descriptors are loaded; counts what is.
class OfFiles {
 public:
  OfFiles() : whole_(Photos(WorldOf(300, 21, false), Camera(kFocalPx))), photos_(whole_) {
    for (MatchPhoto& photo : photos_) photo.features.descriptors.clear();
  }

  MatchOptions Options() {
    MatchOptions options;
    options.load_descriptors = [this](int photo, size_t largest) {
      ++loads_;
      const auto& all = whole_[static_cast<size_t>(photo)].features.descriptors;
      const auto count = static_cast<std::ptrdiff_t>(std::min(largest, all.size()));
      return std::vector<Descriptor>(all.begin(), all.begin() + count);
    };
    return options;
  }
  /// The same, kept in a journal of `folder`.
  MatchOptions Journaled(const testing::TemporaryFolder& folder) {
    MatchOptions options = Options();
    options.journal = folder / "journal";
    options.journal_inputs = "inputs";
    return options;
  }
  MatchResult Run(const MatchOptions& options, const std::optional<MatchPart>& part = {}) const {
    return MatchPhotos(photos_, std::vector{Camera(1200)}, {false}, options, part);
  }
  MatchResult InMemory() const {
    return MatchPhotos(whole_, std::vector{Camera(1200)}, {false}, {});
  }
  int TakeLoads() { return std::exchange(loads_, 0); }

 private:
  std::vector<MatchPhoto> whole_, photos_;
  int loads_ = 0;
};

TEST(MatchInBlocks, GivesWhatMatchingInMemoryGives) {
  OfFiles files;
  MatchOptions options = files.Options();
  const MatchResult expected = files.InMemory();
  ASSERT_EQ(expected.graph.pairs.size(), 10u);
  ExpectSame(files.Run(options).graph, expected.graph);
  EXPECT_EQ(files.TakeLoads(), 10) << "five photos, once for each search";
  options.descriptor_gb = 1e-9;  // one pair at a time
  ExpectSame(files.Run(options).graph, expected.graph);
  EXPECT_GT(files.TakeLoads(), 20);
}

TEST(MatchInBlocks, DescriptorsOfAnotherNumberAreRejected) {
  OfFiles files;
  MatchOptions options = files.Options();
  options.load_descriptors = [](int, size_t) { return std::vector<Descriptor>(3); };
  EXPECT_THROW(files.Run(options), std::invalid_argument);
}

TEST(MatchInBlocks, ABlockHoldsWhatFitsAndOnePairAtLeast) {
  const std::vector<std::pair<int, int>> pairs = {{0, 1}, {0, 2}, {1, 2}, {2, 3}};
  const std::vector<double> bytes = {5, 5, 5, 100};
  EXPECT_EQ(BlockEnd(pairs, 0, bytes, 0, 512), 4u);
  EXPECT_EQ(BlockEnd(pairs, 0, bytes, 0, 2), 2u);
  EXPECT_EQ(BlockEnd(pairs, 0, bytes, 15, 512), 3u);
  EXPECT_EQ(BlockEnd(pairs, 0, bytes, 14, 512), 1u);
  EXPECT_EQ(BlockEnd(pairs, 3, bytes, 15, 512), 4u);
}

TEST(PairJournal, AnInterruptedRunGoesOnWhereItStopped) {
  OfFiles files;
  const MatchResult expected = files.InMemory();
  // Ten pairs are compared and then matched; stops in every block of both.
  for (int updates = 1; updates < 20; ++updates) {
    const testing::TemporaryFolder folder;
    MatchOptions options = files.Journaled(folder);
    options.descriptor_gb = 1e-9;
    StopsAfter stops(updates);
    options.progress = &stops;
    EXPECT_THROW(files.Run(options), Interrupted);
    files.TakeLoads();
    options.progress = nullptr;
    ExpectSame(files.Run(options).graph, expected.graph);
    const int left = 20 - updates;
    EXPECT_LE(files.TakeLoads(), 2 * (left + 1)) << updates;
  }
}

TEST(PairJournal, OfAnEndCutShortOrDamagedTheWholePartCounts) {
  OfFiles files;
  const MatchResult expected = files.InMemory();
  const testing::TemporaryFolder folder;
  MatchOptions options = files.Journaled(folder);
  options.descriptor_gb = 1e-9;
  ExpectSame(files.Run(options).graph, expected.graph);
  EXPECT_GT(files.TakeLoads(), 0);
  ExpectSame(files.Run(options).graph, expected.graph);
  EXPECT_EQ(files.TakeLoads(), 0) << "all of it is in the journal";

  const std::string whole = ReadFile(options.journal, kLimit);
  const auto write = [&](const std::string& content) {
    std::ofstream(options.journal, std::ios::binary) << content;
  };
  for (size_t bytes = 0; bytes < whole.size(); bytes += whole.size() / 23) {
    write(whole.substr(0, bytes));
    ExpectSame(files.Run(options).graph, expected.graph);
    EXPECT_GT(files.TakeLoads(), 0) << bytes;
    EXPECT_EQ(ReadFile(options.journal, kLimit), whole) << bytes;
  }
  for (size_t at = 3; at < whole.size(); at += whole.size() / 11) {
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ 4);
    write(flipped);
    ExpectSame(files.Run(options).graph, expected.graph);
    EXPECT_EQ(ReadFile(options.journal, kLimit), whole) << at;
  }
}

TEST(PairJournal, OtherInputsAndOtherFeaturesCountForNothing) {
  const testing::TemporaryFolder folder;
  const std::vector<size_t> features = {9, 9, 9};
  const std::vector<std::pair<int, int>> pairs = {{0, 1}, {0, 2}, {1, 2}};
  const auto write = [&] {
    PairJournal journal(folder / "journal", "inputs", features);
    journal.AddPairs(pairs);
    const std::vector<std::optional<CoarsePair>> coarse = {
        CoarsePair{0, 1, {{3, 8, 0.5F}}}, {}, CoarsePair{1, 2, {}}};
    journal.AddCoarse(std::vector{0, 2}, coarse);
    journal.AddGeometries(std::vector{1}, std::vector<std::optional<TriedPair>>{{}, TriedPair{}});
  };
  const auto read = [&](const std::string& inputs, const std::vector<size_t>& counts) {
    return PairJournal(folder / "journal", inputs, counts).TakeContent();
  };
  write();
  PairJournal::Content content = read("inputs", features);
  EXPECT_EQ(content.pairs, pairs);
  ASSERT_EQ(content.coarse.size(), 3u);
  ASSERT_TRUE(content.coarse[0] && !content.coarse[1] && content.coarse[2]);
  EXPECT_EQ(content.coarse[0]->b, 1);
  EXPECT_EQ(content.coarse[0]->matches.at(0).b, 8);
  ASSERT_EQ(content.geometries.size(), 3u);
  EXPECT_TRUE(!content.geometries[0] && content.geometries[1] && !content.geometries[2]);
  EXPECT_TRUE(read("inputs", {9, 9, 9, 9}).pairs);
  content = read("inputs", {9, 8, 9});
  EXPECT_TRUE(content.pairs);
  EXPECT_FALSE(content.coarse[0] || content.coarse[2]) << "photo 1 has no feature 8";
  std::filesystem::remove(folder / "journal");
  write();
  EXPECT_FALSE(read("inputs", {9, 9}).pairs) << "there is no photo 2";
  std::filesystem::remove(folder / "journal");
  write();
  EXPECT_FALSE(read("other inputs", features).pairs);
}

// Runs one part; the result is in the journal.
void RunPart(const OfFiles& files, const MatchOptions& options, MatchPart::Stage stage, int index,
             int count) {
  files.Run(options, MatchPart{stage, {index, count}});
}

TEST(MatchInParts, PartsInAnyOrderGiveWhatOneProcessGives) {
  using Stage = MatchPart::Stage;
  OfFiles files;
  const testing::TemporaryFolder folder;
  MatchOptions options = files.Journaled(folder);
  RunPart(files, options, Stage::kPairs, 0, 1);
  for (const int index : {2, 0, 1}) RunPart(files, options, Stage::kMatching, index, 3);
  // Parts of another number overlap with these and do them no harm.
  RunPart(files, options, Stage::kMatching, 1, 2);
  for (const int index : {3, 1, 0, 2}) RunPart(files, options, Stage::kVerification, index, 4);
  files.TakeLoads();
  ExpectSame(files.Run(options).graph, files.InMemory().graph);
  EXPECT_EQ(files.TakeLoads(), 0) << "all of it is in the parts' journals";
  PairJournal::Remove(options.journal);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(MatchInParts, WhatAPartNeedsAndNobodyDidIsNamed) {
  using Stage = MatchPart::Stage;
  OfFiles files;
  const testing::TemporaryFolder folder;
  const MatchOptions options = files.Journaled(folder);
  const auto message = [&](Stage stage) {
    try {
      files.Run(options, MatchPart{stage, {0, 2}});
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(message(Stage::kMatching).find("run the stage pairs first"), std::string::npos);
  RunPart(files, options, Stage::kPairs, 0, 1);
  RunPart(files, options, Stage::kMatching, 0, 2);
  EXPECT_EQ(message(Stage::kVerification),
            "matches: expected 10 pairs that were compared, found 5; run all parts of the stage "
            "matching first");
}

}  // namespace
}  // namespace dtr::sfm
