#include "dtr/io/json_fields.h"

#include <algorithm>
#include <climits>
#include <cmath>

#include "dtr/base/error.h"

namespace dtr::io {
namespace {

constexpr size_t kDeepestNesting = 64;   // recursion of the JSON library stays bounded
constexpr size_t kShownCharacters = 60;  // of a wrong value in an error message

std::string Shown(const Json* value) {
  if (value == nullptr) return "nothing";
  std::string text = value->dump(-1, ' ', true, Json::error_handler_t::replace);
  if (text.size() > kShownCharacters) text = text.substr(0, kShownCharacters) + "...";
  return text;
}

bool IsFlatArray(const Json& value) {
  return value.is_array() && std::none_of(value.begin(), value.end(),
                                          [](const Json& item) { return item.is_structured(); });
}

// Like dump(2), but arrays of plain values stay on one line: a position is one thing to read.
void AppendPretty(const Json& value, const std::string& indent, std::string& out) {
  if (!value.is_structured() || value.empty()) {
    out += value.dump();
    return;
  }
  const bool flat = IsFlatArray(value);
  const std::string deeper = flat ? "" : "\n" + indent + "  ";
  const char open = value.is_array() ? '[' : '{', close = value.is_array() ? ']' : '}';
  const char* separator = "";
  out += open;
  for (auto item = value.begin(); item != value.end(); ++item) {
    out += separator;
    out += deeper;
    if (value.is_object()) out += Json(item.key()).dump() + ": ";
    AppendPretty(*item, indent + "  ", out);
    separator = flat ? ", " : ",";
  }
  if (!flat) out += "\n" + indent;
  out += close;
}

/// Builds the value that the parser reads, and checks it meanwhile. Json::parse with a callback
/// would check the same, but looks through the whole array whenever an object in it ends.
class CheckingBuilder final : public Json::json_sax_t {
 public:
  CheckingBuilder(const std::string& text, const std::string& where) : text_(text), where_(where) {}
  Json Built() { return std::move(root_); }

  bool null() override { return Add(Json()); }
  bool boolean(bool value) override { return Add(value); }
  bool number_integer(number_integer_t value) override { return Add(value); }
  bool number_unsigned(number_unsigned_t value) override { return Add(value); }
  bool number_float(number_float_t value, const string_t&) override { return Add(value); }
  bool string(string_t& value) override { return Add(std::move(value)); }
  bool binary(binary_t& value) override { return Add(std::move(value)); }
  bool start_object(size_t) override { return Open(Json::object()); }
  bool end_object() override { return Close(); }
  bool start_array(size_t) override { return Open(Json::array()); }
  bool end_array() override { return Close(); }
  bool key(string_t& key) override {
    ExpectDepth();
    Json& object = *open_.back();
    if (object.contains(key)) {
      throw Error(where_ + ": the key '" + key + "' stands twice in an object");
    }
    field_ = &object[key];
    return true;
  }
  bool parse_error(size_t position, const std::string&, const Json::exception& error) override {
    if (dynamic_cast<const Json::parse_error*>(&error) == nullptr) {  // beyond the range of double
      throw Error(where_ + ": expected JSON with finite numbers: " + error.what());
    }
    throw Error(where_ + ": expected JSON, found an error after byte " + std::to_string(position) +
                " of " + std::to_string(text_.size()) + "; is the file whole?");
  }

 private:
  void ExpectDepth() const {
    if (open_.size() <= kDeepestNesting) return;
    throw Error(where_ + ": expected at most " + std::to_string(kDeepestNesting) +
                " levels of nesting, found more");
  }
  Json& Put(Json value) {
    ExpectDepth();
    if (open_.empty()) return root_ = std::move(value);
    if (!open_.back()->is_array()) return *field_ = std::move(value);
    open_.back()->push_back(std::move(value));
    return open_.back()->back();
  }
  bool Add(Json value) {
    Put(std::move(value));
    return true;
  }
  bool Open(Json empty) {
    open_.push_back(&Put(std::move(empty)));
    return true;
  }
  bool Close() {
    open_.pop_back();
    return true;
  }

