#include "dtr/prune/measurer.h"

#include <algorithm>
#include <cmath>

#include "dtr/eval/metrics.h"
#include "dtr/prune/probes.h"

namespace dtr::prune {
namespace {

// Novel cameras that decide are others than those that check.
constexpr std::uint64_t kOtherCameras = 0x9e3779b97f4a7c15u;
// Of the setting as it is, and of the one that is tried.
constexpr size_t kKeptImages = 2;

/// What no view of the whole set sees is filled before and after, from around it: it says nothing
/// of what is lost. From places that see nothing all counts.
void CountSeen(const Mask& coverage, Place& place) {
  const Mask seen = eval::Intersect(coverage, place.mask);
  const auto& pixels = seen.data();
  if (std::any_of(pixels.begin(), pixels.end(), [](auto p) { return p != 0; })) place.mask = seen;
}

}  // namespace

std::vector<double> Measurer::Numbers(const std::string& name, size_t least,
                                      const std::function<std::vector<double>()>& measure) {
  progress_.ThrowIfInterrupted();
  if (auto found = journal_.Find(name, least)) {
    found_ += !prepared_;
    return *found;
  }
  const std::vector<double> numbers = measure();
  journal_.Add(name, numbers);
  return numbers;
}

const eval::RenderFunction& Measurer::RendererFor(const Coded& coded) {
  if (drawn_ != coded || !render_) {
    render_ = nullptr;  // before the next: it owns the current context
    drawn_ = coded;     // holds what the renderer points into
    render_ = make_();
  }
  return render_;
}

Measurer::Coded Measurer::CodedAs(const Coding& coding) {
  if (current_ && coding == current_coding_) return current_;
  if (!trial_ || coding != trial_coding_) {
    progress_.ThrowIfInterrupted();
    if (drawn_ == trial_) {
      render_ = nullptr;
      drawn_ = nullptr;
    }
    trial_ = nullptr;  // first: two trials at once would be three sets in memory
    trial_ = std::make_shared<const CodedSet>(code_(coding));
    trial_coding_ = coding;
  }
  return trial_;
}

void Measurer::Accept(const Setting& setting) {
  // Coded when something is drawn or weighed beside it: a run that goes on may never need it.
  if (current_ && setting.coding == current_coding_) return;
  if (trial_ && setting.coding == trial_coding_) {
    current_ = trial_;
    current_coding_ = trial_coding_;
  }
  trial_ = nullptr;
}

double Measurer::BytesOf(const Setting& setting, const CodedSet& coded) const {
  double bytes = options_.other_bytes;
  const auto& views = coded.set.frames.front().views;
  for (size_t i = 0; i < views.size(); ++i) {
    const auto& without = setting.without;
    if (std::find(without.begin(), without.end(), views[i].id) != without.end()) continue;
    bytes += static_cast<double>(coded.bytes[i]);
  }
  return std::max(bytes, 1.0);
}

double Measurer::BytesOf(const Setting& setting) {
  return Numbers("bytes " + KeyOf(setting), 1, [&] {
    return std::vector<double>{BytesOf(setting, *CodedAs(setting.coding))};
  })[0];
}

void Measurer::Prepare() {
  if (prepared_) return;
  prepared_ = true;
  Setting whole{{}, Coding{}, options_.render};
  whole.coding.mesh_tolerance_px = options_.render.mesh_tolerance_px;
  whole.coding.mesh_resolution = options_.render.resolution;
  const Coded coded = CodedAs(whole.coding);
  progress_.Note("images of the whole set");
  const DtrSet& set = coded->set;
  deciding_.places = LeftOutPlaces(set, options_.probes, options_.probe_crop);
  deciding_novel_.places = NovelPlaces(Windows(
      DrawProbes(set_, options_.checks, options_.seed ^ kOtherCameras), options_.probe_crop));
  checking_.places = NovelPlaces(DrawProbes(set_, options_.checks, options_.seed));
  witnesses_.places = WitnessPlaces(set, deciding_.places, options_.checks);
  photos_.places = HeldOutPlaces(set);
  photos_whole_ = photos_.places;
  for (Looks* looks : {&deciding_, &deciding_novel_, &checking_, &witnesses_, &photos_}) {
    std::vector<Mask> coverage;
    looks->before = ImagesOf(whole, coded, *looks, &coverage);
    for (size_t i = 0; i < coverage.size(); ++i) CountSeen(coverage[i], looks->places[i]);
  }
}

std::vector<ImageRgb8> Measurer::ImagesOf(const Setting& setting, const Coded& coded,
                                          const Looks& looks, std::vector<Mask>* coverage) {
  progress_.ThrowIfInterrupted();
  return Images(coded->set, setting.without, looks.places, setting.render, RendererFor(coded),
                coverage);
}

/// PSNR loss, and the mean squares before, after and of the change.
Errors Measurer::AtPhotos(const std::string& what, const Looks& looks, Setting setting) {
  // Tiles lean on the very views that are left out here; from between the cameras they are
  // evaluated.
  setting.coding.tiles.clear();
  const auto numbers = Numbers(what + " " + KeyOf(setting), 5, [&] {
    Prepare();
    const Errors errors = CompareWithPhotos(looks.places, looks.before,
                                            ImagesOf(setting, CodedAs(setting.coding), looks));
    return std::vector<double>{errors.before, errors.after, errors.change, errors.psnr_loss_db,
                               errors.psnr_loss_error_db};
  });
  return {numbers[0], numbers[1], numbers[2], numbers[3], numbers[4]};
}

const std::vector<ImageRgb8>& Measurer::KeptImages(Looks& looks, const Setting& kept) {
  const std::string key = KeyOf(kept);
  const auto known = std::find_if(looks.kept.begin(), looks.kept.end(),
                                  [&](const auto& entry) { return entry.first == key; });
  if (known != looks.kept.end()) return known->second;
  if (looks.kept.size() == kKeptImages) looks.kept.pop_front();
  looks.kept.emplace_back(key, ImagesOf(kept, CodedAs(kept.coding), looks));
  return looks.kept.back().second;
}

std::vector<double> Measurer::NovelLossesDb(Looks& looks, const Setting& setting,
                                            const Errors& with_all_at_photos) {
  const Setting kept = WithNothingRemoved(setting);
  const std::vector<ImageRgb8>& recoded = KeptImages(looks, kept);
  std::vector<double> removed(looks.places.size(), 0.0);
  if (KeyOf(kept) != KeyOf(setting)) {
    removed = Changes(looks.places, recoded, ImagesOf(setting, CodedAs(setting.coding), looks));
  }
  return LossesDb(Changes(looks.places, looks.before, recoded), removed, with_all_at_photos);
}

Measured Measurer::Measure(const Setting& setting) {
  const Errors errors = AtPhotos("photos", deciding_, setting);
  const auto numbers = Numbers("loss " + KeyOf(setting), 2, [&] {
    Prepare();
    const Errors with_all = AtPhotos("photos", deciding_, WithNothingRemoved(setting));
    const double novel_loss_db = MeanOf(NovelLossesDb(deciding_novel_, setting, with_all));
    return std::vector<double>{std::max(errors.psnr_loss_db, novel_loss_db),
                               BytesOf(setting, *CodedAs(setting.coding))};
  });
  return {numbers[0], numbers[1], mover_.FrameOf(setting)};
}

Check Measurer::CheckOf(const Setting& setting) {
  const Errors errors = AtPhotos("witnesses", witnesses_, setting);
  const auto numbers = Numbers("check " + KeyOf(setting), 2, [&] {
    Prepare();
    const Errors with_all = AtPhotos("witnesses", witnesses_, WithNothingRemoved(setting));
    const auto losses_db = NovelLossesDb(checking_, setting, with_all);
    std::vector<double> found = {MeanOf(losses_db), StandardError(losses_db)};
    // Held-out photos are looked at and heeded in nothing: the set would be chosen by what it is
    // measured with.
    if (!photos_.places.empty()) {
      const auto after = ImagesOf(setting, CodedAs(setting.coding), photos_);
      for (const auto& places : {photos_.places, photos_whole_}) {
        found.push_back(CompareWithPhotos(places, photos_.before, after).psnr_loss_db);
      }
    }
    return found;
  });
  Check check;
  check.probe_loss_db = numbers[0];
  check.probe_error_db = numbers[1];
  check.witness_loss_db = errors.psnr_loss_db;
  check.witness_error_db = errors.psnr_loss_error_db;
  check.error_db = 10 * std::log10(255 * 255 / errors.before);
  if (numbers.size() > 3) {
    check.photo_loss_db = numbers[2];
    check.photo_frame_loss_db = numbers[3];
  }
  return check;
}

}  // namespace dtr::prune
