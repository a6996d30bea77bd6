// capture/store.h -- a Capture on disk: capture.json and upright photos.
#pragma once
#include <filesystem>
#include <memory>

#include "capture/photo.h"
#include "dtr/base/progress.h"

namespace dtr::capture {

/// Name of the file that makes a folder a capture.
inline constexpr char kCaptureFile[] = "capture.json";
/// Name of the file that `dtr export` leaves in the folders that it writes.
inline constexpr char kExportFile[] = "dtr-export.json";
/// What is made in the workspace of `dtr calibrate photos` (WorkFolder's KIND): it holds images
/// that are no photos.
inline constexpr char kCalibrationKind[] = "calibration";
/// What `dtr capture` adds for people: all photos on one, and a page about them.
inline constexpr char kContactSheetFile[] = "contact_sheet.jpg";
inline constexpr char kPageFile[] = "index.html";

/// Where frames of videos lie until they are photos of the capture.
inline constexpr char kFramesFolder[] = "frames";

struct StoreOptions {
  bool replace = false;  ///< an earlier capture in the folder may be replaced
  double memory_gb = 0;  ///< of photos in memory at a time, as for IngestPhotos; 0: no bound
};

/// Writes a capture: `folder`/images/ID.EXTENSION, masks/ID.png where there are masks and,
/// last, capture.json. A photo that is upright already keeps its bytes; a turned or raw one becomes
/// a PNG with exactly its pixels. The folder appears whole or not at all: work goes on in
/// `folder`.partial, which one process at a time has and which is gone at the end unless the
/// process is killed; then the next one clears it away. A replaced capture is deleted last; one
/// that a killed process had moved aside is put back by the next. What is not ours stays.
class CaptureWriter {
 public:
  /// Throws UsageError when the folder holds something already (other than a capture to be
  /// replaced); before any work is done.
  CaptureWriter(const std::filesystem::path& folder, const StoreOptions& options);
  ~CaptureWriter();

  /// The folder in the making, for more that is to be in it; kFramesFolder in it goes at the end.
  /// Throws UsageError where it is not ours to use or another process is at work in it.
  std::filesystem::path Open();
  /// Throws Error when a photo cannot be read or a file cannot be written, else as Open.
  void Write(const Capture& capture, Progress& progress);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// All of that at once.
void WriteCapture(const Capture& capture, const std::filesystem::path& folder,
                  const StoreOptions& options, Progress& progress);
/// The same without progress.
void WriteCapture(const Capture& capture, const std::filesystem::path& folder);

/// Reads what WriteCapture wrote; `Photo::file` are the upright photos. Checks the list, not the
/// photos' bytes. Throws Error naming file and field where something is not as it must be.
Capture ReadCapture(const std::filesystem::path& folder);

}  // namespace dtr::capture
