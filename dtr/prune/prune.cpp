#include "dtr/prune/prune.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>

#include "dtr/base/error.h"

namespace dtr::prune {
namespace {

// Windows of images from few places decide, others check: a decided loss this much smaller than
// the budget mostly holds at once.
constexpr double kDecidingShare = 0.85;
constexpr int kMaxTriedAgain = 24;  // decisions after one that was at fault
// What was taken back, and what a check finds cheaper than the places that decide, leaves room for
// others: so often decisions are made and checked again.
constexpr int kMaxPasses = 4;
// Differences of a loss below this are chance; without a floor, what costs nothing would divide by
// 0.
constexpr double kSmallestLossDb = 1e-3;
constexpr size_t kMinViews = 3;  // where one is left out to look from its place, two remain
// Of ln(before / after), where the square root of it starts to flatten: what was saved of one kind
// (bytes, work) makes more of the same worth less, so that a set is not made small alone.
constexpr double kFirstSaving = 0.1;

struct Candidate {
  Move move;
  Setting after;
  Measured measured;
  int round = -1;    ///< when that was measured
  double worth = 0;  ///< saving per dB
};

/// What was measured once is not measured again.
class OwnJournal : public Journal {
 public:
  std::optional<std::vector<double>> Find(const std::string& name, size_t) const override {
    const auto found = known_.find(name);
    return found == known_.end() ? std::nullopt : std::optional(found->second);
  }
  void Add(const std::string& name, const std::vector<double>& numbers) override {
    known_[name] = numbers;
  }

 private:
  std::map<std::string, std::vector<double>> known_;
};

class Pruner {
 public:
  Pruner(const DtrSet& set, const PruneOptions& options, const CodeFunction& code,
         const RendererMaker& make_renderer, Progress& progress)
      : set_(set),
        options_(options),
        progress_(progress),
        mover_(set),
        measurer_(set,
                  {options.probes, options.checks, options.probe_crop, options.seed,
                   options.other_bytes, options.render},
                  code, make_renderer, mover_, options.journal != nullptr ? *options.journal : own_,
                  progress) {}

  PruneReport Run() {
    Begin();
    for (int pass = 0; pass < kMaxPasses; ++pass) {
      const size_t verified = pass == 0 ? 0 : report_.removed.size();
      if (pass > 0) {
        // The check sees other places than those that decide, and may leave more room than these.
        limit_db_ = std::max(limit_db_, now_.loss_db + kDecidingShare * room_db_);
        FindCandidates();
      }
      while (!IsEnough() && DecideOne()) {
      }
      if (pass > 0 && report_.removed.size() == verified) break;
      const bool taken_back = CheckFrom(verified);
      if (!taken_back && room_db_ <= (1 - kDecidingShare) * options_.max_loss_db) break;
    }
    report_.decided_loss_db = now_.loss_db;
    report_.setting = history_.back();
    return report_;
  }

 private:
  void Begin() {
    Setting setting{{}, Coding{}, options_.render};
    setting.coding.mesh_tolerance_px = options_.render.mesh_tolerance_px;
    setting.coding.mesh_resolution = options_.render.resolution;
    before_ = now_ = {0, measurer_.BytesOf(setting), mover_.FrameOf(setting)};
    measurer_.Accept(setting);
    history_.push_back(setting);
    LeaveOutSigma();
    FindCandidates();
    if (measurer_.found() > 1) {
      progress_.Note("going on from " + std::to_string(measurer_.found()) +
                     " measurements of a run that was interrupted");
    }
  }

  /// All next steps from here, measured.
  void FindCandidates() {
    candidates_.clear();
    for (const Kind kind : kLevelled) AddNext(kind, 0);
    for (const View& view : set_.frames.front().views) {
      const Move move{Kind::kView, view.id, 0};
      const auto& gone = history_.back().without;
      const bool there = std::find(gone.begin(), gone.end(), view.id) == gone.end();
      if (view.role != ViewRole::kSource || !there || IsAtFault(move)) continue;
      candidates_.push_back({move, {}, {}, -1, 0});
    }
    progress_.Stage("measuring what could be left out", static_cast<int>(candidates_.size()));
    for (size_t i = 0; i < candidates_.size(); ++i) {
      Measure(candidates_[i]);
      progress_.Update(static_cast<int>(i) + 1);
    }
  }

  bool IsAtFault(const Move& move) const {
    return std::find(at_fault_.begin(), at_fault_.end(), move) != at_fault_.end();
  }

