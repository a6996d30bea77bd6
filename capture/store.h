// capture/store.h -- a Capture on disk: capture.json and upright photos.
#pragma once
#include <filesystem>

#include "capture/photo.h"
#include "dtr/base/progress.h"

namespace dtr::capture {

/// Name of the file that makes a folder a capture.
inline constexpr char kCaptureFile[] = "capture.json";
/// What `dtr capture` adds for people: all photos on one, and a page about them.
inline constexpr char kContactSheetFile[] = "contact_sheet.jpg";
inline constexpr char kPageFile[] = "index.html";

struct StoreOptions {
  bool replace = false;  ///< an earlier capture in the folder may be replaced
  int threads = 0;       ///< 0: all cores
};

/// Throws UsageError where WriteCapture would for want of an empty place; before any work is done.
void RequireRoom(const std::filesystem::path& folder, const StoreOptions& options);

/// Writes `folder`/images/<id>.<extension>, masks/<id>.png where there are masks and, last,
/// `folder`/capture.json. A photo that is upright already keeps its bytes; a turned one becomes a
/// PNG with exactly its pixels. The folder appears whole or not at all: work goes on in
/// `folder`.partial. Throws UsageError when the folder holds something already (other than a
/// capture to be replaced), Error when a photo cannot be read or a file cannot be written.
void WriteCapture(const Capture& capture, const std::filesystem::path& folder,
                  const StoreOptions& options, Progress& progress);
/// The same without progress.
void WriteCapture(const Capture& capture, const std::filesystem::path& folder, int threads);

/// Reads what WriteCapture wrote; `Photo::file` are the upright photos. Checks the list, not the
/// photos' bytes. Throws Error naming file and field where something is not as it must be.
Capture ReadCapture(const std::filesystem::path& folder);

}  // namespace dtr::capture
