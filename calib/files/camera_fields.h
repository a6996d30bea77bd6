// calib/files/camera_fields.h -- the fields of a camera in OpenCV's YAML and XML, and what holds
// for all files of cameras. Internal.
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace dtr::calib {

constexpr int kLongestSidePx = 1'000'000;  // of a camera in any file

/// A key at the margin of a file, and what stands behind it: the rest of its line and the indented
/// lines below. A matrix of an XML file reads "data: [ a, b, ... ]", as it does in YAML.
struct Field {
  std::string name, text;
};

enum class FieldRole { kMatrix, kDistortion, kWidth, kHeight, kSize };

/// The fields by what they are for: programs call the same matrix camera_matrix, cameraMatrix, K or
/// mtx. Throws Error naming the file where it is neither YAML nor XML, a key stands twice, or two
/// fields could be meant.
class CameraFields {
 public:
  CameraFields(const std::string& content, std::string where);

  /// Null where no field has a name of this role.
  const Field* Find(FieldRole role) const;
  /// Throws Error that says which names are looked for, which the file has, and whose file it seems
  /// to be.
  const Field& Get(FieldRole role) const;
  const Field* Named(std::string_view name) const;

 private:
  std::string where_;
  std::vector<Field> fields_;
};

/// Without blanks around it.
std::string_view Trimmed(std::string_view text);
/// The beginning of what was found, fit for a message of one line.
std::string Shown(std::string_view text);

}  // namespace dtr::calib
