// dtr/base/error.h -- the two ways a job can be rejected.
#pragma once
#include <stdexcept>
#include <string>

namespace dtr {

/// The job cannot be done: a file, the data or a helper program is not as it must be. Exit code 1.
/// The message is one line: what, where, expected, found, what to do.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The request itself is wrong: an option, a name, an output that exists. Exit code 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

/// The photos do not show enough to decide what was asked.
class NotDecidable : public Error {
 public:
  using Error::Error;
};

/// Cameras that were given contradict their photos, and what explains it is in the message.
class CamerasContradicted : public Error {
 public:
  using Error::Error;
};

/// The user asked to stop (Ctrl-C). What was finished is kept. Exit code 1.
class Interrupted : public Error {
 public:
  using Error::Error;
};

}  // namespace dtr
