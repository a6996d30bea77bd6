// tests/cli/run_dtr.h -- starts the built `dtr` program and looks at what it leaves behind.
#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace dtr::testing {

/// Exit codes beside 0, done.
inline constexpr int kFailed = 1, kWrongUsage = 2;

/// How a run of the program ended.
struct Ran {
  int code = 0;    ///< exit code; meaningful when signal == 0
  int signal = 0;  ///< the signal that ended it, or 0
  std::string out, err;

  std::vector<std::string> ErrorLines() const;  ///< lines of stderr that begin with "dtr: "
};

/// Sends `signal` once `when` is true; it is asked every millisecond.
struct Interruption {
  int signal = 0;
  std::function<bool()> when;
};

/// Runs `dtr ARGS...` with the environment as it is; forked from a server (program_server.h) where
/// nothing interrupts it.
Ran Dtr(const std::vector<std::string>& args, const Interruption& interruption = {});

/// Dtr() in a process of its own, whose command line the system knows (/proc).
Ran DtrByItself(const std::vector<std::string>& args, const Interruption& interruption = {});

/// Runs it and expects exit code 0.
Ran DtrOk(const std::vector<std::string>& args);

/// Whether a run did its work, though the calibration that it made or looked at may fail its tests.
bool IsDone(const Ran& ran);

/// Runs `calibrate board` or `rig`, and expects that it did its work.
Ran DtrCalibrated(const std::vector<std::string>& args);

/// Expects a rejection: this exit code, one line that begins with "dtr: ", the last one on stderr,
/// with `text` in it.
void ExpectRejected(const Ran& ran, int code, const std::string& text);

/// Bytes of every file below `folder` by relative path; report/run.json, which holds times and is
/// outside all hashes, is left out.
std::map<std::string, std::string> Contents(const std::filesystem::path& folder);

/// Names of the files that differ between two folders, or are in one of them only.
std::vector<std::string> DifferingFiles(const std::map<std::string, std::string>& a,
                                        const std::map<std::string, std::string>& b);

/// Number of files in a folder; 0 when it is not there.
int FilesIn(const std::filesystem::path& folder);

std::string Text(const std::filesystem::path& file);

/// A set of the folder that MakeSmallCourtyard made: true depth, every 4th view held out.
void ImportSmallCourtyard(const std::filesystem::path& courtyard, const std::filesystem::path& set);

}  // namespace dtr::testing
