// tests/support/environment.h -- variables of the environment, for the length of a scope.
#pragma once
#include <cstdlib>
#include <optional>
#include <string>

namespace dtr::testing {

/// Sets a variable; what it was before, also unset, comes back at the end of the scope.
class Environment {
 public:
  Environment(const char* name, const std::string& value) : name_(name) {
    if (const char* old = std::getenv(name)) old_ = old;
    setenv(name, value.c_str(), 1);
  }
  ~Environment() { old_ ? setenv(name_, old_->c_str(), 1) : unsetenv(name_); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  const char* name_;
  std::optional<std::string> old_;
};

}  // namespace dtr::testing
