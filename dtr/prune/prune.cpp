#include "dtr/prune/prune.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <sstream>

#include "dtr/base/error.h"
#include "dtr/prune/probes.h"

namespace dtr::prune {
namespace {

// Half-size pictures from few places decide, others check: a decided loss this much smaller than
// the budget mostly holds at once.
constexpr int kMostTriedAgain = 24;  // decisions after one that was at fault
constexpr double kDecidingShare = 0.85;
// Differences of a loss below this are chance; without a floor, what costs nothing would divide by
// 0.
constexpr double kSmallestLossDb = 1e-3;
constexpr size_t kFewestViews = 3;  // where one is left out to look from its place, two remain

enum class Kind { kView, kViewsUsed, kImages, kDepth, kSize, kMesh };
constexpr std::array kLevelled = {Kind::kViewsUsed, Kind::kImages, Kind::kDepth, Kind::kSize,
                                  Kind::kMesh};

const char* NameOf(Kind kind) {
  switch (kind) {
    case Kind::kView:
      return "view";
    case Kind::kViewsUsed:
      return "views-used";
    case Kind::kImages:
      return "images";
    case Kind::kDepth:
      return "depth";
    case Kind::kSize:
      return "size";
    case Kind::kMesh:
      break;
  }
  return "mesh";
}

/// Steps of each kind, dearest first.
std::vector<double> LevelsOf(Kind kind) {
  switch (kind) {
    case Kind::kViewsUsed:
      return {8, 6, 5, 4, 3, 2, 1};
    case Kind::kImages:
      return {95, 90, 85, 80, 70, 60, 45};
    case Kind::kDepth:
      return {0.125, 0.25, 0.5, 1};
    case Kind::kSize:
      return {2};
    case Kind::kMesh:
      return {1, 2, 4};
    case Kind::kView:
      break;
  }
  return {};
}

struct Move {
  Kind kind = Kind::kView;
  std::string view;  ///< its id
  double level = 0;
};

/// The setting after a move; nothing where it changes nothing or goes back.
std::optional<Setting> After(Setting setting, const Move& move) {
  Coding& coding = setting.coding;
  const auto lower = [&](auto& value) {
    const auto level = static_cast<std::remove_reference_t<decltype(value)>>(move.level);
    if (value != 0 && level >= value) return false;
    value = level;
    return true;
  };
  const auto raise = [&](auto& value) {
    const auto level = static_cast<std::remove_reference_t<decltype(value)>>(move.level);
    if (level <= value) return false;
    value = level;
    return true;
  };
  bool changed = false;
  switch (move.kind) {
    case Kind::kView:
      setting.without.push_back(move.view);
      changed = true;
      break;
    case Kind::kViewsUsed:
      changed = lower(setting.render.views);
      break;
    case Kind::kImages:
      changed = lower(coding.jpeg_quality);
      break;
    case Kind::kDepth:
      changed = raise(coding.depth_error_px);
      break;
    case Kind::kSize:
      changed = raise(coding.shrink);
      break;
    case Kind::kMesh:
      changed = raise(coding.mesh_tolerance_px);
      setting.render.mesh_tolerance_px = coding.mesh_tolerance_px;
      break;
  }
  return changed ? std::optional(setting) : std::nullopt;
}

struct Measured {
  double loss_db = 0;
  double bytes = 0;
  double frame = 0;  ///< views that a pixel looks at: what its time is proportional to
};

struct Candidate {
  Move move;
  Setting after;
  Measured measured;
  int round = -1;    ///< when that was measured
  double worth = 0;  ///< saving per dB
};

class Pruner {
 public:
  Pruner(const DtrSet& set, const PruneOptions& options, const CodeFunction& code,
         const RendererMaker& make_renderer, Progress& progress)
      : set_(set), options_(options), code_(code), make_(make_renderer), progress_(progress) {}

  PruneReport Run() {
    Begin();
    while (DecideOne()) {
    }
    return Checked();
  }

 private:
  using Coded = std::shared_ptr<const CodedSet>;

  const eval::RenderFunction& RendererFor(const Coded& coded) {
    if (drawn_ != coded || !render_) {
      render_ = nullptr;  // before the next: it owns the current context
      drawn_ = coded;     // holds what the renderer points into
      render_ = make_();
    }
    return render_;
  }