  const std::string &text_, &where_;
  Json root_;
  std::vector<Json*> open_;  // objects and arrays
  Json* field_ = nullptr;    // of the innermost one, an object: what the next value is for
};

}  // namespace

Json ParseJson(const std::string& text, const std::string& where) {
  if (text.empty()) throw Error(where + ": expected JSON, found an empty file; copy it again");
  CheckingBuilder builder(text, where);
  Json::sax_parse(text, &builder);
  return builder.Built();
}

std::string PrettyJson(const Json& value, const std::string& where) {
  try {
    std::string text;
    AppendPretty(value, "", text);
    return text + "\n";
  } catch (const Json::exception& error) {
    throw Error(where + ": expected text in UTF-8: " + error.what() + "; rename the file it names");
  }
}

JsonObject::JsonObject(const Json& value, std::string file, std::string path)
    : value_(&value), file_(std::move(file)), path_(std::move(path)) {
  if (value.is_object()) return;
  throw Error(file_ + ": " + (path_.empty() ? "" : path_ + ": ") + "expected an object, found " +
              Shown(&value));
}

const Json* JsonObject::Find(const std::string& key) const {
  asked_.insert(key);
  const auto found = value_->find(key);
  return found == value_->end() || found->is_null() ? nullptr : &*found;
}

std::string JsonObject::PathOf(const std::string& key) const {
  return path_.empty() ? key : path_ + "." + key;
}

void JsonObject::Fail(const std::string& key, const std::string& expected) const {
  const auto found = value_->find(key);  // null is shown as null
  Fail(key, expected, Shown(found == value_->end() ? nullptr : &*found));
}

void JsonObject::Fail(const std::string& key, const std::string& expected,
                      const std::string& found) const {
  throw Error(file_ + ": " + PathOf(key) + ": expected " + expected + ", found " + found);
}

bool JsonObject::Has(const std::string& key) const { return Find(key) != nullptr; }

std::string JsonObject::String(const std::string& key) const {
  const Json* value = Find(key);
  if (value == nullptr || !value->is_string()) Fail(key, "a string");
  return value->get<std::string>();
}

double JsonObject::Number(const std::string& key) const {
  const Json* value = Find(key);
  if (value == nullptr || !value->is_number()) Fail(key, "a number");
  return value->get<double>();
}

double JsonObject::Positive(const std::string& key) const {
  const Json* value = Find(key);
  if (value == nullptr || !value->is_number() || !(value->get<double>() > 0)) {
    Fail(key, "a positive number");
  }
  return value->get<double>();
}

int JsonObject::PositiveInt(const std::string& key) const {
  const Json* value = Find(key);
  if (value == nullptr || !value->is_number_integer() || value->get<double>() < 1 ||
      value->get<double>() > INT_MAX) {
    Fail(key, "a positive whole number");
  }
  return value->get<int>();
}

std::uint64_t JsonObject::Unsigned(const std::string& key) const {
  const Json* value = Find(key);
  if (value == nullptr || !value->is_number_unsigned()) Fail(key, "a whole number of at least 0");
  return value->get<std::uint64_t>();
}

Eigen::VectorXd JsonObject::Numbers(const std::string& key, int count) const {
  const Json* value = Find(key);
  const std::string expected = std::to_string(count) + " numbers";
  if (value == nullptr || !value->is_array() || value->size() != static_cast<size_t>(count)) {
    Fail(key, expected);
  }
  Eigen::VectorXd numbers(count);
  for (int i = 0; i < count; ++i) {
    const Json& item = (*value)[static_cast<size_t>(i)];
    if (!item.is_number()) Fail(key + "[" + std::to_string(i) + "]", "a number", Shown(&item));
    numbers[i] = item.get<double>();
  }
  return numbers;
}

JsonObject JsonObject::Object(const std::string& key) const {
  const Json* value = Find(key);
  if (value == nullptr) Fail(key, "an object");
  return {*value, file_, PathOf(key)};
}

const Json& JsonObject::Array(const std::string& key) const {
  const Json* value = Find(key);
  if (value == nullptr || !value->is_array()) Fail(key, "an array");
  return *value;
}

JsonObject JsonObject::Item(const std::string& array_key, size_t index) const {
  return {Array(array_key).at(index), file_, PathOf(array_key) + "[" + std::to_string(index) + "]"};
}

Json JsonObject::Unknown() const {
  Json unknown = Json::object();
  for (const auto& [key, value] : value_->items()) {
    if (asked_.count(key) == 0) unknown[key] = value;
  }
  return unknown;
}

}  // namespace dtr::io
