#include "cli/option_names.h"

#include <algorithm>
#include <set>

#include "dtr/base/utf8.h"

namespace dtr::cli {
namespace {

constexpr char kQuote = '`';

std::set<std::string>& Known() {
  static std::set<std::string> known;
  return known;
}

}  // namespace

void LearnOptionNames(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) Known().insert(name);
  }
  for (const CLI::App* command : app.get_subcommands({})) LearnOptionNames(*command);
}

std::string WithOptionNames(const std::string& message) {
  std::string text;
  size_t at = 0;
  while (at < message.size()) {
    const size_t open = message.find(kQuote, at);
    const size_t close = open == std::string::npos ? open : message.find(kQuote, open + 1);
    if (close == std::string::npos) break;
    std::string option = message.substr(open + 1, close - open - 1);
    std::replace(option.begin(), option.end(), '_', '-');
    text += message.substr(at, open - at);
    if (Known().contains(option)) {
      text += "--" + option;
      at = close + 1;
    } else {
      text += message.substr(open, close - open);  // the second may open the next name
      at = close;
    }
  }
  return text + message.substr(at);
}

std::string ShownText(const std::string& message) {
  return WithoutDirectionMarks(WithOptionNames(message));
}

}  // namespace dtr::cli
