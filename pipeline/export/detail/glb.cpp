#include "pipeline/export/detail/glb.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <limits>

#include "dtr/base/error.h"
#include "dtr/base/file_stream.h"
#include "pipeline/export/detail/common.h"
#include "viewer/world_up.h"

namespace dtr::pipeline {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinChunk = 0x004E4942;
constexpr int kAttributes = 34962, kIndices = 34963;  // targets of buffer views
constexpr size_t kHeaderBytes = 12, kChunkBytes = 8;

size_t Components(const std::string& type) {
  return type == "SCALAR" ? 1 : static_cast<size_t>(type.back() - '0');
}

std::string Padded(std::string text, char with) {
  text.resize((text.size() + 3) / 4 * 4, with);
  return text;
}

Json NodeOf(const DtrSet& set) {
  const Eigen::Quaterniond q =
      Eigen::Quaterniond::FromTwoVectors(viewer::WorldUp(set), Eigen::Vector3d::UnitY());
  return {{"mesh", 0}, {"rotation", {q.x(), q.y(), q.z(), q.w()}}};
}

}  // namespace

size_t GlbArray::count() const {
  const size_t wide = component_ == kUint8 ? 1 : component_ == kUint16 ? 2 : 4;
  return bytes_.size() / (Components(type_) * wide);
}

Json GlbArray::Accessor(size_t buffer_view) const {
  Json json{{"bufferView", buffer_view},
            {"componentType", static_cast<int>(component_)},
            {"count", count()},
            {"type", type_}};
  if (component_ == kUint8 || component_ == kUint16) json["normalized"] = true;
  if (attribute_ != "POSITION") return json;
  Eigen::Array3f low = Eigen::Array3f::Constant(std::numeric_limits<float>::max()), high = -low;
  for (size_t i = 0; i < count(); ++i) {
    Eigen::Array3f p;
    std::memcpy(p.data(), bytes_.data() + 12 * i, 12);
    low = low.min(p);
    high = high.max(p);
  }
  json["min"] = {low[0], low[1], low[2]};
  json["max"] = {high[0], high[1], high[2]};
  return json;
}

void WriteGlb(const std::filesystem::path& file, const DtrSet& set, const GlbPrimitive& primitive) {
  Json json;
  json["asset"] = {{"version", "2.0"}, {"generator", "dtr " DTR_VERSION}};
  json["asset"]["extras"] = SetFacts(set);
  json["scene"] = 0;
  json["scenes"] = {{{"nodes", {0}}}};
  json["nodes"] = {NodeOf(set)};
  Json own{{"attributes", Json::object()}, {"mode", primitive.mode}};
  size_t bytes = 0;
  for (size_t i = 0; i < primitive.arrays.size(); ++i) {
    const GlbArray& array = primitive.arrays[i];
    if (array.attribute().empty()) {
      own["indices"] = i;
    } else {
      own["attributes"][array.attribute()] = i;
    }
    json["accessors"].push_back(array.Accessor(i));
    json["bufferViews"].push_back({{"buffer", 0},
                                   {"byteOffset", bytes},
                                   {"byteLength", array.bytes().size()},
                                   {"target", array.attribute().empty() ? kIndices : kAttributes}});
    bytes += array.bytes().size();
  }
  Json used = Json::array();
  if (primitive.unlit) {
    json["materials"] = {
        {{"extensions", {{"KHR_materials_unlit", Json::object()}}}, {"doubleSided", true}}};
    own["material"] = 0;
    used.push_back("KHR_materials_unlit");
  }
  if (!primitive.extensions.is_null()) {
    own["extensions"] = primitive.extensions;
    for (const auto& [name, unused] : primitive.extensions.items()) used.push_back(name);
  }
  if (!used.empty()) json["extensionsUsed"] = used;
  json["meshes"] = {{{"primitives", {own}}}};
  json["buffers"] = {{{"byteLength", bytes}}};
  const std::string text = Padded(json.dump(-1, ' ', false, Json::error_handler_t::replace), ' ');
  const size_t total = kHeaderBytes + 2 * kChunkBytes + text.size() + bytes;
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(fmt::format("{}: would take {:.1f} GB, a GLB file holds 4.2; choose .ply",
                            file.filename().string(), static_cast<double>(total) / 1e9));
  }
  FileStream stream(file);
  const auto put = [&](size_t number) { stream.Put(static_cast<std::uint32_t>(number)); };
  for (const size_t number : {size_t{kMagic}, size_t{2}, total, text.size(), size_t{kJsonChunk}}) {
    put(number);
  }
  stream.Write(text);
  put(bytes);
  put(kBinChunk);
  for (const GlbArray& array : primitive.arrays) stream.Write(array.bytes());
  stream.Flush();
}

}  // namespace dtr::pipeline
