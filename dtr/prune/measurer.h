// dtr/prune/measurer.h -- what settings lose and take, by drawing them.
#pragma once
#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/prune/image_loss.h"
#include "dtr/prune/setting.h"

namespace dtr::prune {

/// Numbers by name, kept where an interrupted run finds them again.
class Journal {
 public:
  virtual ~Journal() = default;
  /// At least `least` numbers, or none. Throws Error where fewer were kept: another program's.
  virtual std::optional<std::vector<double>> Find(const std::string& name, size_t least) const = 0;
  virtual void Add(const std::string& name, const std::vector<double>& numbers) = 0;
};

struct Measured {
  double loss_db = 0;
  double bytes = 0;
  double frame = 0;  ///< Mover::FrameOf
};

/// What an outcome loses at places that decided nothing.
struct Check {
  double probe_loss_db = 0, probe_error_db = 0;  ///< mean over places, and its standard error
  double witness_loss_db = 0, witness_error_db = 0;
  std::optional<double> photo_loss_db, photo_frame_loss_db;
  double error_db = 0;  ///< PSNR of the witnesses' images before
  /// Few places can be lucky: a loss is taken for as large as it may well be elsewhere. Two
  /// standard errors above the mean from between the cameras, as many as one likes; one above it
  /// where photos are: these are few, differ more from each other than what is lost, and two would
  /// reject steps that photos gain by.
  bool Holds(double max_db) const { return RoomDb(max_db) >= 0; }
  /// What may be lost on top before it holds no longer.
  double RoomDb(double max_db) const {
    return max_db -
           std::max(probe_loss_db + 2 * probe_error_db, witness_loss_db + witness_error_db);
  }
};

struct MeasurerOptions {
  int probes = 12, checks = 8, probe_crop = 2;
  std::uint64_t seed = 0;
  double other_bytes = 0;
  RenderOptions render;  ///< of the set as it is before
};

class Measurer {
 public:
  /// All but the options must outlive this.
  Measurer(const DtrSet& set, const MeasurerOptions& options, const CodeFunction& code,
           const RendererMaker& make_renderer, const Mover& mover, Journal& journal,
           Progress& progress)
      : set_(set),
        options_(options),
        code_(code),
        make_(make_renderer),
        mover_(mover),
        journal_(journal),
        progress_(progress) {}

  /// At the deciding places: the larger of the losses at photos and from novel cameras.
  Measured Measure(const Setting& setting);
  /// Without looking: for what no image shows.
  double BytesOf(const Setting& setting);
  Check CheckOf(const Setting& setting);
  /// Keeps this setting's set in memory: the next ones are tried beside it.
  void Accept(const Setting& setting);
  /// So many measurements were found in the journal before anything was drawn.
  int found() const { return found_; }

 private:
  using Coded = std::shared_ptr<const CodedSet>;
  struct Looks {
    std::vector<Place> places;
    std::vector<ImageRgb8> before;
    /// By KeyOf, with nothing removed: of the last settings.
    std::deque<std::pair<std::string, std::vector<ImageRgb8>>> kept;
  };
  /// From the journal, else by `measure`; `least`: how many it gives at least.
  std::vector<double> Numbers(const std::string& name, size_t least,
                              const std::function<std::vector<double>()>& measure);
  const eval::RenderFunction& RendererFor(const Coded& coded);
  Coded CodedAs(const Coding& coding);
  double BytesOf(const Setting& setting, const CodedSet& coded) const;
  Errors AtPhotos(const std::string& what, const Looks& looks, Setting setting);
  /// `with_all_at_photos`: of the setting with nothing removed.
  std::vector<double> NovelLossesDb(Looks& looks, const Setting& setting,
                                    const Errors& with_all_at_photos);
  const std::vector<ImageRgb8>& KeptImages(Looks& looks, const Setting& kept);
  /// Images of the whole set, once they are needed.
  void Prepare();
  std::vector<ImageRgb8> ImagesOf(const Setting& setting, const Coded& coded, const Looks& looks,
                                  std::vector<Mask>* coverage = nullptr);

  const DtrSet& set_;
  const MeasurerOptions options_;
  const CodeFunction& code_;
  const RendererMaker& make_;
  const Mover& mover_;
  Journal& journal_;
  Progress& progress_;

  bool prepared_ = false;
  int found_ = 0;
  Looks deciding_, deciding_novel_, checking_, witnesses_, photos_;
  std::vector<Place> photos_whole_;  ///< the held-out photos with all of their pixels
  Coded current_, trial_, drawn_;
  Coding current_coding_, trial_coding_;
  eval::RenderFunction render_;
};

}  // namespace dtr::prune
