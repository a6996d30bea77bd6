// dtr/io/held_out_files.h -- internal to dtr/io: held_out/files.json, hashes and sizes of held-out
// files.
//
// They stand apart from set.json so that no byte outside held_out/ depends on the pixels of a photo
// that was kept out: two sets made from the same sources are the same sets.
#pragma once
#include <string>

#include "dtr/types/dtr_set.h"

namespace dtr::io {

inline constexpr char kHeldOutFolder[] = "held_out/";
inline constexpr char kHeldOutFiles[] = "held_out/files.json";

/// True when a held-out view names a file without its hash, as set.json does.
bool LacksHeldOutHashes(const DtrSet& set);

/// The text of held_out/files.json; "" for a set without held-out files.
std::string HeldOutFilesJson(const DtrSet& set, const std::string& file);

/// Fills in hashes and sizes of held-out files from such a text. Throws Error, naming `file` and
/// the field, unless it lists every held-out file that lacks them once, and no other.
void MergeHeldOutFiles(const std::string& text, const std::string& file, DtrSet& set);

}  // namespace dtr::io
