// The writing half of set_io.h.
#include <algorithm>
#include <set>
#include <stdexcept>

#include "dtr/base/delete.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/hash.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/held_out_files.h"
#include "dtr/io/json_fields.h"
#include "dtr/io/mesh_io.h"
#include "dtr/io/partial_set.h"
#include "dtr/io/set_io.h"
#include "dtr/io/set_json.h"
#include "dtr/io/shared_files.h"
#include "dtr/io/sparse_io.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

StoredFile Describe(const fs::path& folder, const std::string& path) {
  return {path, Sha256OfFile(folder / path), fs::file_size(folder / path)};
}

void ExpectGrid(const View& view, const std::string& what, int width_px, int height_px,
                int expected_width_px, int expected_height_px) {
  if (width_px == expected_width_px && height_px == expected_height_px) return;
  throw Error("view '" + view.name + "': " + what + ": expected " +
              std::to_string(expected_width_px) + "x" + std::to_string(expected_height_px) +
              " pixels, found " + std::to_string(width_px) + "x" + std::to_string(height_px));
}

void ExpectPixels(const View& view) {
  if (!IsSafeId(view.id)) {
    throw Error("view '" + view.name + "': expected an id of the characters A-Z a-z 0-9 . _ -, " +
                "found '" + view.id + "'");
  }
  const int w = view.camera.width_px(), h = view.camera.height_px();
  if (!view.image.empty()) ExpectGrid(view, "image", view.image.width(), view.image.height(), w, h);
  if (!view.mask.empty()) ExpectGrid(view, "mask", view.mask.width(), view.mask.height(), w, h);
  const bool has_depth = !view.depth.empty() || view.inverse_depth_sigma;
  if (!has_depth) return;
  if (view.role == ViewRole::kHeldOut) {
    throw Error("view '" + view.name + "': expected no depth in a held-out view");
  }
  if (view.depth_scale < 1 || w % view.depth_scale != 0 || h % view.depth_scale != 0) {
    throw Error("view '" + view.name + "': expected a depth scale that divides " +
                std::to_string(w) + "x" + std::to_string(h) + ", found " +
                std::to_string(view.depth_scale));
  }
  const int depth_w = w / view.depth_scale, depth_h = h / view.depth_scale;
  if (!view.depth.empty()) {
    ExpectGrid(view, "depth", view.depth.width(), view.depth.height(), depth_w, depth_h);
  }
  if (view.inverse_depth_sigma) {
    ExpectGrid(view, "sigma", view.inverse_depth_sigma->width(), view.inverse_depth_sigma->height(),
               depth_w, depth_h);
  }
}

}  // namespace

struct SetWriter::State : PartialSet {
  using PartialSet::PartialSet;
  ImageCoding image_coding = ImageCoding::kPng;

  fs::path RecordOf(const std::string& id) const {
    return partial / kWork / "views" / (id + ".json");
  }
  std::string PathOf(const View& view, const std::string& kind, const std::string& extension) const;
  template <typename Write>
  StoredFile Store(const std::string& path, const Write& write) const;
  void WriteDepthFile(View& view, LengthUnit unit) const;
  void WriteCompletedFile(const DepthImage& completed, View& view) const;
  void WriteView(View& view, LengthUnit unit) const;
  bool RestoreView(View& view) const;
  void RemoveUnnamed(const DtrSet& set) const;
};

std::string SetWriter::State::PathOf(const View& view, const std::string& kind,
                                     const std::string& extension) const {
  const std::string path = kind + "/" + view.id + extension;
  return view.role == ViewRole::kHeldOut ? "held_out/" + path : path;
}

template <typename Write>
StoredFile SetWriter::State::Store(const std::string& path, const Write& write) const {
  const fs::path file = partial / path;
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  if (error) throw Error(file.string() + ": its folder cannot be made: " + error.message());
  write(file);
  return Describe(partial, path);
}

SetWriter::SetWriter(const fs::path& target, const std::string& fingerprint_json, bool force,
                     ImageCoding image_coding)
    : state_(std::make_unique<State>(target, force)) {
  state_->image_coding = image_coding;
  AsError([&] {
    state_->Recover();
    state_->ExpectReplaceable();
    state_->Open(fingerprint_json);
  });
}

SetWriter::SetWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
SetWriter::SetWriter(SetWriter&&) noexcept = default;

SetWriter SetWriter::Join(const fs::path& target, const std::string& fingerprint_json, bool force) {
  auto state = std::make_unique<State>(target, force);
  AsError([&] {
    state->ExpectReplaceable();
    state->Join(fingerprint_json);
  });
  return SetWriter(std::move(state));
}

void SetWriter::RequireTarget(const fs::path& target, bool force) {
  const State state(target, force);
  // What a run that was cut off half-way left beside it is the constructor's to put right.
  if (!state.WasCutOff()) AsError([&] { state.ExpectReplaceable(); });
}

