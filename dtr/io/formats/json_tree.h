// dtr/io/formats/json_tree.h -- checked access to the JSON of other programs' scenes. Internal to
// dtr/io/formats.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace dtr::io::internal {

/// Objects are looked up by a search tree: scenes have objects of a million points by id.
using Tree = nlohmann::json;

/// The file's content; throws Error where it is larger than any scene or no JSON.
Tree ReadTree(const std::filesystem::path& file);

/// The member; null where there is none or it is null.
const Tree* Find(const Tree& object, const char* key);
/// The same; throws Error naming `where` where there is none.
const Tree& Get(const Tree& object, const char* key, const std::string& where);
/// A member that is a list.
const Tree& GetList(const Tree& object, const char* key, const std::string& where);

/// A finite number, also one that is written as a string ("36.0"), as Boost's property trees do.
double NumberFrom(const Tree& value, const std::string& where);
double GetNumber(const Tree& object, const char* key, const std::string& where);
double GetNumberOr(const Tree& object, const char* key, double otherwise, const std::string& where);
/// Exactly `count` finite numbers.
std::vector<double> GetNumbers(const Tree& object, const char* key, size_t count,
                               const std::string& where);
Eigen::Vector3d GetVector(const Tree& object, const char* key, const std::string& where);
/// Width or height of an image, in [1, kMaxImageSidePx].
int GetSide(const Tree& object, const char* key, const std::string& where);
/// A whole number of at most 64 bits, or one written as a string.
std::uint64_t IdFrom(const Tree& value, const std::string& where);
std::uint64_t GetId(const Tree& object, const char* key, const std::string& where);
std::string GetText(const Tree& object, const char* key, const std::string& where);

}  // namespace dtr::io::internal
