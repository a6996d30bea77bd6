#include "dtr/io/partial_set.h"

#include <algorithm>
#include <set>

#include "dtr/base/delete.h"
#include "dtr/base/files.h"
#include "dtr/io/hand_over.h"
#include "dtr/io/json_fields.h"
#include "dtr/io/set_json.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

constexpr char kFingerprint[] = "work/fingerprint.json";
constexpr char kLockName[] = "lock";
constexpr char kLock[] = "work/lock";
constexpr char kReportFolder[] = "report";

// "a/b.dtr/" and "a/b.dtr" are one folder; of a link it is the one that it leads to, beside which
// the work has to be.
fs::path PlaceOf(const fs::path& target) {
  const fs::path path = fs::absolute(target).lexically_normal();
  return ResolveLinks(path.has_filename() ? path : path.parent_path()).lexically_normal();
}

fs::path Beside(const fs::path& target, const std::string& suffix) {
  return target.parent_path() / (target.filename().string() + suffix);
}

std::string Canonical(const std::string& fingerprint_json, const std::string& where) {
  const Json parsed = ParseJson(fingerprint_json, where);
  if (!parsed.is_object()) throw Error(where + ": expected a JSON object");
  return nlohmann::json(parsed).dump(2) + "\n";  // sorts the keys
}

// The names of what differs in two canonical fingerprints; empty where one is none.
std::string DifferingKeys(const std::string& a, const std::string& b) {
  const nlohmann::json left = nlohmann::json::parse(a, nullptr, false),
                       right = nlohmann::json::parse(b, nullptr, false);
  if (!left.is_object() || !right.is_object()) return "";
  std::set<std::string> keys;
  for (const auto* side : {&left, &right}) {
    for (const auto& [key, value] : side->items()) {
      if (left.value(key, nlohmann::json()) != right.value(key, nlohmann::json())) keys.insert(key);
    }
  }
  std::string names;
  for (const std::string& key : keys) names += (names.empty() ? "" : ", ") + key;
  return names;
}

// COLMAP finds the photos by links in its workspace, which nothing is written through.
bool IsLinkToPhoto(const fs::path& inside) {
  const std::string folder = inside.parent_path().filename().string();
  return *inside.begin() == kWork && (folder == "images" || folder == "masks");
}

// True when a partial folder has more in it than what the constructor itself puts there. What a
// killed process had not finished to write is nobody's work.
bool HoldsWork(const fs::path& partial) {
  for (const auto& entry : fs::recursive_directory_iterator(partial)) {
    const fs::path inside = entry.path().lexically_relative(partial);
    if (entry.is_directory() || IsTemporaryFile(inside)) continue;
    const bool is_lock = inside == kLock || inside.extension() == ".lock";
    if (inside != kFingerprint && !is_lock) return true;
  }
  return false;
}

}  // namespace

PartialSet::PartialSet(const fs::path& set, bool replace)
    : target(PlaceOf(set)),
      partial(Beside(target, ".partial")),
      aside(Beside(target, ".replaced")),
      done_work(Beside(target, ".partial.work")),
      force(replace) {}

fs::path WorkFolderOf(const fs::path& target) { return PartialSet(target, false).partial / kWork; }

// What lies beside the target under a name of ours may have been put there by somebody else.
void PartialSet::RejectLinksBeside() const {
  RejectLinks(partial, IsLinkToPhoto);
  RejectLinks(aside);
  RejectLinks(done_work, [](const fs::path& inside) { return IsLinkToPhoto(kWork / inside); });
}

bool PartialSet::WasCutOff() const { return fs::exists(aside / kSetFile) || fs::exists(done_work); }

void PartialSet::RemoveUnused() const {
  try {
    if (!HoldsWork(partial)) TryRemoveTree(partial);
  } catch (const fs::filesystem_error&) {
    // The folder was taken away while we worked; there is nothing left to tidy.
  }
}

// A replacement that was cut off between its two renames: the old set goes back.
void PartialSet::Recover() const {
  RejectLinksBeside();
  RecoverWork();
  if (!fs::exists(aside / kSetFile)) return;
  if (fs::exists(target / kSetFile)) {
    RemoveFolder(aside, kSetFile);  // what it is known by goes last
  } else if (!fs::exists(target) || IsEmptyFolder(target)) {
    Rename(aside, target);
  }  // what is no set took its place: both stay
}

// A set that was cut off on its way into place has its checkpoints beside it: they go back to one
// that is not there yet, and are of no more use to one that is.
void PartialSet::RecoverWork() const {
  const bool ours = fs::exists(done_work / kLockName);
  if (!ours && !IsEmptyFolder(done_work)) return;
  const std::optional<FileLock> nobody_at_work = Lock(done_work / kLockName);
  if (fs::exists(partial) && !fs::exists(partial / kWork)) {
    Rename(done_work, partial / kWork);
  } else {
    RemoveFolder(done_work, kLockName);
  }
}

