// pipeline/core/room.h -- what work on several views at a time may use.
#pragma once

namespace dtr::pipeline {

struct Room {
  int threads = 0;       ///< 0: all cores
  double memory_gb = 0;  ///< GB of 1e9 bytes for all that the program holds; 0: no bound
};

}  // namespace dtr::pipeline
