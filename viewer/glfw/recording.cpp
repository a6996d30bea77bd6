#include "viewer/glfw/recording.h"

#include <chrono>
#include <utility>

#include "dtr/base/progress.h"
#include "dtr/base/thread_if_any.h"

namespace dtr::viewer {
namespace {

/// Says nothing and stops when told to.
class Stoppable final : public Progress {
 public:
  explicit Stoppable(const std::atomic<bool>& stop) : stop_(stop) {}
  void Stage(const std::string&, int) override {}
  void Update(int) override {}
  void Note(const std::string&) override {}
  bool StopRequested() const override { return stop_; }

 private:
  const std::atomic<bool>& stop_;
};

}  // namespace

Recording::Recording(const std::filesystem::path& target, std::vector<NovelCamera> cameras)
    : target_(target),
      cameras_(std::move(cameras)),
      writer_(std::make_unique<io::VideoWriter>(target, io::kVideoFramesPerSecond)) {}

Recording::~Recording() {
  stop_ = true;
  if (encoding_.valid()) encoding_.wait();
}

const NovelCamera* Recording::Wanted() const {
  return drawn_ < cameras_.size() ? &cameras_[drawn_] : nullptr;
}

void Recording::Add(const ImageRgb8& picture) {
  writer_->Add(picture);
  if (++drawn_ < cameras_.size()) return;
  encoding_ = std::async(kThreadIfAny, [this] { writer_->Finish(Stoppable(stop_)); });
}

bool Recording::Done() {
  if (!encoding_.valid() ||
      encoding_.wait_for(std::chrono::seconds(0)) == std::future_status::timeout) {
    return false;
  }
  encoding_.get();
  return true;
}

}  // namespace dtr::viewer