  /// The current setting's set, or one coded for a trial; the last trial is kept.
  Coded CodedAs(const Coding& coding) {
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

  void Begin() {
    Setting setting{{}, Coding{}, options_.render};
    setting.coding.mesh_tolerance_px = options_.render.mesh_tolerance_px;
    current_ = CodedAs(setting.coding);
    current_coding_ = setting.coding;
    trial_ = nullptr;
    const auto& render = RendererFor(current_);
    progress_.Stage("pictures of the whole set", 4);
    deciding_ = LeftOutPlaces(current_->set, options_.probes, options_.probe_crop);
    checking_ = NovelPlaces(DrawProbes(set_, options_.checks, options_.seed));
    witnesses_ = WitnessPlaces(current_->set, deciding_, options_.checks);
    photos_ = HeldOutPlaces(current_->set);
    progress_.Update(1);
    deciding_before_ = Pictures(current_->set, {}, deciding_, setting.render, render);
    progress_.Update(3);
    checking_before_ = Pictures(current_->set, {}, checking_, setting.render, render);
    witnesses_before_ = Pictures(current_->set, {}, witnesses_, setting.render, render);
    photos_before_ = Pictures(current_->set, {}, photos_, setting.render, render);
    progress_.Update(4);
    now_ = {0, BytesOf(setting, *current_), FrameOf(setting)};
    history_.push_back(setting);
    LeaveOutSigma();
    for (const Kind kind : kLevelled) AddNext(kind, 0);
    for (const View& view : set_.frames.front().views) {
      if (view.role != ViewRole::kSource) continue;
      candidates_.push_back({{Kind::kView, view.id, 0}, {}, {}, -1, 0});
    }
    progress_.Stage("measuring what could be left out", static_cast<int>(candidates_.size()));
    for (size_t i = 0; i < candidates_.size(); ++i) {
      Measure(candidates_[i]);
      progress_.Update(static_cast<int>(i) + 1);
    }
  }

  /// No renderer looks at standard deviations: nothing to measure.
  void LeaveOutSigma() {
    const auto& views = set_.frames.front().views;
    if (std::none_of(views.begin(), views.end(), [](const View& v) { return v.sigma_file; })) {
      return;
    }
    Setting after = history_.back();
    after.coding.sigma = false;
    const Coded coded = CodedAs(after.coding);
    Candidate sigma;
    sigma.after = after;
    sigma.measured = {0, BytesOf(after, *coded), FrameOf(after)};
    Take(sigma, "sigma", "of every depth");
  }

  double BytesOf(const Setting& setting, const CodedSet& coded) const {
    double bytes = 0;
    const auto& views = coded.set.frames.front().views;
    for (size_t i = 0; i < views.size(); ++i) {
      const auto& without = setting.without;
      if (std::find(without.begin(), without.end(), views[i].id) != without.end()) continue;
      bytes += static_cast<double>(coded.bytes[i]);
    }
    return std::max(bytes, 1.0);
  }

  size_t SourcesLeft(const Setting& setting) const {
    const auto& views = set_.frames.front().views;
    const auto sources = std::count_if(views.begin(), views.end(), [](const View& view) {
      return view.role == ViewRole::kSource;
    });
    return static_cast<size_t>(sources) - setting.without.size();
  }

  /// The deferred method's frames take time in proportion to the views that a pixel looks at
  /// (docs/ACCURACY.md): times themselves would make decisions depend on the machine.
  double FrameOf(const Setting& setting) const {
    return static_cast<double>(
        std::min(static_cast<size_t>(setting.render.views), SourcesLeft(setting)));
  }

  Measured MeasuredOf(const Setting& setting) {
    const Coded coded = CodedAs(setting.coding);
    const auto pictures =
        Pictures(coded->set, setting.without, deciding_, setting.render, RendererFor(coded));
    const Errors errors = CompareWithPhotos(deciding_, deciding_before_, pictures);
    return {errors.psnr_loss_db, BytesOf(setting, *coded), FrameOf(setting)};
  }

  void Measure(Candidate& candidate) {
    progress_.ThrowIfInterrupted();
    candidate.round = round_;
    const auto after = After(history_.back(), candidate.move);
    candidate.worth = -std::numeric_limits<double>::infinity();
    candidate.measured.loss_db = std::numeric_limits<double>::infinity();
    if (!after || SourcesLeft(*after) < kFewestViews) return;
    candidate.after = *after;
    candidate.measured = MeasuredOf(*after);
    const double saving = std::log(now_.bytes / candidate.measured.bytes) +
                          std::log(now_.frame / candidate.measured.frame);
    candidate.worth = saving / std::max(candidate.measured.loss_db - now_.loss_db, kSmallestLossDb);
  }

  /// The first level of a kind, from index `from` on, that changes the current setting.
  bool AddNext(Kind kind, size_t from) {
    const std::vector<double> levels = LevelsOf(kind);
    for (size_t i = from; i < levels.size(); ++i) {
      const Move move{kind, "", levels[i]};
      if (kind == Kind::kSize && !CanShrink(set_, static_cast<int>(levels[i]))) continue;
      if (!After(history_.back(), move)) continue;
      candidates_.push_back({move, {}, {}, -1, 0});
      return true;
    }
    return false;
  }

  size_t LevelAfter(const Move& move) const {
    const std::vector<double> levels = LevelsOf(move.kind);
    return static_cast<size_t>(std::find(levels.begin(), levels.end(), move.level) -
                               levels.begin()) +
           1;
  }

  /// Takes the best that fits; false when nothing is left that does.
  bool DecideOne() {
    while (!candidates_.empty()) {
      const auto best = std::max_element(
          candidates_.begin(), candidates_.end(),
          [](const Candidate& a, const Candidate& b) { return a.worth < b.worth; });
      if (best->round != round_) {
        Measure(*best);
        continue;
      }
      const Candidate candidate = *best;
      candidates_.erase(best);
      const bool levelled = candidate.move.kind != Kind::kView;
      if (!(candidate.worth > 0)) {
        // A step that saves nothing (images are JPEG already): perhaps the next one does.
        if (levelled && std::isfinite(candidate.measured.loss_db) &&
            AddNext(candidate.move.kind, LevelAfter(candidate.move))) {
          Measure(candidates_.back());
        }
        continue;
      }
      if (candidate.measured.loss_db > kDecidingShare * options_.max_loss_db) continue;
      Take(candidate, NameOf(candidate.move.kind), WordsFor(candidate));
      if (levelled && AddNext(candidate.move.kind, LevelAfter(candidate.move))) {
        Measure(candidates_.back());
      }
      return true;
    }
    return false;
  }

  std::string WordsFor(const Candidate& candidate) const {
    std::ostringstream words;
    switch (candidate.move.kind) {
      case Kind::kView:
        for (const View& view : set_.frames.front().views) {
          if (view.id == candidate.move.view) words << view.name;
        }
        break;
      case Kind::kViewsUsed:
        words << "at most " << candidate.move.level << " views a pixel";
        break;
      case Kind::kImages:
        words << "JPEG quality " << candidate.move.level;
        break;
      case Kind::kDepth:
        words << "within " << candidate.move.level << " px of disparity";
        break;
      case Kind::kSize:
        words << "images and depth at 1/" << candidate.move.level << " of their size";
        break;
      case Kind::kMesh:
        words << "tolerance " << candidate.move.level << " px";
        break;
    }
    return words.str();
  }

  void Take(const Candidate& candidate, const std::string& kind, const std::string& what) {
    const Measured& after = candidate.measured;
    report_.removed.push_back({kind, what, after.loss_db - now_.loss_db,
                               1 - after.bytes / now_.bytes, 1 - after.frame / now_.frame});
    if (candidate.after.coding != current_coding_) {
      current_ = CodedAs(candidate.after.coding);
      current_coding_ = candidate.after.coding;
      trial_ = nullptr;
    }
    history_.push_back(candidate.after);
    now_ = after;
    ++round_;
    std::ostringstream line;
    line.precision(3);
    line << "left out: " << kind << ", " << what << ": " << after.loss_db << " dB so far, "
         << 100 * report_.removed.back().bytes_share << " % of the bytes";
    progress_.Note(line.str());
  }

  struct Check {
    double probe_loss_db = 0;
    std::optional<double> photo_loss_db;
    double witness_loss_db = 0;
    bool Holds(double most) const { return probe_loss_db <= most && witness_loss_db <= most; }
  };

  Check CheckOf(const Setting& setting) {
    progress_.ThrowIfInterrupted();
    const Coded coded = CodedAs(setting.coding);
    const auto& render = RendererFor(coded);
    const auto pictures = [&](const std::vector<Place>& places) {
      return Pictures(coded->set, setting.without, places, setting.render, render);
    };
    // Held-out photos are looked at and heeded in nothing: the set would be chosen by what it is
    // measured with.
    Check check;
    if (!photos_.empty()) {
      check.photo_loss_db =
          CompareWithPhotos(photos_, photos_before_, pictures(photos_)).psnr_loss_db;
    }
    const Errors errors = CompareWithPhotos(witnesses_, witnesses_before_, pictures(witnesses_));
    check.witness_loss_db = errors.psnr_loss_db;
    check.probe_loss_db = LossDb(checking_before_, pictures(checking_), errors);
    return check;
  }

  /// What a decision changed, done to another setting.
  static Setting Redone(Setting on, const Setting& before, const Setting& after) {
    on.without.insert(on.without.end(),
                      after.without.begin() + static_cast<std::ptrdiff_t>(before.without.size()),
                      after.without.end());
    const auto carry = [](auto& to, const auto& from, const auto& was) {
      if (from != was) to = from;
    };
    carry(on.coding.jpeg_quality, after.coding.jpeg_quality, before.coding.jpeg_quality);
    carry(on.coding.depth_error_px, after.coding.depth_error_px, before.coding.depth_error_px);
    carry(on.coding.shrink, after.coding.shrink, before.coding.shrink);
    carry(on.coding.mesh_tolerance_px, after.coding.mesh_tolerance_px,
          before.coding.mesh_tolerance_px);
    carry(on.coding.sigma, after.coding.sigma, before.coding.sigma);
    carry(on.render.views, after.render.views, before.render.views);
    carry(on.render.mesh_tolerance_px, after.render.mesh_tolerance_px,
          before.render.mesh_tolerance_px);
    return on;
  }

  Check CheckAloud(const Setting& setting, const std::string& what) {
    const Check check = CheckOf(setting);
    std::ostringstream line;
    line.precision(3);
    line << "checked: " << what << ": " << check.probe_loss_db << " dB, " << check.witness_loss_db
         << " dB on photos that did not decide";
    if (check.photo_loss_db) line << ", " << *check.photo_loss_db << " dB on held-out photos";
    progress_.Note(line.str());
    return check;
  }

  /// The longest run of decisions that the check bears out, by halving: losses grow with decisions.
  /// The decision after it is at fault; of those that came later each is tried again without it.
  PruneReport Checked() {
    progress_.Stage("checking from other places", 0);
    size_t holds = 0, fails = history_.size();
    Check accepted;
    for (size_t next = history_.size() - 1; holds < next; next = (holds + fails) / 2) {
      const Check check = CheckAloud(history_[next], std::to_string(next) + " decisions");
      if (check.Holds(options_.max_loss_db)) {
        holds = next;
        accepted = check;
      } else {
        fails = next;
      }
    }
    Setting setting = history_[holds];
    const std::vector<Removal> decisions = std::move(report_.removed);
    report_.removed.assign(decisions.begin(),
                           decisions.begin() + static_cast<std::ptrdiff_t>(holds));
    int tries = 0;
    for (size_t n = holds; n < decisions.size(); ++n) {
      const Setting candidate = Redone(setting, history_[n], history_[n + 1]);
      const bool tried = n > holds && tries < kMostTriedAgain;
      const Check check = tried ? CheckAloud(candidate, "again " + decisions[n].what) : Check{};
      tries += tried;
      if (tried && check.Holds(options_.max_loss_db)) {
        setting = candidate;
        accepted = check;
        report_.removed.push_back(decisions[n]);
      } else {
        report_.put_back.push_back(decisions[n]);
      }
    }
    report_.setting = setting;
    for (const Removal& removal : report_.removed) report_.decided_loss_db += removal.loss_db;
    report_.checked_probe_loss_db = accepted.probe_loss_db;
    report_.witness_loss_db = accepted.witness_loss_db;
    report_.photo_loss_db = accepted.photo_loss_db;
    if (report_.removed.empty() && !photos_.empty()) report_.photo_loss_db = 0;
    const Errors errors = CompareWithPhotos(witnesses_, witnesses_before_, witnesses_before_);
    report_.error_db = 10 * std::log10(255 * 255 / errors.before);
    render_ = nullptr;
    return report_;
  }

  const DtrSet& set_;
  const PruneOptions& options_;
  const CodeFunction& code_;
  const RendererMaker& make_;
  Progress& progress_;

  std::vector<Place> deciding_, checking_, witnesses_, photos_;
  std::vector<ImageRgb8> deciding_before_, checking_before_, witnesses_before_, photos_before_;

  Coded current_, trial_, drawn_;
  Coding current_coding_, trial_coding_;
  eval::RenderFunction render_;

  std::vector<Candidate> candidates_;
  std::vector<Setting> history_;  ///< [n]: after n decisions
  Measured now_;
  int round_ = 0;
  PruneReport report_;
};

}  // namespace

PruneReport Prune(const DtrSet& set, const PruneOptions& options, const CodeFunction& code,
                  const RendererMaker& make_renderer, Progress& progress) {
  if (!(options.max_loss_db >= 0) || options.probes < 1 || options.checks < 1 ||
      options.probe_crop < 1) {
    throw UsageError("pruning: expected a loss of at least 0 dB and at least one probe and check");
  }
  return Pruner(set, options, code, make_renderer, progress).Run();
}

}  // namespace dtr::prune
