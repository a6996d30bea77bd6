// What `dtr` finds in the module with OpenSceneGraph: see osg_on_demand.cpp.
#include "cli/osg_bench.h"

extern "C" __attribute__((visibility("default"))) void* dtr_measure_on_osg() {
  return reinterpret_cast<void*>(&dtr::cli::MeasureOnOsg);
}
