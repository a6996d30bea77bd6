// What a program finds in the module: see on_demand.cpp.
#include "dtr/io/image_codecs.h"

extern "C" __attribute__((visibility("default"))) const dtr::io::ImageCodecs* dtr_image_codecs() {
  return &dtr::io::Codecs();
}
