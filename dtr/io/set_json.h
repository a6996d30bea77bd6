// dtr/io/set_json.h -- internal to dtr/io: DtrSet and its text in set.json, no file but the text.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/io/json_fields.h"
#include "dtr/types/dtr_set.h"

namespace dtr::io {

inline constexpr char kSetFile[] = "set.json";
inline constexpr int kNewestFormatVersion = 2;  ///< that is read
/// The lowest version whose readers know all that the set has: 2 where files are differences to a
/// base or frames of a video, else 1.
int FormatVersionOf(const DtrSet& set);

/// Parses and checks everything that needs no other file. `file` stands in front of every error.
/// Files of held-out views come without hash and size (dtr/io/held_out_files.h).
DtrSet SetFromJson(const std::string& text, const std::string& file);
/// The text of set.json. Checked by reading it back, so what is written can be read. Throws Error.
std::string JsonFromSet(const DtrSet& set, const std::string& file);

/// One view alone, for checkpoints; the same fields as in set.json, hashes of held-out files too.
std::string JsonFromView(const View& view, const std::string& file);
View ViewFromJson(const std::string& text, const std::string& file);

/// One entry `{"path", "sha256", "bytes"}`. Reading throws Error naming the field.
StoredFile StoredFileFromJson(const JsonObject& object);
Json JsonFromStoredFile(const StoredFile& file);

/// Letters, digits, '.', '_', '-', not starting with '.', at most 200 characters.
bool IsSafeId(const std::string& id);

/// A file that a set names, and the field that names it.
struct NamedFile {
  const StoredFile* file = nullptr;
  std::string field;
  bool only_saves_time = false;  ///< a set is whole without it: made of what else is there
};
/// All files a set names.
std::vector<NamedFile> FilesOf(const DtrSet& set);

/// Throws Error unless every named file lies inside the folder, also when symbolic links are
/// followed, and, where it does not only save time, has its size.
void ExpectFiles(const std::filesystem::path& set_folder, const DtrSet& set);
/// The problem of one file, or "".
std::string ProblemOf(const std::filesystem::path& set_folder, const NamedFile& named);

}  // namespace dtr::io
