#include "dtr/io/still_once.h"

#include <algorithm>
#include <atomic>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "dtr/base/files.h"
#include "dtr/base/hash.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/code_bands.h"
#include "dtr/io/code_differences.h"
#include "dtr/io/depth_io.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
using Codes = Grid<std::uint16_t>;

constexpr double kBytesPerPixel = 24;  // common codes, those of a time step, and what they become

/// A kind of data that is 16-bit codes.
struct Kind {
  const char* folder;
  std::optional<StoredFile> View::*file;
  std::optional<StoredFile> View::*base;
  /// What views must have in common for their codes to mean the same; empty: it has no such codes.
  std::string (*coding)(const View&);
  /// Nothing where the numbers do not fit 16 bits.
  std::optional<Codes> (*codes)(const fs::path& set_folder, const View&);
};

std::string CodingOf(const DepthFormat& format) {
  std::ostringstream text;
  text.precision(17);  // tells any two doubles apart
  text << format.near_z << " " << format.far_z << " " << StepsOf(format);
  return text.str();
}

std::string DepthCodingOf(const View& view) {
  const bool in_steps = view.depth_coding == DepthCoding::kPng16InverseDepth ||
                        view.depth_coding == DepthCoding::kZstdInverseDepth;
  return in_steps ? CodingOf(FormatOf(view, LengthUnit::kUnknown)) : "";
}

std::optional<Codes> DepthCodesOf(const fs::path& set_folder, const View& view) {
  const PinholeCamera camera = view.DepthCamera();
  return ReadDepthCodes(set_folder / view.depth_file->path, FormatOf(view, LengthUnit::kUnknown),
                        camera.width_px(), camera.height_px());
}

std::string CompletedCodingOf(const View& view) { return CodingOf(CompletedFormatOf(view)); }

std::optional<Codes> CompletedCodesOf(const fs::path& set_folder, const View& view) {
  const PinholeCamera camera = view.DepthCamera();
  return ReadDepthCodes(set_folder / view.completed_file->path, CompletedFormatOf(view),
                        camera.width_px(), camera.height_px());
}

std::string SigmaCodingOf(const View&) { return "bfloat16"; }

std::optional<Codes> SigmaCodesOf(const fs::path& set_folder, const View& view) {
  const PinholeCamera camera = view.DepthCamera();
  return SigmaCodes(
      ReadSigma(set_folder / view.sigma_file->path, camera.width_px(), camera.height_px()));
}

constexpr Kind kKinds[] = {
    {"depth", &View::depth_file, &View::depth_base, DepthCodingOf, DepthCodesOf},
    {"completed", &View::completed_file, &View::completed_base, CompletedCodingOf,
     CompletedCodesOf},
    {"sigma", &View::sigma_file, &View::sigma_base, SigmaCodingOf, SigmaCodesOf},
};

/// Time steps of one camera, in their order.
struct CameraOverTime {
  const Kind* kind;
  std::vector<View*> views;
};

std::vector<CameraOverTime> CamerasOf(DtrSet& set) {
  std::map<std::string, CameraOverTime> cameras;
  for (const Kind& kind : kKinds) {
    for (Frame& frame : set.frames) {
      for (View& view : frame.views) {
        if (!(view.*kind.file) || view.*kind.base) continue;
        const std::string coding = kind.coding(view);
        if (coding.empty()) continue;
        const PinholeCamera camera = view.DepthCamera();
        std::ostringstream key;
        key << kind.folder << " " << camera.width_px() << " " << camera.height_px() << " " << coding
            << " " << view.name;
        CameraOverTime& of_camera = cameras[key.str()];
        of_camera.kind = &kind;
        of_camera.views.push_back(&view);
      }
    }
  }
  std::vector<CameraOverTime> list;
  for (auto& [key, camera] : cameras) {
    if (camera.views.size() > 1) list.push_back(std::move(camera));
  }
  return list;
}

