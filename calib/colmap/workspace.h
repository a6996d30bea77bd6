// calib/colmap/workspace.h -- the folder in which COLMAP works: photos, steps, checkpoints,
// records.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/colmap/program.h"
#include "calib/colmap/sfm.h"

namespace dtr::colmap {

/// Layout: images/ (links under plain names, see AliasOf), images.json (which link is which photo),
/// hashes.json (of the photos, by size and time),
/// logs/, lists/, STEP.done.json (stamps), database.db, and what the steps leave.
class Workspace {
 public:
  /// Sorts `images` by name (byte order), checks that all are there, links them.
  /// `alias_prefix` keeps photos of two workspaces apart that meet in one database. With the engine
  /// kColmap its version is part of every step's inputs; with others COLMAP may be missing.
  /// `is_shared`: see SfmOptions::folder_is_shared.
  /// Throws UsageError on duplicate names or sizes that cannot be, Error on files that are absent
  /// or cannot be linked.
  Workspace(const std::filesystem::path& folder, const std::filesystem::path& images_dir,
            std::span<const SfmImageInput> images, const std::string& alias_prefix, int threads,
            Progress& progress, SfmEngine engine = SfmEngine::kColmap, bool is_shared = false);

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path images_folder() const { return folder_ / "images"; }
  std::filesystem::path masks_folder() const { return folder_ / "masks"; }
  std::filesystem::path database() const { return folder_ / "database.db"; }
  const std::vector<SfmImageInput>& images() const { return images_; }
  std::filesystem::path FileOf(size_t image) const { return images_folder() / AliasOf(image); }
  /// COLMAP, asked for when first needed. Throws Error where it is missing.
  Program& program();
  Progress& progress() { return progress_; }
  /// Of what finds features and matches here: COLMAP's, or kOwnVersion.
  std::string version() const;
  int threads() const { return threads_; }

  /// Name under which COLMAP knows images()[image]. COLMAP's lists separate names by blanks and
  /// trim them, so that photos called "my photo.jpg" could not be paired under their own names.
  std::string AliasOf(size_t image) const { return aliases_.at(image); }
  /// The same for photo number `index` of a list sorted by name.
  static std::string AliasFor(const std::string& prefix, size_t index, const std::string& name);

  /// The photo's own name. Throws Error where no photo here has this alias.
  const std::string& NameOfAlias(const std::string& alias) const;

  /// Reads a model COLMAP made here and gives the images their own names back.
  calib::SfmModel ReadModelHere(const std::filesystem::path& folder) const;
  /// The inverse: writes a model for COLMAP to read. Every image must be one of images().
  void WriteModelHere(const std::filesystem::path& folder, calib::SfmModel model) const;

  /// Runs `body` unless an earlier call finished the step `name` on the same inputs: photos (names,
  /// sizes, contents), COLMAP's version, all steps before, and `inputs` (options, as text).
  /// `is_part`: the step is not finished with it.
  void Step(const std::string& name, const std::string& inputs, const std::function<void()>& body,
            bool is_part = false);

  /// Identity of the step running now (or last begun): hash of everything it depends on.
  const std::string& fingerprint() const { return fingerprint_; }

  /// Inside a step: writes a note, on the disk when this returns, that `done` of its work is, with
  /// the runs it took. Kept() takes them over and gives `done` back where a step of the same
  /// fingerprint is begun again; nothing for a note that is absent, damaged or of other inputs.
  void Keep(const std::filesystem::path& note, size_t done) const;
  std::optional<size_t> Kept(const std::filesystem::path& note);

  /// Runs COLMAP once inside a step; see RunColmap.
  void Run(const Arguments& arguments, const std::function<void(const std::string&)>& on_line);

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
  int threads_;
  Progress& progress_;
  SfmEngine engine_;
  std::optional<Program> program_;
  std::string fingerprint_;
  std::string step_;
  size_t first_of_step_ = 0;  // among records_
  std::vector<StepRecord> records_;
};

/// Writes `report` as sfm_run.json into `folder`.
void WriteReport(const std::filesystem::path& folder, const SfmReport& report);

/// Makes a folder with its parents. Throws Error when it cannot.
void MakeFolder(const std::filesystem::path& path);

}  // namespace dtr::colmap
