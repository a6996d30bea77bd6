// dtr/io/set_io.h -- the D+TR set on disk (docs/FORMAT.md).
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "dtr/io/image_io.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"

namespace dtr::io {

/// Reads and checks set.json, without any pixel. Everything that can be known from the metadata is
/// checked: version, unit, sizes, finite numbers, unit quaternions, positive focal lengths,
/// near < far, depth scales, unique safe ids; every named file must lie inside the set's folder
/// (symbolic links followed) and have its size in bytes (reduced meshes may be damaged or missing:
/// see LoadPixels).
/// Throws Error naming file and field:
/// `set.json: frames[0].views[3].camera.fx_px: expected a positive number, found -1`.
DtrSet ReadSet(const std::filesystem::path& set_folder);

/// What LoadSet and LoadPixels bring into memory.
struct LoadOptions {
  bool images = true;  ///< images and masks
  bool depth = true;   ///< depth maps, and their reduced meshes where the set has them
  /// With the depth maps the completed depths (View::depth_state), for what is drawn; without them
  /// depth is what was measured.
  bool completed = false;
  bool sigma = false;  ///< standard deviations of inverse depth, where a view has them
  bool held_out =
      false;  ///< false: held-out views are left out altogether, so no renderer sees one
  bool collapse_duplicates = true;  ///< views of equal camera and content count once
  /// A view that alone takes more, 1e9 bytes, is an error before it is allocated; 0: no bound.
  double memory_gb = kImageMemoryGb;
  /// Told of what is left out of a view that loads all the same; called from any thread.
  std::function<void(const std::string&)> warn = [](const std::string&) {};
};

/// ReadSet, then the pixels of its views. Throws Error, also where they would take more memory than
/// the machine has; never gives half a set.
DtrSet LoadSet(const std::filesystem::path& set_folder, const LoadOptions& options = {});

/// Loads the pixels that `options` ask for into a view of ReadSet; `held_out` and
/// `collapse_duplicates` do not matter here. Sizes are checked against the view before any pixel is
/// read. A view without depth or sigma keeps them empty. The depth is the stored one: rounded to
/// its coding. A reduced mesh that is missing, damaged (also in a single bit: its hash is checked)
/// or of an earlier depth map is left out, which `options.warn` is called for: renderers make their
/// own.
void LoadPixels(const std::filesystem::path& set_folder, View& view, const LoadOptions& options);

/// Points and observations behind the calibration; views are indices into frames[0].views as
/// ReadSet gives them (held-out views counted). Throws Error when the set has none.
SparseScene LoadSparse(const std::filesystem::path& set_folder, const DtrSet& set);

/// Removes views whose camera, pose, role and stored content equal those of an earlier view of the
/// same frame; returns the ids of the removed. Views without content hashes are kept.
std::vector<std::string> CollapseDuplicates(DtrSet& set);

/// Reads the set, hashes every file again and compares. Returns one line per problem, empty when
/// all is well; does not throw for a damaged set.
std::vector<std::string> VerifySet(const std::filesystem::path& set_folder);

/// Unique ids, safe as file names on every system, from photo names: the name without extension,
/// other characters than letters, digits, '.', '_', '-' replaced by '_'; where two would be equal
/// (also but for case), all but the first get "_2", "_3", ... Same names, same ids.
std::vector<std::string> MakeViewIds(std::span<const std::string> names);

enum class ImageCoding {
  kPng,   ///< lossless; the default, as every figure is measured on the stored pixels
  kJpeg,  ///< quality 95, 4:4:4; source views only, held-out ones are always PNG
};

/// Writes a set, or goes on writing one that was interrupted.
///
/// All work happens in `name.dtr.partial`; Finish renames it. A run with the same fingerprint
/// resumes what an interrupted one left there; nothing is ever lost by a failure. Views may be
/// written from several threads at once; all else belongs to one thread.
class SetWriter {
 public:
  /// `target`: the set's folder (name.dtr). `fingerprint_json`: a JSON object of everything that
  /// decides the result (inputs with hashes, options, version); key order does not matter.
  /// Throws UsageError (exit 2) when `target` exists and `force` is off, when it exists and is no
  /// D+TR set, when the partial folder is of other inputs or options, or when another process
  /// writes it now.
  SetWriter(const std::filesystem::path& target, const std::string& fingerprint_json, bool force,
            ImageCoding image_coding = ImageCoding::kPng);
  /// Joins the work on a set that a process with the same fingerprint has begun, beside others that
  /// join it, each with a part of its own: RestoreView, WriteView and the folders. Finish and all
  /// else are for one that is alone. Throws as the constructor, and UsageError where nothing was
  /// begun; what is there stays in every case.
  static SetWriter Join(const std::filesystem::path& target, const std::string& fingerprint_json,
                        bool force);
  /// What the constructor says of a target that cannot be written, before any work and without
  /// touching anything. Throws UsageError.
  static void RequireTarget(const std::filesystem::path& target, bool force);
  /// Without Finish, the partial folder stays for the next run.
  ~SetWriter();
  SetWriter(const SetWriter&) = delete;
  SetWriter& operator=(const SetWriter&) = delete;
  SetWriter(SetWriter&&) noexcept;

