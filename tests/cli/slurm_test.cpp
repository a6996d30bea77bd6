// dtr batch with Slurm for real: its daemons on this machine alone, a node whose job is killed.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <thread>
#include <tuple>

#include "dtr/base/process.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

std::vector<std::string> OutputOf(const std::vector<std::string>& argv) {
  std::vector<std::string> lines;
  ProcessOptions options;
  options.on_line = [&](const std::string& line) { lines.push_back(line); };
  RunProcess(argv, options);
  return lines;
}

template <typename Condition>
bool Within(seconds limit, const Condition& holds) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  return true;
}

// slurmctld and slurmd on the loopback interface, without any service or key.
class Cluster {
 public:
  explicit Cluster(const fs::path& folder) {
    for (const char* part : {"state", "spool"}) fs::create_directories(folder / part);
    char host[256] = "";
    gethostname(host, sizeof host - 1);
    std::ofstream conf(folder / "slurm.conf");
    conf << "ClusterName=test\nSlurmctldHost=" << host << "(127.0.0.1)\n"
         << "SlurmUser=root\nSlurmdUser=root\nAuthType=auth/none\nCredType=cred/none\n"
         << "ProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\n"
         << "JobAcctGatherType=jobacct_gather/none\nSelectType=select/cons_tres\n"
         << "SelectTypeParameters=CR_Core_Memory\n"
         << "AccountingStorageType=accounting_storage/none\nMpiDefault=none\nReturnToService=2\n"
         << "SlurmctldPort=16917\nSlurmdPort=16918\nMaxArraySize=6\n"
         << "StateSaveLocation=" << (folder / "state").string() << "\n"
         << "SlurmdSpoolDir=" << (folder / "spool").string() << "\n"
         << "SlurmctldPidFile=" << (folder / "ctld.pid").string() << "\n"
         << "SlurmdPidFile=" << (folder / "d.pid").string() << "\n"
         << "NodeName=" << host << " NodeAddr=127.0.0.1 CPUs=2 RealMemory=4000 State=UNKNOWN\n"
         << "PartitionName=all Nodes=" << host << " Default=YES MaxTime=INFINITE State=UP\n";
    conf.close();
    setenv("SLURM_CONF", (folder / "slurm.conf").c_str(), 1);
    daemons_ = {Start({"slurmctld", "-D", "-c"}, folder / "ctld.log"),
                Start({"slurmd", "-D"}, folder / "d.log")};
  }
  ~Cluster() {
    for (const pid_t daemon : daemons_) kill(daemon, SIGTERM);
    for (const pid_t daemon : daemons_) waitpid(daemon, nullptr, 0);
    unsetenv("SLURM_CONF");
  }
  Cluster(const Cluster&) = delete;
  Cluster& operator=(const Cluster&) = delete;

  static bool IsInstalled() {
    return !FindProgram("slurmctld").empty() && !FindProgram("slurmd").empty() &&
           !FindProgram("sbatch").empty() && geteuid() == 0;
  }
  static bool IsIdle() {
    const auto lines = OutputOf({"sinfo", "--noheader", "--format=%T"});
    return lines.size() == 1 && lines.front() == "idle";
  }
  static bool IsEmpty() { return OutputOf({"squeue", "--noheader"}).empty(); }

 private:
  static pid_t Start(std::vector<std::string> argv, const fs::path& log) {
    const pid_t child = fork();
    if (child != 0) return child;
    std::ignore = freopen(log.c_str(), "w", stdout);
    std::ignore = freopen(log.c_str(), "w", stderr);
    std::vector<char*> words;
    for (std::string& word : argv) words.push_back(word.data());
    words.push_back(nullptr);
    execvp(words.front(), words.data());
    _exit(127);
  }
  std::vector<pid_t> daemons_;
};

// A process that does a part for this set; 0 where there is none.
pid_t ProcessOf(const std::string& stage, const fs::path& set) {
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream file(entry.path() / "cmdline", std::ios::binary);
    const std::string words((std::istreambuf_iterator<char>(file)), {});
    if (words.find(set.string()) != std::string::npos &&
        words.find(std::string("--stage") + '\0' + stage + '\0') != std::string::npos) {
      return std::stoi(name);
    }
  }
  return 0;
}

TEST(Slurm, JobsOfWhichOneIsKilledGiveTheBytesOfABuildInTheEnd) {
  if (!Cluster::IsInstalled()) GTEST_SKIP() << "needs slurmctld, slurmd, slurm-client, and root";
  const TemporaryFolder folder;
  const Cluster cluster(folder / "slurm");
  ASSERT_TRUE(Within(seconds(60), [] { return Cluster::IsIdle(); })) << "the node never got ready";
  const Ran made =
      Dtr({"dataset", "make", "courtyard", "-o", (folder / "courtyard").string(), "--layout", "arc",
           "--views", "24", "--width", "192", "--height", "128", "--supersampling", "1"});
  ASSERT_EQ(made.code, 0) << made.err;
  const auto words = [&](const char* command, const fs::path& set) {
    return std::vector<std::string>{command,    (folder / "courtyard/images").string(),
                                    "--poses",  (folder / "courtyard/cameras.json").string(),
                                    "--passes", "1",
                                    "--memory", "0.8",
                                    "-o",       set.string()};
  };
  fs::create_directories(folder / "plain");
  fs::create_directories(folder / "batch");
  DtrOk(words("build", folder / "plain/set.dtr"));

  const fs::path set = folder / "batch/set.dtr";
  std::vector<std::string> batch = words("batch", set);
  // More parts than an array of this cluster may have.
  batch.insert(batch.end(), {"--slurm", "--array-size", "8", "--partition", "all"});
  const Ran submitted = DtrByItself(batch);
  ASSERT_EQ(submitted.code, 0) << submitted.err;
  pid_t victim = 0;
  ASSERT_TRUE(Within(
      seconds(300), [&] { return (victim = ProcessOf("search", set)) > 0 || Cluster::IsEmpty(); }));
  ASSERT_GT(victim, 0) << DtrByItself({"batch", "status", set.string()}).out;
  kill(victim, SIGKILL);
  ASSERT_TRUE(Within(seconds(300), [] { return Cluster::IsEmpty(); }));
  const Ran status = DtrByItself({"batch", "status", set.string()});
  EXPECT_NE((status.out + status.err).find("failed: search, part"), std::string::npos)
      << status.out << status.err;
  EXPECT_FALSE(fs::exists(set));

  const Ran resumed = DtrByItself({"batch", "resume", set.string()});
  ASSERT_EQ(resumed.code, 0) << resumed.err;
  ExpectRejected(DtrByItself(batch), 2, "of its parts are waiting or running");
  ASSERT_TRUE(Within(seconds(400), [] { return Cluster::IsEmpty(); }));
  EXPECT_THAT(DifferingFiles(Contents(folder / "plain/set.dtr"), Contents(set)),
              ::testing::IsEmpty());
}

}  // namespace
}  // namespace dtr::testing
