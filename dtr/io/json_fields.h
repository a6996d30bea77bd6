// dtr/io/json_fields.h -- for sources that read our JSON files: errors that name the field. Headers
// of ours do not include it.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

namespace dtr::io {

/// Keeps the order of keys, so that what we write is readable and the same every time.
using Json = nlohmann::ordered_json;

/// Parses a JSON text. Throws Error `where: ...` when it is not JSON, repeats a key in an object
/// (two readers would disagree) or nests deeper than any file of ours.
Json ParseJson(const std::string& text, const std::string& where);

/// Pretty text with a final line break; doubles read back exactly. Throws Error when a string is
/// not UTF-8.
std::string PrettyJson(const Json& value, const std::string& where);

/// An object whose fields are asked for one by one. Errors read
/// `file: path.key: expected ..., found ...`. Remembers what was asked for, so that the rest can be
/// kept.
class JsonObject {
 public:
  /// Throws Error when `value` is no object. `value` is borrowed. `path` may be empty.
  JsonObject(const Json& value, std::string file, std::string path);

  /// True when the field is there and not null.
  bool Has(const std::string& key) const;
  std::string String(const std::string& key) const;
  double Number(const std::string& key) const;  ///< finite
  double Positive(const std::string& key) const;
  int PositiveInt(const std::string& key) const;
  std::uint64_t Unsigned(const std::string& key) const;
  /// An array of exactly `count` finite numbers.
  Eigen::VectorXd Numbers(const std::string& key, int count) const;
  JsonObject Object(const std::string& key) const;
  /// The field itself; requires Has(key).
  const Json& Value(const std::string& key) const { return *Find(key); }
  /// An array; at(i) of it has the path `key[i]`.
  const Json& Array(const std::string& key) const;
  JsonObject Item(const std::string& array_key, size_t index) const;

  /// The fields nobody asked for.
  Json Unknown() const;

  [[noreturn]] void Fail(const std::string& key, const std::string& expected) const;
  [[noreturn]] void Fail(const std::string& key, const std::string& expected,
                         const std::string& found) const;

 private:
  const Json* Find(const std::string& key) const;
  std::string PathOf(const std::string& key) const;

  const Json* value_;
  std::string file_, path_;
  mutable std::set<std::string> asked_;
};

}  // namespace dtr::io
