// MeasureOnOsg() of programs that load OpenSceneGraph for that one table.
#include "cli/osg_bench.h"
#include "dtr/base/library.h"

namespace dtr::cli {

OsgBench MeasureOnOsg(DtrSet set, const std::vector<NovelCamera>& path,
                      const std::vector<RenderOptions>& variants, const Progress& progress) {
  void* const find = FunctionOfLibrary("dtr_osg_bench.so", "dtr_measure_on_osg",
                                       "bench --table osg: OpenSceneGraph cannot be used");
  auto* const measure =
      reinterpret_cast<decltype(&MeasureOnOsg)>(reinterpret_cast<void* (*)()>(find)());
  return measure(std::move(set), path, variants, progress);
}

}  // namespace dtr::cli
