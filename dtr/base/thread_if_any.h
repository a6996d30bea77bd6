// dtr/base/thread_if_any.h -- work beside other work, also where the system has no thread left.
#pragma once
#include <future>

namespace dtr {

/// For std::async: a thread of its own; where the system rejects one (limits of processes or
/// memory), whoever takes the result does the work. wait_for() is then never `ready`, and
/// `deferred` at once. (The standard leaves the order open; GCC's and LLVM's libraries try the
/// thread first.)
inline constexpr std::launch kThreadIfAny = std::launch::async | std::launch::deferred;

}  // namespace dtr
