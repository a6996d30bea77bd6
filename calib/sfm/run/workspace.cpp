#include "calib/sfm/run/workspace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>

#include "dtr/base/delete.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/hash.h"
#include "dtr/base/machine.h"

namespace dtr::sfm {
namespace fs = std::filesystem;
using nlohmann::json;
namespace {

constexpr std::uintmax_t kLargestStamp = 1 << 24;

std::string HashOfText(const std::string& text) { return Sha256(std::as_bytes(std::span(text))); }

json ToJson(const StepRecord& record) {
  return {{"name", record.name},
          {"argv", record.argv},
          {"exit_code", record.exit_code},
          {"signal", record.signal},
          {"wall_s", record.wall_s},
          {"cpu_s", record.cpu_s},
          {"max_rss_kib", record.max_rss_kib},
          {"log_file", record.log_file.string()},
          {"from_checkpoint", record.from_checkpoint}};
}

StepRecord FromJson(const json& j) {
  StepRecord record;
  record.name = j.at("name");
  record.argv = j.at("argv").get<std::vector<std::string>>();
  record.exit_code = j.at("exit_code");
  record.signal = j.at("signal");
  record.wall_s = j.at("wall_s");
  record.cpu_s = j.at("cpu_s");
  record.max_rss_kib = j.at("max_rss_kib");
  record.log_file = j.at("log_file").get<std::string>();
  record.from_checkpoint = true;
  return record;
}

// What vouches for work of a step: its fingerprint, the runs that it took, and how much is done.
struct Stamp {
  std::vector<StepRecord> records;
  size_t done = 0;
};

// Nothing when it is absent, damaged or of other inputs: then the work is simply done again.
std::optional<Stamp> ReadStamp(const fs::path& file, const std::string& fingerprint) {
  if (!fs::exists(file)) return std::nullopt;
  const json j = json::parse(ReadFile(file, kLargestStamp), nullptr, false);
  try {
    if (j.is_discarded() || j.at("fingerprint") != fingerprint) return std::nullopt;
    Stamp stamp;
    for (const json& record : j.at("runs")) stamp.records.push_back(FromJson(record));
    stamp.done = j.value("done", size_t{0});
    return stamp;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

void WriteStamp(const fs::path& file, const std::string& fingerprint,
                std::span<const StepRecord> records, std::optional<size_t> done) {
  json j = {{"fingerprint", fingerprint}, {"runs", json::array()}};
  for (const StepRecord& record : records) j["runs"].push_back(ToJson(record));
  if (done) j["done"] = *done;
  WriteFileAtomically(file, j.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

void Link(const fs::path& target, const fs::path& link) {
  RemoveTree(link);
  std::error_code failure;
  fs::create_symlink(fs::absolute(target), link, failure);
  if (failure) {
    throw Error(
        fmt::format("{}: cannot be linked to {}: {}; use a folder on a file system with "
                    "symbolic links",
                    link.string(), target.string(), failure.message()));
  }
}

// COLMAP writes on without a word when the disk is full: what is then missing or cut short looks
// like another fault. Throws Error when there is no room for as much as a large photo's features.
void ThrowFullDisk(const fs::path& folder, const std::string& consequence) {
  constexpr std::uintmax_t kMinBytes = std::uintmax_t{1} << 20;
  std::error_code unknown;
  const fs::space_info space = fs::space(folder, unknown);
  const bool said = consequence.find("disk is full") != std::string::npos;
  if (!said && (unknown || space.available >= kMinBytes)) return;
  throw Error(fmt::format(
      "{}: No space left on device; make room, the same command continues; what came of it: {}",
      folder.string(), consequence));
}

// Hashes of files, kept with their sizes and times.
class FileHashes {
 public:
  /// `trust`: a file whose size and time are those kept has the hash that was kept.
  FileHashes(fs::path file, bool trust) : file_(std::move(file)) {
    if (!trust || !fs::exists(file_)) return;
    const json kept = json::parse(ReadFile(file_, kLargestHashes), nullptr, false);
    if (kept.is_object()) kept_ = kept;
  }

  std::string Of(const fs::path& file) {
    const fs::path key = fs::absolute(file);
    std::error_code error;
    const auto size = fs::file_size(file, error);
    const auto time = fs::last_write_time(file, error);
    const json state = {error ? 0 : size, error ? 0 : time.time_since_epoch().count()};
    const auto kept = kept_.find(key.string());
    const bool known = !error && kept != kept_.end() && kept->is_array() && kept->size() == 2 &&
                       (*kept)[0] == state && (*kept)[1].is_string();
    const std::string hash = known ? (*kept)[1].get<std::string>() : Sha256OfFile(file);
    found_[key.string()] = {state, hash};
    return hash;
  }

  void Write() const {
    WriteFileAtomically(file_, found_.dump(0, ' ', false, json::error_handler_t::replace) + "\n");
  }

 private:
  static constexpr std::uintmax_t kLargestHashes = std::uintmax_t{1} << 30;
  fs::path file_;
  json kept_ = json::object(), found_ = json::object();
};

}  // namespace

const char* NameOf(SfmEngine engine) {
  switch (engine) {
    case SfmEngine::kColmap:
      return "colmap";
    case SfmEngine::kGlobal:
      return "global";
    case SfmEngine::kAuto:
      return "auto";
  }
  return "";
}

const char* NameOf(Matching matching) {
  switch (matching) {
    case Matching::kAuto:
      return "auto";
    case Matching::kExhaustive:
      return "exhaustive";
    case Matching::kPreselected:
      return "preselected";
    case Matching::kSequential:
      return "sequential";
  }
  return "";
}

void MakeFolder(const fs::path& path) {
  std::error_code failure;
  fs::create_directories(path, failure);
  if (failure) throw Error(path.string() + ": cannot be made: " + failure.message());
}

std::string Workspace::AliasFor(const std::string& prefix, size_t index, const std::string& name) {
  std::string extension = fs::path(name).extension().string();
  std::erase_if(extension, [](unsigned char c) { return c != '.' && std::isalnum(c) == 0; });
  return fmt::format("{}{:06}{}", prefix, index, extension);
}

Workspace::Workspace(const fs::path& folder, const fs::path& images_dir,
                     std::span<const SfmImageInput> images, const std::string& alias_prefix,
                     Progress& progress, std::string version, bool is_shared)
    : folder_(fs::absolute(folder)),
      images_(images.begin(), images.end()),
      progress_(progress),
      version_(std::move(version)) {
  std::sort(images_.begin(), images_.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  for (const char* part : {"images", "logs", "lists"}) MakeFolder(folder_ / part);
  if (!is_shared) RemoveTemporaryFiles(folder_);
  FileHashes hashes(folder_ / "hashes.json", is_shared);
  json names = json::object(), identity = json::array();
  for (size_t i = 0; i < images_.size(); ++i) {
    const SfmImageInput& image = images_[i];
    if (i > 0 && image.name == images_[i - 1].name) {
      throw UsageError(image.name + ": expected every photo once, found it twice");
    }
    if (image.width_px < 1 || image.height_px < 1) {
      throw UsageError(fmt::format("{}: expected a positive size, found {} x {}", image.name,
                                   image.width_px, image.height_px));
    }
    identity.push_back(
        {image.name, image.width_px, image.height_px, hashes.Of(images_dir / image.name)});
    if (!image.mask_file.empty()) identity.back().push_back(hashes.Of(image.mask_file));
    aliases_.push_back(AliasFor(alias_prefix, i, image.name));
    names[aliases_.back()] = image.name;
  }
  LinkPhotos(images_dir);
  constexpr int kIndent = 1;
  const auto replace = json::error_handler_t::replace;  // names need not be UTF-8
  if (!is_shared) {
    WriteFileAtomically(folder_ / "images.json", names.dump(kIndent, ' ', false, replace) + "\n");
    hashes.Write();
  }
  fingerprint_ = HashOfText(version_ + identity.dump(-1, ' ', false, replace));
}

// Touches nothing where all is as it should be.
void Workspace::LinkPhotos(const fs::path& images_dir) const {
  std::map<fs::path, fs::path> wanted;
  for (size_t i = 0; i < images_.size(); ++i) {
    wanted[FileOf(i)] = images_dir / images_[i].name;
    if (images_[i].mask_file.empty()) continue;
    MakeFolder(masks_folder());
    // COLMAP's name for it.
    wanted[masks_folder() / (AliasOf(i) + ".png")] = images_[i].mask_file;
  }
  for (const fs::path& links : {images_folder(), masks_folder()}) {
    if (!fs::exists(links)) continue;
    std::vector<fs::path> others;
    for (const auto& entry : fs::directory_iterator(links)) {
      if (!wanted.contains(entry.path())) others.push_back(entry.path());
    }
    for (const fs::path& other : others) RemoveTree(other);
  }
  for (const auto& [link, target] : wanted) {
    std::error_code none;
    if (fs::read_symlink(link, none) != fs::absolute(target)) Link(target, link);
  }
}

const std::string& Workspace::NameOfAlias(const std::string& alias) const {
  const auto found = std::find(aliases_.begin(), aliases_.end(), alias);
  if (found == aliases_.end()) {
    throw Error(fmt::format("{}: expected images of this workspace only, found '{}'",
                            folder_.string(), alias));
  }
  return images_[static_cast<size_t>(found - aliases_.begin())].name;
}

void Workspace::Step(const std::string& name, const std::string& inputs,
                     const std::function<void()>& body, bool is_part) {
  fingerprint_ = HashOfText(fingerprint_ + "\n" + name + "\n" + inputs);
  const fs::path stamp = folder_ / (name + ".done.json");
  if (const auto finished = ReadStamp(stamp, fingerprint_)) {
    records_.insert(records_.end(), finished->records.begin(), finished->records.end());
    return;
  }
  RemoveTree(stamp);
  step_ = name;
  first_of_step_ = records_.size();
  ran_program_ = false;
  try {
    body();
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& error) {
    ThrowFullDisk(folder_, error.what());
    throw;
  }
  if (is_part) return;
  // The stamp vouches for what other programs wrote, which sync nothing.
  ran_program_ ? SyncTree(folder_) : SyncFolder(folder_);
  WriteStamp(stamp, fingerprint_, std::span(records_).subspan(first_of_step_), {});
}

void Workspace::Keep(const fs::path& note, size_t done) const {
  WriteStamp(note, fingerprint_, std::span(records_).subspan(first_of_step_), done);
  SyncFolder(note.parent_path());
}

std::optional<size_t> Workspace::Kept(const fs::path& note) {
  const auto kept = ReadStamp(note, fingerprint_);
  if (!kept) return std::nullopt;
  records_.insert(records_.end(), kept->records.begin(), kept->records.end());
  return kept->done;
}

void Workspace::RunProgram(const std::function<void(StepRecord&)>& run) {
  ran_program_ = true;
  StepRecord& record = records_.emplace_back();
  record.name = step_;
  record.log_file = folder_ / "logs" / fmt::format("{:02}-{}.log", records_.size(), step_);
  try {
    run(record);
  } catch (...) {
    WriteReport(folder_, Report());  // what failed, and how, stays beside its log
    throw;
  }
}

void Workspace::RunHere(const std::function<void()>& body) {
  const double cpu_before_ms = ProcessCpuMilliseconds();
  const auto wall_before = std::chrono::steady_clock::now();
  body();
  StepRecord& record = records_.emplace_back();
  record.name = step_;
  record.wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_before).count();
  record.cpu_s = (ProcessCpuMilliseconds() - cpu_before_ms) / 1e3;
  record.max_rss_kib = static_cast<long>(PeakMemoryBytes() >> 10);
}

fs::path Workspace::WriteList(const std::string& name, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  const fs::path file = folder_ / "lists" / name;
  WriteFileAtomically(file, text);
  return file;
}

SfmReport Workspace::Report() const {
  SfmReport report;
  report.version = version_;
  report.steps = records_;
  return report;
}

void WriteReport(const fs::path& folder, const SfmReport& report) {
  json steps = json::array();
  for (const StepRecord& record : report.steps) steps.push_back(ToJson(record));
  const json j = {{"version", report.version},
                  {"steps", steps},
                  {"matching", NameOf(report.matching)},
                  {"extraction_threads", report.extraction_threads},
                  {"max_image_size_px", report.max_image_size_px},
                  {"not_registered", report.not_registered},
                  {"images_per_model", report.images_per_model},
                  {"mean_reprojection_error_px", report.mean_reprojection_error_px}};
  WriteFileAtomically(folder / "sfm_run.json",
                      j.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

}  // namespace dtr::sfm
