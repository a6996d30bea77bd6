// Words of the command line that can be meant by nobody, whatever the command.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "capture/store.h"
#include "dtr/base/process.h"
#include "dtr/base/work_folder.h"
#include "tests/cli/courtyard_and_set.h"
#include "tests/cli/run_dtr.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

class Arguments : public CourtyardAndSet {};

TEST_F(Arguments, MistypedWordsAreAnsweredByWhatWasMeant) {
  const auto rejected = [](const std::vector<std::string>& words, const std::string& line) {
    ExpectRejected(Dtr(words), kWrongUsage, line);
  };
  rejected({"biuld", Photos()}, "no command is called 'biuld' (did you mean 'build'?)");
  rejected({"calibrate", "bord", Photos()},
           "no command is called 'calibrate bord' (did you mean 'board'?)");
  // Left out, put in, exchanged, swapped; the beginning of one name; an underscore.
  for (const std::string typed :
       {"--holdouts", "--holbout", "--hodlout", "--holdo", "--holdout_strict"}) {
    const Ran ran = Dtr({"build", Photos(), "-o", In("s.dtr"), typed, "every:8"});
    EXPECT_EQ(ran.code, kWrongUsage);
    EXPECT_NE(ran.err.find(typed + ": did you mean --holdout"), std::string::npos) << ran.err;
  }
  rejected({"build", Photos(), "-o", In("s.dtr"), "--holdot", "every:8"},
           "(--holdot: did you mean --holdout?)");
  // What is missing is missing for the same reason.
  rejected({"build", Photos(), "--ouput", In("s.dtr")},
           "--output is required (--ouput: did you mean --output?)");
  const Ran far = Dtr({"build", Photos(), "-o", In("s.dtr"), "--frobnicate"});
  EXPECT_EQ(far.code, kWrongUsage);
  EXPECT_EQ(far.err.find("did you mean"), std::string::npos) << far.err;
}

TEST_F(Arguments, HelpOfACommandIsThatOfItsOption) {
  EXPECT_EQ(DtrOk({"help"}).out, DtrOk({"--help"}).out);
  EXPECT_EQ(DtrOk({"help", "build"}).out, DtrOk({"build", "--help"}).out);
  const std::string board = DtrOk({"help", "calibrate", "board"}).out;
  EXPECT_EQ(board, DtrOk({"calibrate", "board", "--help"}).out);
  EXPECT_NE(board.find("--board"), std::string::npos);
  EXPECT_NE(DtrOk({"--help"}).out.find("help"), std::string::npos);
  ExpectRejected(Dtr({"help", "frobnicate"}), kWrongUsage, "no command is called 'frobnicate'");
}

// Every command in 100 columns and 40 lines; --help-all has what does not fit.
TEST_F(Arguments, HelpFitsAScreen) {
  const std::string commands = DtrOk({"--help"}).out;
  std::vector<std::vector<std::string>> called = {{}};
  for (const char* name :
       {"build", "capture", "stereo", "import", "join", "render", "info", "validate", "evaluate",
        "inspect", "advise", "prune", "export", "bench", "selftest", "batch", "view"}) {
    if (commands.find("\n  " + std::string(name) + " ") != std::string::npos) {
      called.push_back({name});
    }
  }
  for (const char* name : {"photos", "board", "rig", "refine", "scale"}) {
    called.push_back({"calibrate", name});
  }
  for (std::vector<std::string> words : called) {
    SCOPED_TRACE(words.empty() ? "" : words.back());
    words.insert(words.begin(), "help");
    const std::string help = DtrOk(words).out;
    EXPECT_LE(std::count(help.begin(), help.end(), '\n'), 40) << help;
    std::istringstream lines(help);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u) << line;
  }
  EXPECT_EQ(DtrOk({"build", "--help"}).out.find("--passes"), std::string::npos);
  EXPECT_NE(DtrOk({"build", "--help-all"}).out.find("--passes N"), std::string::npos);
  EXPECT_EQ(DtrOk({"help", "build", "--all"}).out, DtrOk({"build", "--help-all"}).out);
  for (const char* command : {"", "calibrate", "dataset"}) {
    std::vector<std::string> words = {"help", "--all"};
    if (*command != '\0') words.insert(words.begin() + 1, command);
    EXPECT_NE(DtrOk(words).out.find("Usage: dtr"), std::string::npos);
  }
}

