#include "dtr/io/formats/json_fields.h"

#include <cmath>

#include "dtr/base/error.h"

namespace dtr::io::internal {

Json ParseJson(std::string_view text, const std::string& source) {
  try {
    return Json::parse(text);
  } catch (const nlohmann::json::exception& e) {
    throw Error(source + ": expected JSON, found " + e.what());
  }
}

const Json& Field(const Json& object, const char* key, const std::string& where) {
  if (!object.is_object()) throw Error(where + ": expected an object, found " + object.type_name());
  const auto found = object.find(key);
  if (found == object.end()) {
    throw Error(where + ": expected a field \"" + key + "\", found none");
  }
  return *found;
}

double NumberFrom(const Json& value, const std::string& where) {
  if (!value.is_number()) {
    throw Error(where + ": expected a number, found " + value.type_name());
  }
  const double number = value.get<double>();
  if (!std::isfinite(number)) throw Error(where + ": expected a finite number, found another");
  return number;
}

double NumberField(const Json& object, const char* key, const std::string& where) {
  return NumberFrom(Field(object, key, where), where + "." + key);
}

int IntField(const Json& object, const char* key, int min, int max, const std::string& where) {
  const double number = NumberField(object, key, where);
  if (number != std::floor(number) || number < min || number > max) {
    throw Error(where + "." + key + ": expected a whole number from " + std::to_string(min) +
                " to " + std::to_string(max) + ", found " + Field(object, key, where).dump());
  }
  return static_cast<int>(number);
}

std::string StringField(const Json& object, const char* key, const std::string& where) {
  const Json& value = Field(object, key, where);
  if (!value.is_string()) {
    throw Error(where + "." + key + ": expected a string, found " + value.type_name());
  }
  return value.get<std::string>();
}

Eigen::Matrix4d MatrixField(const Json& object, const char* key, bool allow_3x4,
                            const std::string& where) {
  const Json& rows = Field(object, key, where);
  const std::string here = where + "." + key;
  if (!rows.is_array() || !(rows.size() == 4 || (allow_3x4 && rows.size() == 3))) {
    throw Error(here + ": expected a 4x4 matrix as 4 rows of 4 numbers, found another shape");
  }
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (size_t i = 0; i < rows.size(); ++i) {
    if (!rows[i].is_array() || rows[i].size() != 4) {
      throw Error(here + "[" + std::to_string(i) + "]: expected 4 numbers, found another shape");
    }
    for (size_t j = 0; j < 4; ++j) {
      matrix(static_cast<int>(i), static_cast<int>(j)) =
          NumberFrom(rows[i][j], here + "[" + std::to_string(i) + "][" + std::to_string(j) + "]");
    }
  }
  return matrix;
}

}  // namespace dtr::io::internal
