#include "dtr/base/memory_budget.h"

#include "dtr/base/error.h"

namespace dtr {

void RequireMemory(double bytes, double limit_gb, const std::string& subject,
                   const std::string& advice) {
  if (limit_gb <= 0 || bytes <= kAlwaysAllowedBytes || bytes <= limit_gb * kBytesPerGigabyte) {
    return;
  }
  char limit[32];
  std::snprintf(limit, sizeof limit, "%g", limit_gb);
  throw Error(subject + " takes " + GigabytesText(bytes) + " GB of memory, more than `memory` " +
              limit + "; " + advice);
}

}  // namespace dtr
