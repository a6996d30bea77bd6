#include "dtr/io/formats/text_numbers.h"

#include <algorithm>
#include <cmath>

#include "dtr/base/error.h"
#include "dtr/base/text_file.h"

namespace dtr::io::internal {
namespace {

constexpr std::uintmax_t kMaxTextBytes = 64u << 20;

std::string Shown(std::string_view word) {
  constexpr size_t kMaxShown = 40;
  std::string shown(word.substr(0, kMaxShown));
  for (char& c : shown) {
    if (static_cast<unsigned char>(c) < 32 || static_cast<unsigned char>(c) > 126) c = '?';
  }
  return shown;
}

}  // namespace

TextNumbers::TextNumbers(const std::filesystem::path& file)
    : text_(ReadTextFile(file, kMaxTextBytes)), source_(file.string()) {}

TextNumbers::TextNumbers(std::string text, std::string source)
    : text_(std::move(text)), source_(std::move(source)) {}

bool TextNumbers::AtEnd() {
  while (position_ < text_.size() && IsBlank(text_[position_])) {
    if (text_[position_] == '\n') ++line_;
    ++position_;
  }
  return position_ == text_.size();
}

std::string_view TextNumbers::Line() {
  word_line_ = line_;
  const size_t begin = position_;
  const size_t end = std::min(text_.find('\n', begin), text_.size());
  position_ = std::min(end + 1, text_.size());
  if (end < text_.size()) ++line_;
  return std::string_view(text_).substr(begin, end - begin);
}

void TextNumbers::ExpectEnd() {
  if (AtEnd()) return;
  const std::string found = Shown(Next());
  throw Error(Where() + "expected the end of the file, found \"" + found + "\"");
}

std::string_view TextNumbers::Next() {
  if (AtEnd()) return {};
  word_line_ = line_;
  const size_t begin = position_;
  while (position_ < text_.size() && !IsBlank(text_[position_])) ++position_;
  return std::string_view(text_).substr(begin, position_ - begin);
}

std::string TextNumbers::Where() const { return source_ + ":" + std::to_string(word_line_) + ": "; }

std::string TextNumbers::Word(const char* what) {
  const std::string_view word = Next();
  if (word.empty()) {
    throw Error(source_ + ": expected " + what + ", found the end of the file");
  }
  return std::string(word);
}

double TextNumbers::Number(const char* what) {
  const std::string word = Word(what);
  if (const auto number = FiniteNumber(word)) return *number;
  throw Error(Where() + "expected " + what + " as a finite number, found \"" + Shown(word) + "\"" +
              DecimalCommaHint(word));
}

int TextNumbers::Int(const char* what, int min, int max) {
  const double number = Number(what);
  if (number != std::floor(number) || number < min || number > max) {
    throw Error(Where() + "expected " + what + " as a whole number from " + std::to_string(min) +
                " to " + std::to_string(max) + ", found " + std::to_string(number));
  }
  return static_cast<int>(number);
}

Eigen::Matrix3d TextNumbers::Matrix3(const char* what) {
  Eigen::Matrix3d matrix;
  for (int i = 0; i < 9; ++i) matrix(i / 3, i % 3) = Number(what);
  return matrix;
}

Eigen::Matrix4d TextNumbers::Matrix4(const char* what) {
  Eigen::Matrix4d matrix;
  for (int i = 0; i < 16; ++i) matrix(i / 4, i % 4) = Number(what);
  return matrix;
}

Eigen::Vector3d TextNumbers::Vector3(const char* what) {
  Eigen::Vector3d vector;
  for (int i = 0; i < 3; ++i) vector(i) = Number(what);
  return vector;
}

}  // namespace dtr::io::internal
