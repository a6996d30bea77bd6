// photos_to_set PHOTOS SET.dtr -- calibrates the photos, computes depth, writes a D+TR set.
#include <pipeline/build/build.h>

#include <iostream>

namespace {

// Where long work reports its stages. It is called from several threads.
class Log final : public dtr::Progress {
 public:
  void Stage(const std::string& name, int total) override {
    std::clog << name << ": " << total << " items\n";
  }
  void Update(int) override {}
  void Note(const std::string& line) override { std::clog << line + "\n"; }
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: photos_to_set PHOTOS SET.dtr\n";
    return 2;
  }
  dtr::pipeline::BuildOptions options;
  options.photos = argv[1];
  options.output = argv[2];
  options.depth.preset = "fast";
  options.holdout = "every:8";  // kept out, to measure the set with
  try {
    Log log;
    const dtr::pipeline::BuildReport report = dtr::pipeline::BuildSet(options, log);
    for (const std::string& name : report.not_registered) {
      std::cout << name << ": no camera was found\n";
    }
    std::cout << report.set.frames.front().views.size() << " views, calibration "
              << (report.validation_passed ? "passed" : "failed") << " its validation\n";
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
