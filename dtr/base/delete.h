// dtr/base/delete.h -- the one place that deletes files and folders. A symbolic link is deleted
// itself, never what it leads to: somebody may have put it there, and what lies behind it is not
// ours.
#pragma once
#include <filesystem>
#include <string>

namespace dtr {

/// Deletes a file, a link or an empty folder; nothing there is fine. Throws
/// std::filesystem::filesystem_error.
void RemoveFile(const std::filesystem::path& file);
/// RemoveFile for what only takes room: false where it could not be deleted.
bool TryRemoveFile(const std::filesystem::path& file) noexcept;

/// Deletes `path` and, of a folder, everything below it. Every folder is entered by its own
/// descriptor (openat, O_NOFOLLOW), so that a link put in its place meanwhile leads nowhere.
/// Nothing there is fine. Throws std::filesystem::filesystem_error.
void RemoveTree(const std::filesystem::path& path);
/// RemoveTree for what only takes room: false where something could not be deleted.
bool TryRemoveTree(const std::filesystem::path& path) noexcept;

/// Deletes everything in `folder` but the file `kept`. Throws std::filesystem::filesystem_error,
/// also where `folder` is a link.
void ClearFolder(const std::filesystem::path& folder, const std::string& kept);

/// Deletes a folder that the file `mark` in it says is ours, and that file last: as long as
/// anything is there, it says whose it is. An empty folder needs no mark. Throws
/// std::filesystem::filesystem_error, also where `folder` is a link or holds no such file.
void RemoveFolder(const std::filesystem::path& folder, const std::string& mark);

/// Deletes all files below `folder` that IsTemporaryFile (durable.h) knows, of which no process may
/// be at work; links are not followed. Throws Error.
void RemoveTemporaryFiles(const std::filesystem::path& folder);

}  // namespace dtr
