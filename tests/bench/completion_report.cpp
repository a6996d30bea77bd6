// completion_report: another completion of a set whose depth was measured, in seconds instead of
// the minutes of `dtr stereo`: for docs/accuracy/RENDERING.md, "What of it pays".
//
//   completion_report SET.dtr NEW.dtr
#include <cstdio>
#include <exception>

#include "dtr/base/progress.h"
#include "dtr/io/set_io.h"
#include "pipeline/core/run/finishing.h"

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::fprintf(stderr, "usage: completion_report SET.dtr NEW.dtr\n");
    return 2;
  }
  constexpr double kMemoryGb = 4;
  dtr::SilentProgress progress;
  dtr::DtrSet set = dtr::io::ReadSet(argv[1]);
  const dtr::SparseScene sparse = dtr::io::LoadSparse(argv[1], set);
  dtr::io::SetWriter writer(argv[2], "{}", false);
  for (dtr::View& view : set.frames.front().views) {
    view.completed_file.reset();
    view.completed_near_z = view.completed_far_z = 0;
    view.completed_steps = 0;
    view.mesh_file.reset();
    view.mesh.reset();
    writer.CopyFiles(argv[1], view);
  }
  dtr::pipeline::CompleteDepth(set, sparse, writer, kMemoryGb, progress);
  dtr::pipeline::WriteMeshes(set, writer, kMemoryGb, progress);
  writer.WriteSparse(set, sparse);
  writer.Finish(set);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "completion_report: %s\n", error.what());
  return 1;
}
