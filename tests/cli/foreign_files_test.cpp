// What is not ours is not deleted, overwritten or waited for: links, devices, pipes, inputs and
// other people's files under the names that a command writes to.
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <future>

#include "dtr/base/files.h"
#include "tests/cli/courtyard_and_set.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class ForeignFiles : public CourtyardAndSet {
 protected:
  void SetUp() override {
    fs::create_directories(folder_ / "user/below");
    WriteFileAtomically(In("user/precious.txt"), "p");
    WriteFileAtomically(In("user/below/more.txt"), "m");
  }
  void ExpectUntouched() const {
    EXPECT_EQ(Text(In("user/precious.txt")), "p");
    EXPECT_EQ(Text(In("user/below/more.txt")), "m");
    EXPECT_EQ(FilesIn(In("user")), 1);
  }
  std::vector<std::string> Import(const std::string& target) const {
    return {"import",  "--cameras", Shared("courtyard/cameras.json"), "--images",
            Photos(),  "--depth",   Shared("courtyard/depth"),        "-o",
            In(target)};
  }
  // A set of the test's own.
  fs::path CopyOfSet(const std::string& name) const {
    fs::copy(Shared("good.dtr"), In(name), fs::copy_options::recursive);
    return In(name);
  }
};

std::vector<std::string> With(std::vector<std::string> words, std::vector<std::string> more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

TEST_F(ForeignFiles, FoldersBehindLinksInWorkFoldersAreLeftAlone) {
  const std::string rejected = "work in progress must not be a symbolic link";
  for (const char* place : {"n.dtr.partial", "n.dtr.partial/work", "n.dtr.partial/images",
                            "n.dtr.partial/work/views", "n.dtr.partial/work/calibration"}) {
    const fs::path link = In(place);
    fs::remove_all(In("n.dtr.partial"));
    fs::create_directories(link.parent_path());
    fs::create_directory_symlink(In("user"), link);
    ExpectRejected(Dtr(Import("n.dtr")), kWrongUsage, rejected);
    ExpectUntouched();
    fs::remove(link);
  }
  for (const char* beside : {"n.dtr.replaced", "n.dtr.partial.work"}) {
    fs::create_directory_symlink(In("user"), In(beside));
    ExpectRejected(Dtr(Import("n.dtr")), kWrongUsage, rejected);
    ExpectUntouched();
    fs::remove(In(beside));
  }
  // Work of captures, exports and datasets is cleared, not continued.
  for (const auto& words :
       {std::vector<std::string>{"capture", Photos()},
        {"export", Shared("good.dtr")},
        {"dataset", "make", "plane", "--views", "3", "--width", "96", "--height", "64"}}) {
    fs::create_directory_symlink(In("user"), In("n.partial"));
    ExpectRejected(Dtr(With(words, {"-o", In("n")})), kWrongUsage, "found something else");
    ExpectUntouched();
    fs::remove(In("n.partial"));
    // A link inside such work goes itself.
    const std::string kind = words[0];
    fs::create_directories(In("n.partial"));
    WriteFileAtomically(In("n.partial/" + kind + ".lock"), "");
    fs::create_directory_symlink(In("user"), In("n.partial/images"));
    DtrOk(With(words, {"-o", In("n")}));
    ExpectUntouched();
    fs::remove_all(In("n"));
  }
}

TEST_F(ForeignFiles, ASetBehindALinkIsReplacedWhereItIsAndTheLinkStays) {
  const fs::path real = CopyOfSet("real.dtr");
  fs::create_directory_symlink("real.dtr", In("link.dtr"));
  DtrOk(With(Import("link.dtr"), {"--force"}));
  EXPECT_TRUE(fs::is_symlink(In("link.dtr")));
  EXPECT_TRUE(fs::is_directory(real));
  DtrOk({"info", real.string(), "--verify"});
  DtrOk({"calibrate", "scale", In("link.dtr"), "--distance", "0001,0006=2m"});
  EXPECT_TRUE(fs::is_symlink(In("link.dtr")));
  DtrOk({"info", real.string(), "--verify"});
  EXPECT_EQ(FilesIn(folder_.path()), 0);
  DtrOk({"capture", Photos(), "-o", In("capture")});
  fs::create_directory_symlink(In("capture"), In("link"));
  DtrOk({"capture", Photos(), "-o", In("link"), "--force"});
  EXPECT_TRUE(fs::is_symlink(In("link")));
  EXPECT_TRUE(fs::exists(In("capture/capture.json")));
  // One that leads nowhere yet is made where it leads.
  fs::create_directory_symlink("new.dtr", In("first.dtr"));
  DtrOk(Import("first.dtr"));
  EXPECT_TRUE(fs::is_symlink(In("first.dtr")));
  DtrOk({"info", In("new.dtr"), "--verify"});
}

TEST_F(ForeignFiles, ResultsGoThroughLinksIntoPipesAndDevices) {
  fs::create_directories(folder_ / "d");
  ASSERT_EQ(mkfifo(In("d/pipe").c_str(), 0600), 0);
  WriteFileAtomically(In("target.json"), "old");
  fs::create_symlink("../target.json", In("d/link.json"));
  fs::create_symlink("../new.json", In("d/dangling.json"));
  const std::vector<std::string> info{"info", Shared("good.dtr"), "--json"};
  auto read = std::async(std::launch::async, [&] {
    std::ifstream pipe(In("d/pipe"));
    return std::string(std::istreambuf_iterator<char>(pipe), {});
  });
  DtrOk(With(info, {In("d/pipe")}));
  const std::string json = read.get();
  EXPECT_THAT(json, HasSubstr("\"views\""));
  EXPECT_TRUE(fs::is_fifo(In("d/pipe")));
  DtrOk(With(info, {In("d/link.json"), "--force"}));
  DtrOk(With(info, {In("d/dangling.json")}));
  for (const char* name : {"link", "dangling"}) {
    EXPECT_TRUE(fs::is_symlink(In(std::string("d/") + name + ".json"))) << name;
  }
  EXPECT_EQ(Text(In("target.json")), json);
  EXPECT_EQ(Text(In("new.json")), json);
  if (mknod(In("d/null").c_str(), S_IFCHR | 0666, makedev(1, 3)) == 0) {
    DtrOk(With(info, {In("d/null")}));
    EXPECT_TRUE(fs::is_character_file(In("d/null")));
  }
  EXPECT_EQ(FilesIn(In("d")), 2);  // both links
}

TEST_F(ForeignFiles, NothingIsWrittenIntoASet) {
  const fs::path set = CopyOfSet("s.dtr");
  const auto before = Contents(set);
  const std::string inside = "cannot be written into the set";
  const std::string s = set.string();
  const std::vector<std::string> render{"render", s, "--like", "0001", "--renderer", "cpu"};
  for (const auto& words : std::vector<std::vector<std::string>>{
           {"info", s, "--json", s + "/set.json"},
           {"info", s, "--json", s + "/new.json", "--force"},
           With(render, {"-o", s + "/images/0001.png"}),
           With(render, {"-o", s + "/new.png"}),
           With(render, {"-o", In("v.png"), "--depth-out", s + "/depth/0001.exr"}),
           {"render", s, "--fly-through", "2", "-o", s},
           {"evaluate", s, "--images", s + "/images"},
           {"stereo", s, "--normals", s + "/depth", "-o", In("t.dtr")},
           {"inspect", s, "-o", s + "/report/index.html"},
           {"export", s, "--format", "ply", "-o", s + "/cloud.ply"},
           {"bench", s, "-o", s + "/images"},
           With(Import("s.dtr/inner.dtr"), {})}) {
    ExpectRejected(Dtr(words), kWrongUsage, inside);
    EXPECT_THAT(DifferingFiles(before, Contents(set)), IsEmpty()) << words[0];
  }
}

TEST_F(ForeignFiles, InputsAreNotReplacedAndOtherFilesOnlyByForce) {
  fs::copy(Photos(), In("photos"), fs::copy_options::recursive);
  fs::copy(Shared("courtyard/cameras.json"), In("cameras.json"));
  const std::string set = Shared("good.dtr"), photos = In("photos"), cameras = In("cameras.json");
  const auto before = Contents(photos);
  const std::string input = "cannot replace an input; choose another name";
  ExpectRejected(Dtr({"capture", photos, "-o", In("c"), "--json", photos + "/0000.jpg", "--force"}),
                 kWrongUsage, input);
  ExpectRejected(Dtr({"import", "--cameras", cameras, "--images", photos, "-o", In("i.dtr"),
                      "--json", cameras, "--force"}),
                 kWrongUsage, input);
  ExpectRejected(Dtr({"render", set, "--path", cameras, "-o", In("f"), "--json", cameras}),
                 kWrongUsage, input);
  EXPECT_THAT(DifferingFiles(before, Contents(photos)), IsEmpty());

  const std::string exists = "exists already; choose another";
  WriteFileAtomically(In("mine.png"), "mine");
  WriteFileAtomically(In("mine.html"), "mine");
  WriteFileAtomically(In("mine.json"), "mine");
  WriteFileAtomically(In("mine.mp4"), "mine");
  const std::vector<std::string> render{"render", set, "--like", "0001", "--renderer", "cpu", "-o"};
  const std::vector<std::vector<std::string>> commands{
      With(render, {In("mine.png")}),
      {"inspect", set, "-o", In("mine.html")},
      {"info", set, "--json", In("mine.json")},
      {"render", set, "--fly-through", "2", "-o", In("mine.mp4")}};
  for (const auto& words : commands) {
    ExpectRejected(Dtr(words), kWrongUsage, exists);
    EXPECT_EQ(Text(words.back()), "mine");
  }
  DtrOk(With(commands[0], {"--force"}));
  EXPECT_NE(Text(In("mine.png")), "mine");
  // Nothing is lost of an empty file, as mktemp makes it.
  WriteFileAtomically(In("empty.json"), "");
  DtrOk({"info", set, "--json", In("empty.json")});
}

TEST_F(ForeignFiles, FramesAndComparisonsReplaceNoFileOfTheirFolder) {
  const std::string set = Shared("good.dtr");
  const std::string exists = "exists already; choose another folder";
  fs::create_directories(In("photos"));
  WriteFileAtomically(In("photos/000001.png"), "mine");
  std::vector<std::string> frames{"render", set,  "--fly-through", "2", "--renderer",
                                  "cpu",    "-o", In("photos")};
  ExpectRejected(Dtr(frames), kWrongUsage, exists);
  EXPECT_EQ(Text(In("photos/000001.png")), "mine");
  EXPECT_EQ(FilesIn(In("photos")), 1);
  DtrOk(With(frames, {"--force"}));
  EXPECT_NE(Text(In("photos/000001.png")), "mine");
  const std::vector<std::string> evaluate{"evaluate",    set,          "--images",
                                          In("compare"), "--renderer", "cpu"};
  DtrOk(evaluate);
  ExpectRejected(Dtr(evaluate), kWrongUsage, exists);
  DtrOk(With(evaluate, {"--force"}));
}

TEST_F(ForeignFiles, APipeInThePlaceOfAFileOfASetKeepsNobodyWaiting) {
  DtrOk({"build", Photos(), "-o", In("meshes.dtr"), "--poses", Shared("courtyard/sparse"),
         "--preset", "fast"});
  for (const std::string file : {"mesh/0001.bin", "images/0001.png", "sparse.bin", "set.json",
                                 "report/run.json", "depth/0001.png"}) {
    fs::remove_all(In("s.dtr"));
    fs::copy(In("meshes.dtr"), In("s.dtr"), fs::copy_options::recursive);
    const fs::path place = fs::path(In("s.dtr")) / file;
    ASSERT_TRUE(fs::remove(place)) << file;
    ASSERT_EQ(mkfifo(place.c_str(), 0600), 0);
    const std::string set = In("s.dtr");
    const Ran verified = Dtr({"info", set, "--verify"});
    EXPECT_EQ(verified.signal, 0) << file;
    const Ran rendered = Dtr(
        {"render", set, "--like", "0001", "--renderer", "cpu", "-o", In("view.png"), "--force"});
    EXPECT_EQ(rendered.signal, 0) << file;
    const Ran inspected = Dtr({"inspect", set, "-o", In("page.html"), "--force"});
    EXPECT_EQ(inspected.signal, 0) << file;
    const Ran exported = Dtr({"export", set, "--format", "web", "-o", In("page2.html")});
    EXPECT_EQ(exported.signal, 0) << file;
    EXPECT_EQ(exported.err.find("fault of its own"), std::string::npos) << exported.err;
    fs::remove(In("page2.html"));
  }
}

// The program started by a shell, which sets up its descriptors.
int ExitOf(const std::string& words) {
  const int status = std::system((std::string(DTR_PROGRAM) + " " + words).c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

TEST_F(ForeignFiles, WorkGoesOnWhereMessagesCannotBeWritten) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "SKIPPED: no /dev/full";
  const std::string set = Shared("good.dtr");
  EXPECT_EQ(ExitOf("render " + set + " --fly-through 2 --renderer cpu -o " + In("a") +
                   " >/dev/null 2>/dev/full"),
            0);
  EXPECT_EQ(FilesIn(In("a")), 2);
  EXPECT_EQ(ExitOf("render " + set + " --fly-through 2 --renderer cpu -o " + In("b") +
                   " >/dev/null 2>&-"),
            0);
  EXPECT_THAT(DifferingFiles(Contents(In("a")), Contents(In("b"))), IsEmpty());
  EXPECT_EQ(ExitOf("info " + set + " >/dev/full 2>/dev/full"), kFailed);
  EXPECT_EQ(ExitOf("info nothing.dtr 2>&-"), kFailed);
  EXPECT_EQ(ExitOf("info " + set + " >&- 2>&-"), kFailed);
}

}  // namespace
}  // namespace dtr::testing
