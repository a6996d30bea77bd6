// docs/ERRORS.md is whole: what a `throw Error(...)` or `throw UsageError(...)` spells out stands
// on the page, or in errors_left_out.h with the reason why it need not. Words that a helper puts
// together (a reader's FILE: FIELD: expected X, found Y) are not looked at.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

#include "dtr/base/files.h"
#include "tests/cli/errors_left_out.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxBytes = 1 << 24;
constexpr size_t kMinLetters = 8;  // less is a joint between words of others

/// What one throw spells out.
struct Thrown {
  std::string file;
  int line;
  std::string words;  // the longest piece between numbers and names
};

// Reads C++ from a place on: pieces of text, and whether code lies between them.
class Expression {
 public:
  Expression(std::string_view source, size_t at) : source_(source), at_(at) {}

  // The literals up to the bracket that closes; neighbours are one.
  std::vector<std::string> Literals() {
    std::vector<std::string> literals;
    bool joins = false;
    for (int depth = 1; depth > 0 && at_ < source_.size(); ++at_) {
      const char c = source_[at_];
      if (c == '"') {
        const std::string text = Quoted('"');
        joins ? literals.back() += text : literals.emplace_back(text);
        joins = true;
        continue;
      }
      if (c == '\'') Quoted('\'');
      if (source_.substr(at_).starts_with("//")) at_ = source_.find('\n', at_);
      depth += c == '(' ? 1 : c == ')' ? -1 : 0;
      joins = joins && std::isspace(static_cast<unsigned char>(source_[at_])) != 0;
    }
    return literals;
  }

 private:
  // From the opening mark to the closing one.
  std::string Quoted(char mark) {
    std::string text;
    for (++at_; at_ < source_.size() && source_[at_] != mark; ++at_) {
      if (source_[at_] == '\\') ++at_;
      text += source_[at_];
    }
    return text;
  }

  std::string_view source_;
  size_t at_;
};

// What dtr prints: `max_size` of a library as --max-size (cli/option_names.h).
std::string AsShown(const std::string& literal) {
  static const std::regex field("`([a-z][a-z0-9_]*)`");
  std::string text;
  auto from = literal.begin();
  for (std::sregex_iterator at(literal.begin(), literal.end(), field), end; at != end; ++at) {
    std::string name = (*at)[1].str();
    std::replace(name.begin(), name.end(), '_', '-');
    text.append(from, (*at)[0].first).append("--" + name);
    from = (*at)[0].second;
  }
  return text.append(from, literal.end());
}

// The longest run without a {field} of fmt, less the punctuation around it. `python`: fields are
// shown as they are called.
std::string LongestPiece(const std::vector<std::string>& literals, bool python) {
  std::string longest;
  const auto take = [&longest](std::string_view piece) {
    constexpr std::string_view kAround = " ,;:.'\"()";
    const size_t first = piece.find_first_not_of(kAround);
    if (first == std::string_view::npos) return;
    piece = piece.substr(first, piece.find_last_not_of(kAround) - first + 1);
    if (piece.size() > longest.size()) longest = piece;
  };
  for (const std::string& source : literals) {
    const std::string literal = python ? source : AsShown(source);
    size_t from = 0;
    for (size_t open = literal.find('{'); open != std::string::npos;
         open = literal.find('{', from)) {
      take(std::string_view(literal).substr(from, open - from));
      from = std::min(literal.find('}', open), literal.size() - 1) + 1;
    }
    take(std::string_view(literal).substr(from));
  }
  return longest;
}

std::vector<Thrown> ThrownBy(const fs::path& file) {
  std::vector<Thrown> all;
  const std::string source = ReadFile(file, kMaxBytes);
  for (const std::string start :
       {"throw Error(", "throw UsageError(", "throw dtr::Error(", "throw dtr::UsageError("}) {
    for (size_t at = source.find(start); at != std::string::npos; at = source.find(start, at + 1)) {
      const std::string words = LongestPiece(Expression(source, at + start.size()).Literals(),
                                             file.generic_string().starts_with("python/"));
      if (words.size() < kMinLetters) continue;
      const auto line =
          1 + std::count(source.begin(), source.begin() + static_cast<long>(at), '\n');
      all.push_back({file.generic_string(), static_cast<int>(line), words});
    }
  }
  return all;
}

std::vector<Thrown> EverythingThrown() {
  std::vector<Thrown> all;
  for (const char* folder :
       {"calib", "capture", "cli", "datasets", "dtr", "pipeline", "python", "stereo", "viewer"}) {
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".cpp" && extension != ".h") continue;
      const std::vector<Thrown> thrown = ThrownBy(entry.path());
      all.insert(all.end(), thrown.begin(), thrown.end());
    }
  }
  return all;
}

// Line breaks of the page are spaces.
std::string Page() {
  std::string page = ReadFile("docs/ERRORS.md", kMaxBytes);
  std::replace(page.begin(), page.end(), '\n', ' ');
  return page;
}

bool IsMeant(const LeftOut& left_out, const Thrown& thrown) {
  return thrown.file == left_out.file && thrown.words.find(left_out.words) != std::string::npos;
}

TEST(ErrorsPage, HoldsWhatEveryThrowSpellsOut) {
  const std::string page = Page();
  const std::vector<Thrown> all = EverythingThrown();
  constexpr size_t kSome = 400;  // fewer would mean that they are not found
  EXPECT_GT(all.size(), kSome);
  for (const Thrown& thrown : all) {
    if (page.find(thrown.words) != std::string::npos) continue;
    const bool left_out = std::any_of(std::begin(kLeftOut), std::end(kLeftOut),
                                      [&](const LeftOut& one) { return IsMeant(one, thrown); });
    EXPECT_TRUE(left_out) << thrown.file << ":" << thrown.line
                          << ": docs/ERRORS.md does not list: " << thrown.words;
  }
}

TEST(ErrorsPage, NothingIsLeftOutWithoutNeed) {
  const std::string page = Page();
  const std::vector<Thrown> all = EverythingThrown();
  for (const LeftOut& left_out : kLeftOut) {
    const bool needed = std::any_of(all.begin(), all.end(), [&](const Thrown& thrown) {
      return IsMeant(left_out, thrown) && page.find(thrown.words) == std::string::npos;
    });
    EXPECT_TRUE(needed) << left_out.file << ": '" << left_out.words
                        << "' is on the page or gone: take it out of the list";
  }
}

}  // namespace
}  // namespace dtr::testing