TEST_F(Arguments, APathInThePlaceOfACommand) {
  ExpectRejected(Dtr({Photos()}), kWrongUsage, " -o NAME.dtr makes a set of its photos");
  fs::create_directories(In("my photos"));
  ExpectRejected(Dtr({In("my photos")}), kWrongUsage, "my photos' -o NAME.dtr makes a set");
  for (const char* end : {"", "/"}) {
    ExpectRejected(Dtr({Shared("good.dtr") + end}), kWrongUsage, "found the set '");
  }
  ExpectRejected(Dtr({Shared("good.dtr/set.json")}), kWrongUsage, "no command is called");
}

TEST_F(Arguments, NumbersThatAreNone) {
  const std::string words = ": expected a finite number, found ";
  for (const char* word : {"nan", "-nan", "inf", "1e999", "4GB"}) {
    SCOPED_TRACE(word);
    const Ran ran = Dtr({"capture", Photos(), "-o", In("capture"), "--memory", word});
    ExpectRejected(ran, kWrongUsage, words);
    EXPECT_NE(ran.err.find("--memory" + words + word), std::string::npos) << ran.err;
  }
  ExpectRejected(Dtr({"advise", Shared("good.dtr"), "--max-gap", "nan"}), kWrongUsage, words);
  ExpectRejected(Dtr({"bench", Shared("good.dtr"), "--views", "2,nan"}), kWrongUsage, words);
  EXPECT_FALSE(fs::exists(In("capture")));
}

TEST_F(Arguments, OutputsWithoutANameOrWithTheNameOfAnother) {
  ExpectRejected(Dtr({"capture", Photos(), "-o", ""}), kWrongUsage,
                 "--output: expected a name, found an empty one");
  ExpectRejected(Dtr({"render", Shared("good.dtr"), "--renderer", "cpu", "--like", "0001", "-o",
                      In("view.png"), "--json", In("./view.png")}),
                 kWrongUsage, ": expected another file than --output, found it");
  EXPECT_FALSE(fs::exists(In("view.png")));
}

TEST_F(Arguments, WordsOfSeveralLines) {
  ExpectRejected(Dtr({"info", In("a\nb.dtr")}), kWrongUsage,
                 "expected no control characters, found '");
}

TEST_F(Arguments, AVideoMayHaveAnyName) {
  if (FindProgram("ffmpeg").empty()) GTEST_SKIP() << "there is no ffmpeg on the PATH";
  for (const char* name : {"100%.mp4", "a%d.mp4", "a:b.mp4", "-x.mp4"}) {
    SCOPED_TRACE(name);
    DtrOk({"render", Shared("good.dtr"), "--renderer", "cpu", "--fly-through", "2", "--size",
           "24x16", "-o", In(name)});
    EXPECT_GT(fs::file_size(In(name)), 0u);
  }
}

TEST_F(Arguments, TwoCalibrationsInOneFolder) {
  fs::create_directories(In("model/workspace"));
  const FileLock lock = WorkFolder::Lock(In("model/workspace"), capture::kCalibrationKind);
  ExpectRejected(Dtr({"calibrate", "photos", Photos(), "-o", In("model")}), kWrongUsage,
                 "workspace: another process is writing this calibration; wait for it");
}

TEST_F(Arguments, ASetInThePlaceOfPhotos) {
  ExpectRejected(Dtr({"build", Shared("good.dtr"), "-o", In("set.dtr")}), kWrongUsage,
                 "expected a folder of photos, found a D+TR set; give the photos it was made of");
}

}  // namespace
}  // namespace dtr::testing