/// At each pixel the code that more than half of the images have, if there is one (Boyer and Moore,
/// MJRTY, 1981): one image in memory at a time.
class CommonCodes {
 public:
  void Add(const Codes& codes) {
    if (count_.empty()) {
      common_ = codes;
      count_ = Codes(codes.width(), codes.height(), 1, 1);
      return;
    }
    for (size_t p = 0; p < codes.data().size(); ++p) {
      std::uint16_t& count = count_.data()[p];
      if (count == 0) common_.data()[p] = codes.data()[p];
      if (codes.data()[p] != common_.data()[p]) {
        --count;
      } else if (count < UINT16_MAX) {
        ++count;
      }
    }
  }
  const Codes& codes() const { return common_; }

 private:
  Codes common_, count_;
};

StoredFile Written(const fs::path& set_folder, const std::string& path, const std::string& bytes) {
  fs::create_directories((set_folder / path).parent_path());
  WriteFileAtomically(set_folder / path, bytes);
  return {path, Sha256(std::as_bytes(std::span(bytes))), bytes.size()};
}

/// Bytes of files, equal ones counted once, as sets store them once.
class DistinctBytes {
 public:
  void Add(const StoredFile& file) {
    if (counted_.insert(file.sha256).second) sum_ += file.bytes;
  }
  std::uint64_t sum() const { return sum_; }

 private:
  std::set<std::string> counted_;
  std::uint64_t sum_ = 0;
};

/// Empty where the numbers of a time step do not fit.
std::optional<Codes> CommonCodesOf(const fs::path& set_folder, const CameraOverTime& camera) {
  CommonCodes common;
  for (const View* view : camera.views) {
    const auto codes = camera.kind->codes(set_folder, *view);
    if (!codes) return {};
    common.Add(*codes);
  }
  return common.codes();
}

void StoreOnce(const fs::path& set_folder, const CameraOverTime& camera) {
  const Kind& kind = *camera.kind;
  const auto common = CommonCodesOf(set_folder, camera);
  if (!common) return;
  const std::string folder = kind.folder;
  const StoredFile base =
      Written(set_folder, "still/" + folder + "/" + camera.views.front()->id + ".dtz",
              EncodeBands(*common));
  DistinctBytes before, after;
  after.Add(base);
  std::vector<StoredFile> files;
  for (const View* view : camera.views) {
    const auto codes = kind.codes(set_folder, *view);
    files.push_back(Written(set_folder, folder + "/" + view->id + ".dtd",
                            EncodeDifferences(*codes, *common, base.sha256)));
    before.Add(*(view->*kind.file));
    after.Add(files.back());
  }
  if (after.sum() >= before.sum()) return;
  for (size_t i = 0; i < files.size(); ++i) {
    View& view = *camera.views[i];
    view.*kind.file = files[i];
    view.*kind.base = base;
    if (kind.file == &View::depth_file) {
      view.depth_steps = StepsOf(FormatOf(view, LengthUnit::kUnknown));
      view.depth_coding = DepthCoding::kZstdInverseDepth;
    }
  }
}

}  // namespace

void StoreStillOnce(const fs::path& set_folder, DtrSet& set, double memory_gb, Progress& progress) {
  MemoryBudget memory(memory_gb);
  const std::vector<CameraOverTime> cameras = CamerasOf(set);
  progress.Stage("what stands still, once", static_cast<int>(cameras.size()));
  std::atomic<int> done = 0;
  ParallelFor(0, static_cast<int>(cameras.size()), [&](int i) {
    progress.ThrowIfInterrupted();
    const CameraOverTime& camera = cameras[static_cast<size_t>(i)];
    const PinholeCamera grid = camera.views.front()->DepthCamera();
    const auto share = memory.Take(kBytesPerPixel * grid.width_px() * grid.height_px());
    StoreOnce(set_folder, camera);
    progress.Update(++done);
  });
  for (Frame& frame : set.frames) {
    for (View& view : frame.views) {
      if (!view.depth_base && !view.completed_base) continue;
      view.mesh_file.reset();  // it names the files of before
      view.mesh.reset();
    }
  }
}

}  // namespace dtr::io
