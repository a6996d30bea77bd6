#include "pipeline/dynamic/detail/background_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>

#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/io/image_io.h"
#include "pipeline/core/depth/depth_stage.h"
#include "pipeline/core/depth/grid_files.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr size_t kSamples = 15;  // time steps that the background is found from

std::vector<size_t> SampledSteps(size_t steps) {
  std::vector<size_t> sampled;
  const size_t count = std::min(kSamples, steps);
  for (size_t i = 0; i < count; ++i) sampled.push_back(i * (steps - 1) / (count - 1));
  return sampled;
}

// How many time steps a background is the mean of, and the noise; beside the set's own files.
fs::path SupportFile(const io::SetWriter& writer, const View& view) {
  return writer.work_folder() / "background" / (view.id + ".support");
}

void WriteSupport(const stereo::Background& background, const fs::path& file) {
  Grid<float> support(background.support.width(), background.support.height());
  std::copy(background.support.data().begin(), background.support.data().end(),
            support.data().begin());
  const std::array<const Grid<float>*, 1> grids{&support};
  fs::create_directories(file.parent_path());
  WriteGridFile(file, grids, background.noise);
}

void ReadSupport(const fs::path& file, stereo::Background* background) {
  Grid<float> support;
  background->noise = ReadGridFile(file, std::array{&support});
  background->support = Grid<std::uint8_t>(support.width(), support.height());
  std::transform(support.data().begin(), support.data().end(), background->support.data().begin(),
                 [](float count) { return static_cast<std::uint8_t>(count); });
}

View LoadedImage(const io::SetWriter& writer, const View& view) {
  View loaded = view;
  io::LoadOptions load;
  load.depth = false;
  io::LoadPixels(writer.folder(), loaded, load);
  return loaded;
}

stereo::Background Found(const DtrSet& dynamic, size_t view, const io::SetWriter& writer) {
  std::vector<ImageRgb8> images;
  std::vector<Mask> masks;
  for (const size_t step : SampledSteps(dynamic.frames.size())) {
    View loaded = LoadedImage(writer, dynamic.frames[step].views[view]);
    images.push_back(std::move(loaded.image));
    masks.push_back(std::move(loaded.mask));
  }
  return stereo::FindBackground({images, masks});
}

}  // namespace

BackgroundViews MakeBackgroundViews(const DtrSet& dynamic, io::SetWriter& writer,
                                    Progress& progress) {
  BackgroundViews backgrounds;
  backgrounds.set.unit = dynamic.unit;
  backgrounds.set.world_origin = dynamic.world_origin;
  backgrounds.set.frames.resize(1);
  const std::vector<View>& views = dynamic.frames.front().views;
  progress.Stage("what stands still", static_cast<int>(views.size()));
  std::int64_t known = 0, pixels = 0;
  for (size_t i = 0; i < views.size(); ++i) {
    progress.ThrowIfInterrupted();
    if (views[i].role != ViewRole::kSource) continue;
    View view;
    view.id = "background_" + views[i].id.substr(views[i].id.find('_') + 1);
    view.name = views[i].name;
    view.camera = views[i].camera;
    view.cam_from_world = views[i].cam_from_world;
    stereo::Background background;
    const fs::path support = SupportFile(writer, view);
    if (writer.RestoreView(view) && fs::exists(support)) {
      ReadSupport(support, &background);
    } else {
      background = Found(dynamic, i, writer);
      WriteSupport(background, support);
      view.image = background.image;
      view.mask = Mask(view.camera.width_px(), view.camera.height_px());
      std::transform(background.support.data().begin(), background.support.data().end(),
                     view.mask.data().begin(), [](std::uint8_t count) {
                       return count > 0 ? std::uint8_t{255} : std::uint8_t{0};
                     });
      writer.WriteView(view, dynamic.unit);
      view.image = {};
      view.mask = {};
    }
    for (const std::uint8_t count : background.support.data()) known += count > 0;
    pixels += static_cast<std::int64_t>(background.support.data().size());
    backgrounds.noise.push_back(background.noise);
    backgrounds.set.frames.front().views.push_back(std::move(view));
    progress.Update(static_cast<int>(i) + 1);
  }
  const auto [least, most] =
      std::minmax_element(backgrounds.noise.begin(), backgrounds.noise.end());
  progress.Note(fmt::format(
      "what stands still is seen at some time in {:.1f} % of the pixels; noise of the photos: "
      "{:.2f} "
      "to {:.2f} levels",
      100 * static_cast<double>(known) / static_cast<double>(std::max<std::int64_t>(1, pixels)),
      *least, *most));
  return backgrounds;
}

Mask OpenPixels(const View& background, const View& now, const io::SetWriter& writer) {
  stereo::Background behind;
  ReadSupport(SupportFile(writer, background), &behind);
  behind.image = background.image;
  return stereo::ChangedPixels(now.image, now.mask, behind);
}

std::uint64_t TimeStepBytesOf(const std::vector<View>& views) {
  std::uint64_t bytes = 0;
  for (const View& view : views) bytes += stereo::TimeStepBytes(view.camera);
  return bytes;
}

TimeStepReader::TimeStepReader(const BackgroundViews& backgrounds, std::vector<View> views,
                               const io::SetWriter& writer,
                               stereo::PlaneMapStore& background_planes,
                               stereo::PlaneMapStore* before, int pass, std::uint64_t cache_bytes)
    : backgrounds_(backgrounds),
      views_(std::move(views)),
      writer_(writer),
      background_planes_(background_planes),
      before_(before),
      pass_(pass),
      caches_(TimeStepBytesOf(views_) <= cache_bytes) {}

std::vector<stereo::TimeStepSource> TimeStepReader::Sources() {
  std::vector<stereo::TimeStepSource> sources;
  for (size_t i = 0; i < views_.size(); ++i) sources.push_back({[this, i] { return Load(i); }});
  return sources;
}

double TimeStepReader::OpenShare() const {
  std::int64_t open = 0, all = 0;
  for (const auto& [view, count] : open_) {
    open += count.first;
    all += count.second;
  }
  return all > 0 ? static_cast<double>(open) / static_cast<double>(all) : 0;
}

std::shared_ptr<const stereo::TimeStep> TimeStepReader::Load(size_t view) {
  const std::lock_guard lock(mutex_);
  const auto found = cached_.find(view);
  if (found != cached_.end()) return found->second;
  auto time_step = Read(view);
  const std::vector<std::uint8_t>& open = time_step->open.data();
  open_[view] = {std::count_if(open.begin(), open.end(), [](auto value) { return value != 0; }),
                 static_cast<std::int64_t>(open.size())};
  if (caches_) cached_[view] = time_step;
  return time_step;
}

std::shared_ptr<const stereo::TimeStep> TimeStepReader::Read(size_t view) {
  View behind = backgrounds_.set.frames.front().views[view];
  io::LoadOptions load;
  load.sigma = true;
  io::LoadPixels(writer_.folder(), behind, load);
  const View now = LoadedImage(writer_, views_[view]);
  auto time_step = std::make_shared<stereo::TimeStep>();
  time_step->open = OpenPixels(behind, now, writer_);
  time_step->settled = {std::move(behind.depth), std::move(*behind.inverse_depth_sigma)};
  const int source = static_cast<int>(view);
  time_step->background = *background_planes_.Load(pass_, source);
  if (before_ != nullptr) time_step->before = *before_->Load(pass_, source);
  return time_step;
}

}  // namespace dtr::pipeline
