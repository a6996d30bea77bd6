// dtr/io/formats/json_fields.h -- checked access to JSON fields. Internal to dtr/io/formats: the
// only header here that shows nlohmann's types.
#pragma once
#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace dtr::io::internal {

using Json = nlohmann::ordered_json;

/// Parsed text; throws Error "source: ..." on broken JSON.
Json ParseJson(std::string_view text, const std::string& source);

/// The member `key` of an object; throws Error naming `where` when it is absent.
const Json& Field(const Json& object, const char* key, const std::string& where);

/// A finite number.
double NumberFrom(const Json& value, const std::string& where);
double NumberField(const Json& object, const char* key, const std::string& where);

/// A whole number in [min, max]; 960.0 counts as whole.
int IntField(const Json& object, const char* key, int min, int max, const std::string& where);

std::string StringField(const Json& object, const char* key, const std::string& where);

/// A 4x4 matrix as 4 rows of 4 numbers; also accepts 3 rows (then 0 0 0 1 is added) if `allow_3x4`.
Eigen::Matrix4d MatrixField(const Json& object, const char* key, bool allow_3x4,
                            const std::string& where);

}  // namespace dtr::io::internal
