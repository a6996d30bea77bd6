// calib/colmap/program.h -- COLMAP as a program: its version, its options, one run of it.
#pragma once
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "calib/sfm/run/colmap_steps.h"
#include "calib/sfm/run/workspace.h"

namespace dtr::colmap {

/// The `colmap` on the PATH. What its commands understand is asked of the program itself, since
/// options were renamed between versions (SiftExtraction.use_gpu became FeatureExtraction.use_gpu)
/// and distributions patch version strings.
class Program {
 public:
  /// Throws Error when there is no colmap on the PATH or it does not answer `help`.
  Program();

  /// Whether there is a colmap on the PATH at all.
  static bool IsInstalled();
  static sfm::ColmapState Find();

  const std::string& version() const { return version_; }
  /// Whether it was built with CUDA, by its own words.
  bool has_cuda() const { return has_cuda_; }

  /// The first of `names` that `command` understands, or nullptr.
  const char* FindOption(const std::string& command, std::initializer_list<const char*> names);

 private:
  std::string version_;
  bool has_cuda_ = false;
  std::map<std::string, std::set<std::string>> options_;  // by command, as asked so far
};

/// An argument list for one command, checked against what this COLMAP understands.
class Arguments {
 public:
  explicit Arguments(const std::string& command);

  /// Adds `--name value`; of several names (oldest first) the one this version understands.
  /// Throws Error when it understands none.
  Arguments& Add(std::initializer_list<const char*> names, const std::string& value);
  /// The same, leaving the option out where the version does not have it.
  Arguments& AddIfKnown(std::initializer_list<const char*> names, const std::string& value);

  const std::vector<std::string>& argv() const { return argv_; }

 private:
  Program program_;
  std::string command_;
  std::vector<std::string> argv_;
};

/// COLMAP starts from two photos that see the scene from 16 degrees apart, or 4 where it finds
/// none, and not along the line of sight. A walk straight ahead through a street has no such pair.
/// Its points are seen under small angles throughout, so they are kept under smaller ones, too, and
/// fewer of them must agree with a pose. Adds, of what says so, the options that the command has.
void AllowForwardMotion(Arguments& arguments);

/// Runs COLMAP once, its output going to `record.log_file` and line by line to `on_line`. The rest
/// of `record` but its name is filled in, also when this throws.
/// Throws Interrupted when `progress` asks to stop (the program is ended first), and Error, naming
/// step, cause and log, unless the program exits with 0.
void RunColmap(const std::vector<std::string>& argv, sfm::StepRecord& record,
               const std::function<void(const std::string&)>& on_line, Progress& progress);

/// The same inside a step of a workspace, whose database that is.
void RunStep(sfm::Workspace& workspace, const Arguments& arguments,
             const std::function<void(const std::string&)>& on_line);
inline std::filesystem::path DatabaseOf(const sfm::Workspace& workspace) {
  return workspace.folder() / "database.db";
}

/// Reads a model COLMAP made in a workspace and gives the images their own names back.
calib::SfmModel ReadModelHere(const sfm::Workspace& workspace, const std::filesystem::path& folder);

}  // namespace dtr::colmap
