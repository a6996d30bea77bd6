// calib/sfm/run/workspace.h -- the folder in which structure from motion works: photos, steps,
// checkpoints, records.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/sfm/run/sfm.h"

namespace dtr::sfm {

/// Layout: images/ (links under plain names, see AliasOf), images.json (which link is which photo),
/// hashes.json (of the photos, by size and time),
/// logs/, lists/, STEP.done.json (stamps), and what the steps leave.
class Workspace {
 public:
  /// Sorts `images` by name (byte order), checks that all are there, links them.
  /// `alias_prefix` keeps photos of two workspaces apart that meet in one database. The `version`,
  /// of what finds features and matches, is part of every step's inputs.
  /// `is_shared`: see SfmOptions::folder_is_shared.
  /// Throws UsageError on duplicate names or sizes that cannot be, Error on files that are absent
  /// or cannot be linked.
  Workspace(const std::filesystem::path& folder, const std::filesystem::path& images_dir,
            std::span<const SfmImageInput> images, const std::string& alias_prefix,
            Progress& progress, std::string version, bool is_shared = false);

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path images_folder() const { return folder_ / "images"; }
  std::filesystem::path masks_folder() const { return folder_ / "masks"; }
  const std::vector<SfmImageInput>& images() const { return images_; }
  std::filesystem::path FileOf(size_t image) const { return images_folder() / AliasOf(image); }
  Progress& progress() { return progress_; }
  const std::string& version() const { return version_; }

  /// Name under which COLMAP knows images()[image]. COLMAP's lists separate names by blanks and
  /// trim them, so that photos called "my photo.jpg" could not be paired under their own names.
  std::string AliasOf(size_t image) const { return aliases_.at(image); }
  /// The same for photo number `index` of a list sorted by name.
  static std::string AliasFor(const std::string& prefix, size_t index, const std::string& name);

  /// The photo's own name. Throws Error where no photo here has this alias.
  const std::string& NameOfAlias(const std::string& alias) const;

  /// Runs `body`, which leaves its files on the disk, unless an earlier call finished the step
  /// `name` on the same inputs: photos (names, sizes, contents), version, all steps before, and
  /// `inputs` (options, as text). `is_part`: the step is not finished with it.
  void Step(const std::string& name, const std::string& inputs, const std::function<void()>& body,
            bool is_part = false);

  /// Identity of the step running now (or last begun): hash of everything it depends on.
  const std::string& fingerprint() const { return fingerprint_; }

  /// Inside a step: writes a note, on the disk when this returns, that `done` of its work is, with
  /// the runs it took. Kept() takes them over and gives `done` back where a step of the same
  /// fingerprint is begun again; nothing for a note that is absent, damaged or of other inputs.
  void Keep(const std::filesystem::path& note, size_t done) const;
  std::optional<size_t> Kept(const std::filesystem::path& note);

  /// Runs another program once inside a step: `run` fills in what the record lacks, also where it
  /// throws.
  void RunProgram(const std::function<void(StepRecord&)>& run);

  /// Runs `body`, work of this program, inside a step, and records what it cost.
  void RunHere(const std::function<void()>& body);

  /// Writes a list file (one line each) and returns its path.
  std::filesystem::path WriteList(const std::string& name, const std::vector<std::string>& lines);

  /// The program runs so far, and version; other fields of the report are the caller's.
  SfmReport Report() const;

 private:
  void LinkPhotos(const std::filesystem::path& images_dir) const;

  std::filesystem::path folder_;
  std::vector<SfmImageInput> images_;
  std::vector<std::string> aliases_;
  Progress& progress_;
  std::string version_;
  std::string fingerprint_;
  std::string step_;
  size_t first_of_step_ = 0;  // among records_
  bool ran_program_ = false;  // in this step
  std::vector<StepRecord> records_;
};

/// Writes `report` as sfm_run.json into `folder`.
void WriteReport(const std::filesystem::path& folder, const SfmReport& report);

/// Makes a folder with its parents. Throws Error when it cannot.
void MakeFolder(const std::filesystem::path& path);

}  // namespace dtr::sfm
