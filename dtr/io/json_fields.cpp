#include "dtr/io/json_fields.h"

#include <algorithm>
#include <climits>
#include <cmath>

#include "dtr/base/error.h"

namespace dtr::io {
namespace {

constexpr int kDeepestNesting = 64;      // recursion of the JSON library stays bounded
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

}  // namespace

Json ParseJson(const std::string& text, const std::string& where) {
  std::vector<std::set<std::string>> keys;  // of the objects that are open
  const auto check = [&](int depth, Json::parse_event_t event, const Json& parsed) {
    if (depth > kDeepestNesting) {
      throw Error(where + ": expected at most " + std::to_string(kDeepestNesting) +
                  " levels of nesting, found more");
    }
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::object_end) keys.pop_back();
    if (event == Json::parse_event_t::key &&
        !keys.back().insert(parsed.get<std::string>()).second) {
      throw Error(where + ": the key '" + parsed.get<std::string>() +
                  "' stands twice in an object");
    }
    return true;
  };
  if (text.empty()) throw Error(where + ": expected JSON, found an empty file; copy it again");
  try {
    return Json::parse(text, check);
  } catch (const Json::parse_error& error) {
    throw Error(where + ": expected JSON, found an error after byte " + std::to_string(error.byte) +
                " of " + std::to_string(text.size()) + "; is the file whole?");
  } catch (const Json::exception& error) {  // a number beyond the range of double
    throw Error(where + ": expected JSON with finite numbers: " + error.what());
  }
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