  /// name.dtr.partial: where everything lies until Finish.
  const std::filesystem::path& folder() const;
  /// Takes the partial folder away, unless this is joined work: for what no later command could go
  /// on with.
  void Discard() noexcept;
  /// folder()/work: for checkpoints of other stages; removed by Finish.
  std::filesystem::path work_folder() const;
  /// The same of a set that is being written.
  static std::filesystem::path WorkFolderOf(const std::filesystem::path& target);
  /// True when an earlier run with this fingerprint left work behind.
  bool resumed() const;

  /// Writes the pixels that the view has in memory (image, mask, depth, sigma) and fills in their
  /// StoredFile entries; entries of pixels it does not have are kept, so an image may be written
  /// first and its depth later. Held-out views go to held_out/ and must have no depth. Fills
  /// near_z and far_z from the depth when both are 0. The pixels in memory are not changed; what
  /// LoadPixels gives later is the stored depth, rounded to its coding.
  /// Throws Error when sizes do not fit or the depth does not fit its coding or range.
  void WriteView(View& view, LengthUnit unit);

  /// True when WriteView finished this view in an earlier run, with the same camera and pose, and
  /// its files still have their hashes; then everything it recorded is put back (files, coding,
  /// scale, range, baseline, gain). Pixels are not loaded: LoadPixels(folder(), view, ...) does.
  /// The caller looks at view.depth_file to see how far the view had got.
  bool RestoreView(View& view) const;

  /// Writes the completed depth of a view whose depth was written, in the range and steps that the
  /// view names (completed_near_z, completed_far_z, completed_steps); 0 where there is none. Takes
  /// the mesh away. The checkpoint of WriteView does not have it. Throws Error where a depth is off
  /// the range.
  void WriteCompleted(const DepthImage& completed, View& view);

  /// Writes the depth that the view has in memory once more, in its coding as it is now, beside the
  /// file of before. The checkpoint of WriteView stays: a run that is interrupted goes on from the
  /// depth as that one wrote it. Takes the mesh away.
  void RecodeDepth(View& view, LengthUnit unit);

  /// Writes the image that the view has in memory as JPEG of that quality, 1...100 (4:4:4), in the
  /// place of the one before. Source views only: held-out photos are measured with.
  void WriteJpeg(View& view, int quality);

  /// Copies the files that the view's entries name from a finished set, byte by byte. Throws Error
  /// where one has another content than its entry says.
  void CopyFiles(const std::filesystem::path& set_folder, const View& view);

  /// Writes mesh/ID.bin of a view whose depth was written: its hashes are filled in here. Writing
  /// the view's depth again takes the mesh away.
  void WriteMesh(View& view, StoredMesh mesh);

  /// Writes sparse.bin; views are indices into frames[0].views.
  void WriteSparse(DtrSet& set, const SparseScene& scene);

  /// Checks everything ReadSet would, removes files the set does not name from its pixel folders,
  /// writes set.json, syncs, renames the folder to the target and removes the working files.
  /// With `force` the old set is moved aside first and deleted last.
  void Finish(DtrSet& set);

 private:
  struct State;
  explicit SetWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Writes set.json again in a finished set, atomically, for changes that touch metadata only (a
/// validation result, a baseline). Files are not touched; unknown fields stay. Throws like ReadSet.
void RewriteMetadata(const std::filesystem::path& set_folder, const DtrSet& set);

/// What a stage of a run cost.
struct RunStage {
  std::string name;
  double wall_s = 0, cpu_s = 0;
  long peak_rss_kib = 0;
};

/// report/run.json: what may differ between two runs of equal result. Outside all hashes.
struct RunRecord {
  std::vector<std::string> command;  ///< argv
  std::vector<RunStage> stages;
  int threads = 0;
  std::vector<std::string> log;  ///< lines worth keeping
};

/// Adds host (name, system, processor, cores) and the time of day, and writes report/run.json.
void WriteRunRecord(const std::filesystem::path& set_folder, const RunRecord& record);

/// For people: a summary and one line per view.
std::string DescribeSet(const DtrSet& set);
/// For machines, the output of `dtr info --json`: unit, validation, and of each view over all
/// frames id, name, role, width_px, height_px and what else it has; pretty-printed.
std::string InfoJson(const DtrSet& set);

}  // namespace dtr::io
