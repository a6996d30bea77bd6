// pipeline/export/detail/glb.h -- binary glTF 2.0 files of one primitive (ISO/IEC 12113:2022).
#pragma once
#include <Eigen/Core>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <vector>

#include "dtr/types/dtr_set.h"

namespace dtr::pipeline {

/// Numbers of one attribute, or indices. Elements take a multiple of four bytes.
class GlbArray {
 public:
  enum Component { kUint8 = 5121, kUint16 = 5123, kUint32 = 5125, kFloat = 5126 };
  /// `attribute`: "POSITION", ...; empty: indices. `type`: "SCALAR", "VEC3", "VEC4". Whole numbers
  /// of attributes are shares of the largest ("normalized").
  GlbArray(std::string attribute, std::string type, Component component)
      : attribute_(std::move(attribute)), type_(std::move(type)), component_(component) {}

  template <typename T>
  void Put(T value) {
    static_assert(std::is_arithmetic_v<T>);
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    bytes_.append(bytes, sizeof value);
  }
  void Put(const Eigen::Vector3f& v) {
    for (int c = 0; c < 3; ++c) Put(v[c]);
  }

  const std::string& attribute() const { return attribute_; }
  const std::string& bytes() const { return bytes_; }
  size_t count() const;
  /// The entry of `accessors`; smallest and largest values stand there for POSITION.
  nlohmann::ordered_json Accessor(size_t buffer_view) const;

 private:
  std::string attribute_, type_;
  Component component_;
  std::string bytes_;
};

struct GlbPrimitive {
  int mode = 4;  ///< 0 points, 4 triangles
  std::vector<GlbArray> arrays;
  nlohmann::ordered_json extensions;  ///< of the primitive; may be null
  bool unlit = false;                 ///< colours are shown as they are (KHR_materials_unlit)
};

/// Writes it, turned so that the set's up is glTF's y, with what SetFacts says in `asset.extras`.
/// Throws Error where the file would take more than the 4 GB that the format allows.
void WriteGlb(const std::filesystem::path& file, const DtrSet& set, const GlbPrimitive& primitive);

}  // namespace dtr::pipeline