  /// No renderer looks at standard deviations: nothing to measure.
  void LeaveOutSigma() {
    const auto& views = set_.frames.front().views;
    if (std::none_of(views.begin(), views.end(), [](const View& v) { return v.sigma_file; })) {
      return;
    }
    Candidate sigma;
    sigma.after = history_.back();
    sigma.after.coding.sigma = false;
    sigma.measured = {0, measurer_.BytesOf(sigma.after), mover_.FrameOf(sigma.after)};
    Take(sigma, "sigma", "of every depth");
  }

  bool IsEnough() const {
    const auto& bytes = options_.enough_bytes;
    const auto& share = options_.enough_frame_share;
    return (bytes || share) && (!bytes || now_.bytes <= *bytes) &&
           (!share || now_.frame <= *share * before_.frame);
  }

  /// What has been saved of both kinds. What is enough of one is not counted beyond that.
  double Saved(const Measured& measured) const {
    const auto saved = [](double before, double after, double enough) {
      const double ratio = std::max(0.0, std::log(before / std::max(after, enough)));
      return std::sqrt(kFirstSaving + ratio);
    };
    const bool goals = options_.enough_bytes || options_.enough_frame_share;
    const double enough_bytes = options_.enough_bytes.value_or(goals ? before_.bytes : 0);
    const double enough_share = options_.enough_frame_share.value_or(goals ? 1 : 0);
    return saved(before_.bytes, measured.bytes, enough_bytes) +
           saved(before_.frame, measured.frame, enough_share * before_.frame);
  }

  void Measure(Candidate& candidate) {
    progress_.ThrowIfInterrupted();
    candidate.round = round_;
    const auto after = mover_.After(history_.back(), candidate.move);
    candidate.worth = -std::numeric_limits<double>::infinity();
    candidate.measured.loss_db = std::numeric_limits<double>::infinity();
    if (!after || mover_.SourcesLeft(*after) < kMinViews) return;
    candidate.after = *after;
    candidate.measured = measurer_.Measure(*after);
    const double saving = Saved(candidate.measured) - Saved(now_);
    candidate.worth = saving / std::max(candidate.measured.loss_db - now_.loss_db, kSmallestLossDb);
  }

  /// The first level of a kind, from index `from` on, that changes the current setting; all of
  /// them, of a kind that may skip levels.
  bool AddNext(Kind kind, size_t from) {
    const std::vector<double> levels = LevelsOf(kind);
    bool some = false;
    for (size_t i = from; i < levels.size(); ++i) {
      const Move move{kind, "", levels[i]};
      if (kind == Kind::kSize && !CanShrink(set_, static_cast<int>(levels[i]))) continue;
      if (!mover_.After(history_.back(), move)) continue;
      if (IsAtFault(move)) {
        if (MaySkipLevels(kind)) continue;
        break;  // dearer ones even more so
      }
      candidates_.push_back({move, {}, {}, -1, 0});
      some = true;
      if (!MaySkipLevels(kind)) break;
    }
    return some;
  }

  static size_t LevelAfter(const Move& move) {
    const std::vector<double> levels = LevelsOf(move.kind);
    return static_cast<size_t>(std::find(levels.begin(), levels.end(), move.level) -
                               levels.begin()) +
           1;
  }

  /// Where a kind goes by steps: adds and measures the one after this.
  void MeasureNext(const Move& move) {
    const bool steps = move.kind != Kind::kView && !MaySkipLevels(move.kind);
    if (steps && AddNext(move.kind, LevelAfter(move))) Measure(candidates_.back());
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
      if (!(candidate.worth > 0)) {
        // A step that saves nothing (images are JPEG already): perhaps the next one does.
        if (std::isfinite(candidate.measured.loss_db)) MeasureNext(candidate.move);
        continue;
      }
      if (candidate.measured.loss_db > limit_db_) continue;
      Take(candidate, NameOf(candidate.move.kind),
           mover_.WordsFor(candidate.move, candidate.after));
      MeasureNext(candidate.move);
      return true;
    }
    return false;
  }

  static Removal Removed(const std::string& kind, const std::string& what, const Measured& before,
                         const Measured& after) {
    return {kind, what, after.loss_db - before.loss_db, 1 - after.bytes / before.bytes,
            1 - after.frame / before.frame};
  }