SetWriter::~SetWriter() {
  // Nothing was done: leave nothing that would stand in the way of a corrected command.
  if (state_ && !state_->joined && !state_->finished) state_->RemoveUnused();
}

void SetWriter::Discard() noexcept {
  if (state_->joined) return;
  TryRemoveTree(state_->partial);
  state_->lock.reset();
  state_->finished = true;
}

const fs::path& SetWriter::folder() const { return state_->partial; }
fs::path SetWriter::work_folder() const { return state_->partial / kWork; }
fs::path SetWriter::WorkFolderOf(const fs::path& target) { return io::WorkFolderOf(target); }
bool SetWriter::resumed() const { return state_->resumed; }

void SetWriter::WriteView(View& view, LengthUnit unit) {
  ExpectPixels(view);
  AsError([&] { state_->WriteView(view, unit); });
}

void SetWriter::State::WriteView(View& view, LengthUnit unit) const {
  if (!view.image.empty()) {
    const bool jpeg = image_coding == ImageCoding::kJpeg && view.role == ViewRole::kSource;
    view.image_file = Store(PathOf(view, "images", jpeg ? ".jpg" : ".png"),
                            [&](const fs::path& file) { WriteImage(file, view.image); });
    view.image_frame.reset();
  }
  if (!view.mask.empty()) {
    view.mask_file = Store(PathOf(view, "mask", ".png"),
                           [&](const fs::path& file) { WriteMask(file, view.mask); });
  }
  if (!view.depth.empty()) {
    if (view.near_z == 0 && view.far_z == 0) {
      const DepthRangeOfMap range = RangeOf(MeasuredDepth(view));
      view.near_z = range.near_z;
      view.far_z = range.far_z;
    }
    WriteDepthFile(view, unit);
  }
  if (view.inverse_depth_sigma) {
    view.sigma_file = Store(PathOf(view, "sigma", ".exr"), [&](const fs::path& file) {
      WriteSigma(file, *view.inverse_depth_sigma);
    });
    view.sigma_base.reset();
  }
  // Written last: a record stands for files that are whole.
  const fs::path record = RecordOf(view.id);
  std::error_code error;
  fs::create_directories(record.parent_path(), error);
  if (error) throw Error(record.string() + ": its folder cannot be made: " + error.message());
  WriteFileAtomically(record, JsonFromView(view, "view '" + view.name + "'"));
}

void SetWriter::State::WriteDepthFile(View& view, LengthUnit unit) const {
  const DepthFormat format = FormatOf(view, unit);
  const DepthImage measured = MeasuredDepth(view);
  view.depth_file = Store(PathOf(view, "depth", ExtensionOf(view.depth_coding)),
                          [&](const fs::path& file) { WriteDepth(file, measured, format); });
  view.depth_base.reset();
  if (!view.depth_state.empty()) WriteCompletedFile(CompletedDepth(view), view);
  view.mesh_file.reset();  // it was of other depth
  view.mesh.reset();
}

void SetWriter::State::WriteCompletedFile(const DepthImage& completed, View& view) const {
  const DepthFormat format = CompletedFormatOf(view);
  view.completed_file = Store(PathOf(view, "completed", ExtensionOf(format.coding)),
                              [&](const fs::path& file) { WriteDepth(file, completed, format); });
  view.completed_base.reset();
  view.mesh_file.reset();  // it was without it
  view.mesh.reset();
}

void SetWriter::WriteCompleted(const DepthImage& completed, View& view) {
  const PinholeCamera camera = view.DepthCamera();
  ExpectGrid(view, "completed depth", completed.width(), completed.height(), camera.width_px(),
             camera.height_px());
  if (!view.depth_file) {
    throw std::logic_error("SetWriter::WriteCompleted: the view's depth comes first");
  }
  AsError([&] { state_->WriteCompletedFile(completed, view); });
}

void SetWriter::RecodeDepth(View& view, LengthUnit unit) {
  ExpectPixels(view);
  if (view.depth.empty()) throw Error("view '" + view.name + "': expected depth to store");
  AsError([&] { state_->WriteDepthFile(view, unit); });
}

void SetWriter::WriteJpeg(View& view, int quality) {
  ExpectPixels(view);
  if (view.image.empty() || view.role != ViewRole::kSource) {
    throw Error("view '" + view.name + "': expected the image of a source view to write as JPEG");
  }
  view.image_file = AsError([&] {
    return state_->Store(state_->PathOf(view, "images", ".jpg"),
                         [&](const fs::path& file) { WriteImage(file, view.image, quality); });
  });
  view.image_frame.reset();
}

