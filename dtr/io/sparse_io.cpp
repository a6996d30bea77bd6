#include "dtr/io/sparse_io.h"

#include <bit>
#include <climits>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/plain_bytes.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

constexpr char kSparseMagic[9] = "DTRSPARS";
constexpr std::uint32_t kVersion = 1;
constexpr std::uint64_t kSparseHeaderBytes = 8 + 4 + 4 + 8 + 8;
constexpr std::uint64_t kPointBytes = 3 * 8;
constexpr std::uint64_t kObservationBytes = 4 + 4 + 2 * 8;
constexpr std::uint64_t kLargestSparseBytes = std::uint64_t{8} << 30;  // 300 million observations

// Reads plain values one after the other; the caller has checked that they are there.
class SparseBytes {
 public:
  explicit SparseBytes(const std::string& content) : at_(content.data()) {}
  template <typename T>
  T Take() {
    T value;
    std::memcpy(&value, at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }

 private:
  const char* at_;
};

// The rules that writer and reader share.
void ExpectGood(const fs::path& file, const SparseScene& scene) {
  const auto reject = [&](const std::string& what, size_t index, const std::string& expected) {
    throw Error(file.string() + ": " + what + " " + std::to_string(index) + ": expected " +
                expected);
  };
  for (size_t i = 0; i < scene.points.size(); ++i) {
    if (!scene.points[i].p_in_world.allFinite()) reject("point", i, "finite coordinates");
  }
  for (size_t i = 0; i < scene.observations.size(); ++i) {
    const SparseObservation& seen = scene.observations[i];
    if (seen.view < 0) reject("observation", i, "a view index of at least 0");
    if (seen.point < 0 || static_cast<size_t>(seen.point) >= scene.points.size()) {
      reject("observation", i, "a point index below " + std::to_string(scene.points.size()));
    }
    if (!seen.pixel.allFinite()) reject("observation", i, "a finite pixel");
    if (i == 0) continue;
    const SparseObservation& before = scene.observations[i - 1];
    if (std::pair(seen.view, seen.point) < std::pair(before.view, before.point)) {
      reject("observation", i, "the order (view, point)");
    }
  }
}

}  // namespace

void WriteSparse(const fs::path& file, const SparseScene& scene) {
  ExpectGood(file, scene);
  std::string out(kSparseMagic, 8);
  out.reserve(kSparseHeaderBytes + scene.points.size() * kPointBytes +
              scene.observations.size() * kObservationBytes);
  Append(out, kVersion);
  Append(out, std::uint32_t{0});
  Append<std::uint64_t>(out, scene.points.size());
  Append<std::uint64_t>(out, scene.observations.size());
  for (const SparsePoint& point : scene.points) {
    for (int k = 0; k < 3; ++k) Append(out, point.p_in_world[k]);
  }
  for (const SparseObservation& seen : scene.observations) {
    Append(out, static_cast<std::uint32_t>(seen.view));
    Append(out, static_cast<std::uint32_t>(seen.point));
    Append(out, seen.pixel.x());
    Append(out, seen.pixel.y());
  }
  WriteFileAtomically(file, out);
}

SparseScene ReadSparse(const fs::path& file) {
  const std::string content = ReadFile(file, kLargestSparseBytes);
  if (content.size() < kSparseHeaderBytes || content.compare(0, 8, kSparseMagic, 8) != 0) {
    throw Error(file.string() + ": expected a sparse scene (magic DTRSPARS), found " +
                std::to_string(content.size()) + " bytes of something else");
  }
  SparseBytes bytes(content);
  bytes.Take<std::uint64_t>();  // the magic
  const auto version = bytes.Take<std::uint32_t>();
  if (version != kVersion || bytes.Take<std::uint32_t>() != 0) {
    throw Error(file.string() + ": expected version 1, found " + std::to_string(version) +
                "; use the version of dtr that wrote it");
  }
  const auto points = bytes.Take<std::uint64_t>();
  const auto observations = bytes.Take<std::uint64_t>();
  // Dividing keeps hostile counts from overflowing the product.
  const std::uint64_t body = content.size() - kSparseHeaderBytes;
  if (points > INT_MAX || points > body / kPointBytes ||
      observations != (body - points * kPointBytes) / kObservationBytes ||
      (body - points * kPointBytes) % kObservationBytes != 0) {
    throw Error(file.string() + ": expected the bytes of " + std::to_string(points) +
                " points and " + std::to_string(observations) + " observations, found " +
                std::to_string(content.size()) + " bytes in all");
  }
  SparseScene scene;
  scene.points.resize(points);
  for (SparsePoint& point : scene.points) {
    for (int k = 0; k < 3; ++k) point.p_in_world[k] = bytes.Take<double>();
  }
  scene.observations.resize(observations);
  for (SparseObservation& seen : scene.observations) {
    const auto view = bytes.Take<std::uint32_t>();
    const auto point = bytes.Take<std::uint32_t>();
    seen.view = view > INT_MAX ? -1 : static_cast<int>(view);
    seen.point = point > INT_MAX ? -1 : static_cast<int>(point);
    seen.pixel.x() = bytes.Take<double>();
    seen.pixel.y() = bytes.Take<double>();
  }
  ExpectGood(file, scene);
  return scene;
}

}  // namespace dtr::io