  void Take(const Candidate& candidate, const std::string& kind, const std::string& what) {
    const Measured& after = candidate.measured;
    report_.removed.push_back(Removed(kind, what, now_, after));
    measurer_.Accept(candidate.after);
    history_.push_back(candidate.after);
    moves_.push_back(candidate.move);
    now_ = after;
    ++round_;
    std::ostringstream line;
    line.precision(3);
    line << "left out: " << kind << ", " << what << ": " << after.loss_db << " dB so far, "
         << 100 * report_.removed.back().bytes_share << " % of the bytes, "
         << 100 * report_.removed.back().frame_share << " % of a frame's work";
    progress_.Note(line.str());
  }

  Check CheckAloud(const Setting& setting, const std::string& what) {
    const Check check = measurer_.CheckOf(setting);
    std::ostringstream line;
    line.precision(3);
    line << "checked: " << what << ": " << check.probe_loss_db << " +- " << check.probe_error_db
         << " dB, " << check.witness_loss_db << " +- " << check.witness_error_db
         << " dB on photos that did not decide";
    if (check.photo_loss_db) line << ", " << *check.photo_loss_db << " dB on held-out photos";
    progress_.Note(line.str());
    return check;
  }

  /// Keeps the longest run of decisions that the check bears out, by halving: losses grow with
  /// decisions. The first `verified` hold. The decision after that run is at fault; of those that
  /// came later each is tried again without it. True when some were taken back.
  bool CheckFrom(size_t verified) {
    progress_.Stage("checking from other positions", 0);
    size_t holds = verified, fails = history_.size();
    if (verified == 0) Accept(CheckAloud(history_.front(), "the whole set"));
    for (size_t next = history_.size() - 1; holds < next; next = (holds + fails) / 2) {
      const Check check = CheckAloud(history_[next], std::to_string(next) + " decisions");
      if (check.Holds(options_.max_loss_db)) {
        holds = next;
        Accept(check);
      } else {
        fails = next;
      }
    }
    return TakeBackFrom(holds);
  }

  bool TakeBackFrom(size_t holds) {
    const std::vector<Setting> history = history_;
    const std::vector<Removal> decisions = report_.removed;
    const std::vector<Move> moves = moves_;
    history_.resize(holds + 1);
    report_.removed.resize(holds);
    moves_.resize(holds);
    int tries = 0;
    for (size_t n = holds; n < decisions.size(); ++n) {
      const Setting candidate = Redone(history_.back(), history[n], history[n + 1]);
      const bool tried = n > holds && tries < kMaxTriedAgain;
      const Check check = tried ? CheckAloud(candidate, "again " + decisions[n].what) : Check{};
      tries += tried;
      if (tried && check.Holds(options_.max_loss_db)) {
        Accept(check);
        history_.push_back(candidate);
        report_.removed.push_back(decisions[n]);
        moves_.push_back(moves[n]);
      } else {
        report_.put_back.push_back(decisions[n]);
        // What was not looked at again may be decided again.
        if (tried || n == holds) at_fault_.push_back(moves[n]);
      }
    }
    if (holds == decisions.size()) return false;
    LogAgainFrom(holds);
    measurer_.Accept(history_.back());
    now_ = measurer_.Measure(history_.back());
    ++round_;
    return true;
  }

  /// What each decision from `first` on costs on top of those that are left before it.
  void LogAgainFrom(size_t first) {
    Measured before = first == 0 ? before_ : measurer_.Measure(history_[first]);
    for (size_t n = first; n < report_.removed.size(); ++n) {
      const Measured after = measurer_.Measure(history_[n + 1]);
      Removal& removal = report_.removed[n];
      removal = Removed(removal.kind, removal.what, before, after);
      before = after;
    }
  }

  void Accept(const Check& check) {
    room_db_ = check.RoomDb(options_.max_loss_db);
    report_.checked_probe_loss_db = check.probe_loss_db;
    report_.probe_error_db = check.probe_error_db;
    report_.witness_loss_db = check.witness_loss_db;
    report_.witness_error_db = check.witness_error_db;
    report_.photo_loss_db = check.photo_loss_db;
    report_.photo_frame_loss_db = check.photo_frame_loss_db;
    report_.error_db = check.error_db;
  }

  const DtrSet& set_;
  const PruneOptions& options_;
  Progress& progress_;
  Mover mover_;
  OwnJournal own_;
  Measurer measurer_;

  std::vector<Candidate> candidates_;
  std::vector<Setting> history_;  ///< [n]: after n decisions
  std::vector<Move> moves_;       ///< [n]: what decision n did
  std::vector<Move> at_fault_;    ///< taken back by a check
  Measured before_, now_;
  int round_ = 0;
  double limit_db_ = kDecidingShare * options_.max_loss_db;  ///< on the places that decide
  double room_db_ = 0;                                       ///< left by the last check that held
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
