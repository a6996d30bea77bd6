// dtr/io/formats/transforms_lens.h -- the camera models of a transforms.json. Internal.
#pragma once
#include <string>

#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/json_fields.h"

namespace dtr::io::internal {

/// A field of the frame, else of the whole file.
class FrameFields {
 public:
  FrameFields(const Json& root, const Json& frame, std::string where)
      : root_(root), frame_(frame), where_(std::move(where)) {}
  bool Has(const char* key) const { return frame_.contains(key) || root_.contains(key); }
  const Json& Holder(const char* key) const { return frame_.contains(key) ? frame_ : root_; }
  double Number(const char* key) const { return NumberField(Holder(key), key, where_); }
  double NumberOrZero(const char* key) const { return Has(key) ? Number(key) : 0.0; }
  double Positive(const char* key) const;
  const std::string& where() const { return where_; }

 private:
  const Json& root_;
  const Json& frame_;
  std::string where_;
};

/// The distortion of a frame's camera, which without it is `camera`; empty: none. Throws Error for
/// what is neither a perspective camera nor a fisheye, and for contradictions.
std::optional<Distortion> DistortionFrom(const FrameFields& fields, const PinholeCamera& camera);

/// Names of the fields that DistortionFrom reads.
const std::vector<std::string>& DistortionFields();

}  // namespace dtr::io::internal
