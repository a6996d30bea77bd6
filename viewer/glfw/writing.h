// viewer/glfw/writing.h -- a scope in which a file may be half-written.
#pragma once
#include "viewer/glfw/app.h"

namespace dtr::viewer {

/// Tells the host, which must outlive it: nobody is to end the program meanwhile.
class Writing {
 public:
  explicit Writing(const Host& host) : host_(host) {
    if (host_.writing) host_.writing(true);
  }
  ~Writing() {
    if (host_.writing) host_.writing(false);
  }
  Writing(const Writing&) = delete;
  Writing& operator=(const Writing&) = delete;

 private:
  const Host& host_;
};

}  // namespace dtr::viewer