void SetWriter::CopyFiles(const fs::path& set_folder, const View& view) {
  for (const StoredFile* file : StoredFilesOf(view)) {
    const StoredFile copied = AsError([&] {
      return state_->Store(file->path, [&](const fs::path& target) {
        CopyFileAtomically(set_folder / file->path, target);
      });
    });
    if (copied == *file) continue;
    throw Error((set_folder / file->path).string() +
                ": expected the content that the set records, found another; dtr info with "
                "`verify` names every such file");
  }
}

bool SetWriter::RestoreView(View& view) const {
  return AsError([&] { return state_->RestoreView(view); });
}

bool SetWriter::State::RestoreView(View& view) const {
  const fs::path record = RecordOf(view.id);
  if (!IsSafeId(view.id) || !fs::exists(record)) return false;
  View stored;
  try {
    stored = ViewFromJson(ReadFile(record, kRecordLimitBytes), record.string());
  } catch (const Error&) {
    return false;  // a damaged checkpoint costs time, never the job
  }
  const bool same_view =
      stored.id == view.id && stored.name == view.name && stored.role == view.role &&
      stored.camera == view.camera &&
      stored.cam_from_world.rotation.coeffs() == view.cam_from_world.rotation.coeffs() &&
      stored.cam_from_world.translation == view.cam_from_world.translation;
  if (!same_view) return false;
  stored.mesh_file.reset();
  for (const StoredFile* file : StoredFilesOf(stored)) {
    const fs::path full = partial / file->path;
    if (!fs::is_regular_file(full) || Sha256OfFile(full) != file->sha256) return false;
  }
  view.image_file = stored.image_file;
  view.image_frame = stored.image_frame;
  view.mask_file = stored.mask_file;
  view.depth_file = stored.depth_file;
  view.completed_file = stored.completed_file;
  view.completed_steps = stored.completed_steps;
  view.completed_near_z = stored.completed_near_z;
  view.completed_far_z = stored.completed_far_z;
  view.sigma_file = stored.sigma_file;
  view.depth_base = stored.depth_base;
  view.completed_base = stored.completed_base;
  view.sigma_base = stored.sigma_base;
  view.depth_coding = stored.depth_coding;
  view.depth_steps = stored.depth_steps;
  view.depth_scale = stored.depth_scale;
  view.near_z = stored.near_z;
  view.far_z = stored.far_z;
  view.reference_baseline = stored.reference_baseline;
  view.gain = stored.gain;
  view.extra_json = stored.extra_json;
  return true;
}

void SetWriter::WriteMesh(View& view, StoredMesh mesh) {
  if (!view.depth_file || !IsSafeId(view.id)) {
    throw Error("view '" + view.name + "': expected stored depth before its mesh");
  }
  mesh.depth_sha256 = DepthHashOf(view);
  mesh.mask_sha256 = view.mask_file ? view.mask_file->sha256 : "";
  view.mesh_file = state_->Store("mesh/" + view.id + ".bin",
                                 [&](const fs::path& file) { dtr::io::WriteMesh(file, mesh); });
  view.mesh = std::move(mesh);
}

void SetWriter::WriteSparse(DtrSet& set, const SparseScene& scene) {
  set.sparse_file =
      state_->Store(kSparseFile, [&](const fs::path& file) { dtr::io::WriteSparse(file, scene); });
}

// What an earlier, interrupted run left and the set does not name any more.
void SetWriter::State::RemoveUnnamed(const DtrSet& set) const {
  std::set<fs::path> named;
  for (const NamedFile& file : FilesOf(set)) named.insert(partial / file.file->path);
  std::vector<fs::path> unnamed;
  for (const char* folder : kPixelFolders) {
    if (!fs::exists(partial / folder)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(partial / folder)) {
      if (!entry.is_directory() && named.count(entry.path()) == 0) unnamed.push_back(entry.path());
    }
  }
  for (const fs::path& file : unnamed) RemoveFile(file);
  for (const char* folder : kPixelFolders) {
    if (IsEmptyFolder(partial / folder)) RemoveFile(partial / folder);
  }
}

void SetWriter::Finish(DtrSet& set) {
  State& state = *state_;
  if (set.frames.size() > 1) ShareEqualFiles(set);
  const fs::path file = state.partial / kSetFile;
  const std::string text = JsonFromSet(set, file.string());
  const fs::path held_out_file = state.partial / kHeldOutFiles;
  const std::string held_out_text = HeldOutFilesJson(set, held_out_file.string());
  ExpectFiles(state.partial, set);
  if (set.sparse_file) (void)LoadSparse(state.partial, set);  // its views must be the set's
  AsError([&] {
    state.RemoveUnnamed(set);
    if (!held_out_text.empty()) WriteFileAtomically(held_out_file, held_out_text);
    WriteFileAtomically(file, text);
    state.MoveIntoPlace();
  });
}

}  // namespace dtr::io
