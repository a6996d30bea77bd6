#include "dtr/io/formats/json_tree.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/text_file.h"
#include "dtr/io/formats/cameras_json.h"

namespace dtr::io::internal {
namespace {

constexpr std::uintmax_t kMaxSceneBytes = 512u << 20;  // two million points with their observations

std::string Shown(const Tree& value) {
  return Printable(value.dump(-1, ' ', true, Tree::error_handler_t::replace).substr(0, 40));
}

}  // namespace

Tree ReadTree(const std::filesystem::path& file) {
  try {
    return Tree::parse(ReadTextFile(file, kMaxSceneBytes));
  } catch (const nlohmann::json::exception& e) {
    throw Error(file.string() + ": expected JSON, found " + e.what());
  }
}

const Tree* Find(const Tree& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(key);
  return found == object.end() || found->is_null() ? nullptr : &*found;
}

const Tree& Get(const Tree& object, const char* key, const std::string& where) {
  if (!object.is_object()) throw Error(where + ": expected an object, found " + Shown(object));
  if (const Tree* found = Find(object, key)) return *found;
  throw Error(where + ": expected a field \"" + key + "\", found none");
}

const Tree& GetList(const Tree& object, const char* key, const std::string& where) {
  const Tree& list = Get(object, key, where);
  if (list.is_array()) return list;
  throw Error(fmt::format("{}.{}: expected a list, found {}", where, key, Shown(list)));
}

double NumberFrom(const Tree& value, const std::string& where) {
  double number = NAN;
  if (value.is_number()) {
    number = value.get<double>();
  } else if (value.is_string()) {
    number = FiniteNumber(value.get_ref<const std::string&>()).value_or(NAN);
  }
  if (std::isfinite(number)) return number;
  throw Error(fmt::format("{}: expected a finite number, found {}", where, Shown(value)));
}

double GetNumber(const Tree& object, const char* key, const std::string& where) {
  return NumberFrom(Get(object, key, where), where + "." + key);
}

double GetNumberOr(const Tree& object, const char* key, double otherwise,
                   const std::string& where) {
  return Find(object, key) == nullptr ? otherwise : GetNumber(object, key, where);
}

std::vector<double> GetNumbers(const Tree& object, const char* key, size_t count,
                               const std::string& where) {
  const Tree& list = GetList(object, key, where);
  if (list.size() != count) {
    throw Error(
        fmt::format("{}.{}: expected {} numbers, found {}", where, key, count, list.size()));
  }
  std::vector<double> numbers;
  for (const Tree& value : list) numbers.push_back(NumberFrom(value, where + "." + key));
  return numbers;
}

Eigen::Vector3d GetVector(const Tree& object, const char* key, const std::string& where) {
  const std::vector<double> v = GetNumbers(object, key, 3, where);
  return {v[0], v[1], v[2]};
}

int GetSide(const Tree& object, const char* key, const std::string& where) {
  const double side = GetNumber(object, key, where);
  if (side == std::floor(side) && side >= 1 && side <= kMaxImageSidePx) {
    return static_cast<int>(side);
  }
  throw Error(fmt::format("{}.{}: expected a whole number of 1 to {} pixels, found {}", where, key,
                          kMaxImageSidePx, side));
}

std::uint64_t IdFrom(const Tree& value, const std::string& where) {
  if (value.is_number_unsigned()) return value.get<std::uint64_t>();
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    std::uint64_t id = 0;
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), id);
    if (failure == std::errc() && end == text.data() + text.size()) return id;
  }
  throw Error(fmt::format("{}: expected a number that is an id, found {}", where, Shown(value)));
}

std::uint64_t GetId(const Tree& object, const char* key, const std::string& where) {
  return IdFrom(Get(object, key, where), where + "." + key);
}

std::string GetText(const Tree& object, const char* key, const std::string& where) {
  const Tree& value = Get(object, key, where);
  if (value.is_string()) return value.get<std::string>();
  throw Error(fmt::format("{}.{}: expected a text, found {}", where, key, Shown(value)));
}

}  // namespace dtr::io::internal