void PartialSet::ExpectReplaceable() const {
  if (!fs::exists(fs::symlink_status(target))) return;
  if (!fs::is_directory(target)) {
    throw UsageError(target.string() + ": expected no such folder yet, found a file; " +
                     "choose another name");
  }
  if (!force) {
    throw UsageError(target.string() + ": expected no such folder yet, found one; " +
                     "choose another name or pass `force` to replace it");
  }
  if (!IsEmptyFolder(target) && !fs::is_regular_file(target / kSetFile)) {
    throw UsageError(target.string() + ": expected a D+TR set to replace, found something else; " +
                     "it is left alone");
  }
  RejectForeign(target, [](const std::string& name) {
    return name == kSetFile || name == kSparseFile || name == kReportFolder ||
           std::find(std::begin(kPixelFolders), std::end(kPixelFolders), name) !=
               std::end(kPixelFolders);
  });
  if (fs::is_directory(target / kReportFolder)) {
    RejectForeign(target / kReportFolder, [](const std::string& name) {
      return name == "index.html" || name == "run.json";
    });
  }
  // At the end of the work the old set would find no room.
  if (fs::exists(fs::symlink_status(aside)) && !IsEmptyFolder(aside)) {
    throw UsageError(aside.string() + ": expected nothing, for " + target.string() +
                     " to make room for the new set; move it away");
  }
}

std::optional<FileLock> PartialSet::Lock(const fs::path& file) const {
  if (auto taken = FileLock::Try(file)) return taken;
  throw UsageError(partial.string() + ": another process is writing this set; wait for it");
}

void PartialSet::Open(const std::string& fingerprint_json) {
  const std::string fingerprint = Canonical(fingerprint_json, "fingerprint");
  std::error_code error;
  if (fs::exists(partial) && !fs::is_directory(partial)) {
    throw UsageError(partial.string() +
                     ": expected a folder or nothing, found a file; move it away");
  }
  const bool foreign =
      fs::exists(partial) && HoldsWork(partial) && !fs::exists(partial / kFingerprint);
  if (!foreign) fs::create_directories(partial / kWork, error);
  if (error) throw Error(partial.string() + ": cannot be made: " + error.message());
  if (!foreign) lock = Lock(partial / kLock);
  const bool holds_work = HoldsWork(partial);
  if (holds_work) ExpectFingerprint(fingerprint);
  RemoveTemporaryFiles(partial);  // of a run that was killed
  resumed = holds_work;
  if (!resumed) WriteFileAtomically(partial / kFingerprint, fingerprint);
}

void PartialSet::Join(const std::string& fingerprint_json) {
  const std::string fingerprint = Canonical(fingerprint_json, "fingerprint");
  RejectLinks(partial, IsLinkToPhoto);
  if (!fs::exists(partial / kFingerprint)) {
    throw UsageError(partial.string() +
                     ": expected a build to join, found none; run its stage capture first");
  }
  lock = FileLock::Try(partial / kLock, FileLock::Kind::kShared);
  if (!lock) {
    throw UsageError(partial.string() +
                     ": another process is writing the whole of this set; wait for it");
  }
  ExpectFingerprint(fingerprint);
  resumed = joined = true;
}

void PartialSet::ExpectFingerprint(const std::string& fingerprint) const {
  const bool foreign = !fs::exists(partial / kFingerprint);
  const std::string found = foreign ? "" : ReadFile(partial / kFingerprint, kRecordLimitBytes);
  if (found == fingerprint) return;
  const std::string differ = DifferingKeys(found, fingerprint);
  throw UsageError(partial.string() + ": expected work of the same inputs and options, found " +
                   "others" + (differ.empty() ? "" : " (" + differ + " differ)") +
                   "; run that command again to finish it, or delete the folder");
}

void PartialSet::HandOver(const std::string& from_json, const std::string& to_json) const {
  const std::string from = Canonical(from_json, "fingerprint");
  const std::string to = Canonical(to_json, "fingerprint");
  if (!fs::exists(partial / kFingerprint)) return;
  if (ReadFile(partial / kFingerprint, kRecordLimitBytes) != from) return;
  WriteFileAtomically(partial / kFingerprint, to);
}

void HandOver(const fs::path& target, const std::string& from_json, const std::string& to_json) {
  const PartialSet set(target, false);
  AsError([&] { set.HandOver(from_json, to_json); });
}

void Recover(const fs::path& target) {
  const PartialSet set(target, false);
  AsError([&] { set.Recover(); });
}

void PartialSet::MoveIntoPlace() {
  ExpectReplaceable();
  const bool replace = fs::exists(target);
  // A finished set never has checkpoints in it: they leave first (Recover() knows every moment).
  Rename(partial / kWork, done_work);
  try {
    SyncTree(partial);
    if (replace) Rename(target, aside);
    Rename(partial, target);
  } catch (...) {
    if (replace && !fs::exists(target)) Rename(aside, target);
    Rename(done_work, partial / kWork);
    throw;
  }
  SyncFolder(target.parent_path());
  finished = true;
  try {
    RemoveFolder(done_work, kLockName);
    if (replace) RemoveFolder(aside, kSetFile);
  } catch (const fs::filesystem_error& error) {
    throw Error(target.string() + ": finished, but what it no longer needs cannot be deleted: " +
                error.code().message());
  }
}

}  // namespace dtr::io
