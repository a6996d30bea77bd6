// tests/support/message_of.h -- what an error says.
#pragma once
#include <gtest/gtest.h>

#include <string>

namespace dtr::testing {

/// The message of the Error that `action` throws; fails the test when it throws none.
template <typename Exception, typename Action>
std::string MessageOf(const Action& action) {
  try {
    action();
  } catch (const Exception& e) {
    return e.what();
  }
  ADD_FAILURE() << "no error was thrown";
  return "";
}

}  // namespace dtr::testing
