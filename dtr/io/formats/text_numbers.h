// dtr/io/formats/text_numbers.h -- words and numbers out of small text files, with line numbers in
// the errors. Internal to dtr/io/formats.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>

namespace dtr::io::internal {

inline bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

/// Reads blank-separated words of a text. Every error is an Error "source:line: what, ...".
class TextNumbers {
 public:
  /// Whole file; rejects files above 64 MB: the formats read with this hold a few numbers a camera.
  explicit TextNumbers(const std::filesystem::path& file);
  /// A text as of TextOf (dtr/base/text_file.h).
  TextNumbers(std::string text, std::string source);

  bool AtEnd();
  /// What is left of the line, without its end; empty at the end of the text.
  std::string_view Line();
  /// Throws unless nothing is left.
  void ExpectEnd();
  std::string Word(const char* what);
  /// A finite number.
  double Number(const char* what);
  /// A whole number in [min, max].
  int Int(const char* what, int min, int max);
  Eigen::Matrix3d Matrix3(const char* what);  ///< row-major
  Eigen::Matrix4d Matrix4(const char* what);  ///< row-major
  Eigen::Vector3d Vector3(const char* what);

  /// "source:line: " of the word read last, for errors of the caller.
  std::string Where() const;

 private:
  std::string_view Next();

  std::string text_, source_;
  size_t position_ = 0;
  int line_ = 1, word_line_ = 1;
};

}  // namespace dtr::io::internal
