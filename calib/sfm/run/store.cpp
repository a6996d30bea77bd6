#include "calib/sfm/run/store.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "calib/sfm/run/store_reader.h"
#include "dtr/base/durable.h"
#include "dtr/base/file_stream.h"
#include "dtr/base/files.h"
#include "dtr/base/order_statistics.h"

namespace dtr::sfm {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kFeatures = "dtr features 1\n", kMatches = "dtr matches 1\n";

// Before the keypoints and descriptors of a photo.
struct FeatureHeader {
  std::uint64_t photo = 0, count = 0, descriptor_bytes = sizeof(Descriptor);
};

std::uint64_t ContentBytes(const FeatureHeader& header) {
  return header.count * (sizeof(Keypoint) + sizeof(Descriptor));
}

FeatureHeader GetHeader(StoreReader& reader) {
  const auto header = reader.Get<FeatureHeader>();
  if (header.descriptor_bytes != sizeof(Descriptor)) {
    reader.Reject("descriptors of " + std::to_string(header.descriptor_bytes) + " bytes");
  }
  if (header.count > reader.Left() / (sizeof(Keypoint) + sizeof(Descriptor))) {
    reader.Reject("a file cut short");
  }
  return header;
}

template <typename T>
std::string_view BytesOf(const T* values, size_t count) {
  return {reinterpret_cast<const char*>(values), count * sizeof(T)};
}

// A pair, before its matches.
struct PairHeader {
  std::int32_t image_a = 0, image_b = 0, kind = 0, unused = 0;
  std::array<double, 4> wxyz{};
  std::array<double, 3> translation{};
  std::uint64_t matches = 0;
};

calib::LensCamera GetCamera(StoreReader& reader) {
  const auto model = reader.Get<std::int32_t>();
  if (!calib::CameraModelFromId(model)) {
    reader.Reject("a camera of the model " + std::to_string(model));
  }
  calib::LensCamera camera;
  camera.model = static_cast<calib::CameraModel>(model);
  camera.width_px = reader.Get<std::int32_t>();
  camera.height_px = reader.Get<std::int32_t>();
  camera.params = reader.GetAll<double>(reader.Get<std::uint64_t>());
  try {
    camera.Check();
  } catch (const std::invalid_argument& wrong) {
    reader.Reject(wrong.what());
  }
  return camera;
}

// Median angle between the rays of the pair's matches. Pixels without a ray do not count.
double ParallaxOf(const ViewGraph& graph, const PairGeometry& pair) {
  const GraphImage& a = graph.images[static_cast<size_t>(pair.image_a)];
  const GraphImage& b = graph.images[static_cast<size_t>(pair.image_b)];
  const calib::LensCamera& lens_a = graph.cameras[static_cast<size_t>(a.camera)];
  const calib::LensCamera& lens_b = graph.cameras[static_cast<size_t>(b.camera)];
  std::vector<double> angles;
  for (const auto& [in_a, in_b] : pair.matches) {
    const auto ray_a = lens_a.RayFromPixel(a.pixels[in_a]);
    const auto ray_b = lens_b.RayFromPixel(b.pixels[in_b]);
    if (!ray_a || !ray_b) continue;
    const Eigen::Vector3d turned = pair.b_rotation_a * *ray_a;
    angles.push_back(std::atan2(turned.cross(*ray_b).norm(), turned.dot(*ray_b)));
  }
  return angles.empty() ? 0 : UpperMedian(angles);
}

PairGeometry GetPair(StoreReader& reader, const ViewGraph& graph) {
  const auto header = reader.Get<PairHeader>();
  const auto images = static_cast<std::int32_t>(graph.images.size());
  if (header.image_a < 0 || header.image_a >= header.image_b || header.image_b >= images) {
    reader.Reject("a pair of images that it lacks");
  }
  PairGeometry pair;
  pair.image_a = header.image_a;
  pair.image_b = header.image_b;
  pair.kind = static_cast<PairKind>(header.kind);
  if (pair.kind < PairKind::kCalibrated || pair.kind > PairKind::kRotation) {
    reader.Reject("a pair of kind " + std::to_string(header.kind));
  }
  const auto& [w, x, y, z] = header.wxyz;
  pair.b_rotation_a = Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix();
  pair.b_translation_a = Eigen::Vector3d(header.translation.data());
  if (!pair.b_rotation_a.allFinite() || !pair.b_translation_a.allFinite()) {
    reader.Reject("a number that is not finite");
  }
  const auto &in_a = graph.images[static_cast<size_t>(pair.image_a)].pixels,
             &in_b = graph.images[static_cast<size_t>(pair.image_b)].pixels;
  for (const auto& [a, b] : reader.GetAll<std::array<std::uint32_t, 2>>(header.matches)) {
    if (a >= in_a.size() || b >= in_b.size()) {
      reader.Reject("a match of a feature that its image lacks");
    }
    pair.matches.emplace_back(a, b);
  }
  pair.parallax_rad = ParallaxOf(graph, pair);
  return pair;
}

}  // namespace

void FeatureFile::Create(const fs::path& file) { WriteFileAtomically(file, kFeatures); }

void FeatureFile::Add(const fs::path& file, std::span<const size_t> photos,
                      std::span<const Features> features) {
  std::string records;
  for (size_t i = 0; i < photos.size(); ++i) {
    const Features& of_photo = features[i];
    const FeatureHeader header{photos[i], of_photo.keypoints.size()};
    records += BytesOf(&header, 1);
    records += BytesOf(of_photo.keypoints.data(), of_photo.keypoints.size());
    records += BytesOf(of_photo.descriptors.data(), of_photo.descriptors.size());
  }
  AppendDurably(file, records);
}

bool FeatureFile::CutAfter(const fs::path& file, size_t photos) {
  std::uint64_t left = 0;
  try {
    left = FeatureFile(file, photos).left_;
  } catch (const Error&) {
    return false;
  }
  if (left > 0) fs::resize_file(file, fs::file_size(file) - left);
  return true;
}

FeatureFile::FeatureFile(const fs::path& file, size_t photos) : file_(file) {
  StoreReader reader(file, kFeatures);
  const std::uint64_t bytes = kFeatures.size() + reader.Left();
  while (record_of_.size() < photos && (photos != kAll || reader.Left() > 0)) {
    const FeatureHeader header = GetHeader(reader);
    if (!record_of_.emplace(header.photo, Record{bytes - reader.Left(), header.count}).second) {
      reader.Reject("photo " + std::to_string(header.photo) + " twice");
    }
    reader.Skip(ContentBytes(header));
  }
  left_ = reader.Left();
}

FeatureFile::Record FeatureFile::RecordOf(size_t photo) const {
  const auto found = record_of_.find(photo);
  if (found == record_of_.end()) {
    StoreReader(file_, kFeatures).Reject("no features of photo " + std::to_string(photo));
  }
  return found->second;
}

std::vector<Keypoint> FeatureFile::KeypointsOf(size_t photo) const {
  const Record record = RecordOf(photo);
  StoreReader reader(file_, kFeatures);
  reader.Skip(record.offset - kFeatures.size());
  auto keypoints = reader.GetAll<Keypoint>(record.count);
  for (const Keypoint& k : keypoints) {
    if (!std::isfinite(k.x_px) || !std::isfinite(k.y_px) || !std::isfinite(k.scale_px) ||
        !std::isfinite(k.orientation_rad)) {
      reader.Reject("a feature that is not finite");
    }
  }
  return keypoints;
}

std::vector<Descriptor> FeatureFile::DescriptorsOf(size_t photo, size_t first) const {
  const Record record = RecordOf(photo);
  StoreReader reader(file_, kFeatures);
  reader.Skip(record.offset - kFeatures.size() + record.count * sizeof(Keypoint));
  return reader.GetAll<Descriptor>(std::min<std::uint64_t>(first, record.count));
}

Features FeatureFile::Of(size_t photo) const {
  return {KeypointsOf(photo), DescriptorsOf(photo, std::numeric_limits<size_t>::max())};
}

void WriteMatches(const fs::path& file, const ViewGraph& graph) {
  const fs::path temporary = TemporaryFor(file);
  FileStream out(temporary);
  out.Write(kMatches);
  out.Put<std::uint64_t>(graph.cameras.size());
  for (size_t i = 0; i < graph.cameras.size(); ++i) {
    const calib::LensCamera& camera = graph.cameras[i];
    out.Put<std::uint8_t>(graph.focal_is_known[i] ? 1 : 0);
    out.Put(static_cast<std::int32_t>(camera.model));
    out.Put<std::int32_t>(camera.width_px);
    out.Put<std::int32_t>(camera.height_px);
    out.Put<std::uint64_t>(camera.params.size());
    out.Write(BytesOf(camera.params.data(), camera.params.size()));
  }
  out.Put<std::uint64_t>(graph.images.size());
  for (const GraphImage& image : graph.images) out.Put<std::int32_t>(image.camera);
  out.Put<std::uint64_t>(graph.pairs.size());
  for (const PairGeometry& pair : graph.pairs) {
    const Eigen::Quaterniond q(pair.b_rotation_a);
    const Eigen::Vector3d& t = pair.b_translation_a;
    const PairHeader header{pair.image_a,
                            pair.image_b,
                            static_cast<std::int32_t>(pair.kind),
                            0,
                            {q.w(), q.x(), q.y(), q.z()},
                            {t.x(), t.y(), t.z()},
                            pair.matches.size()};
    out.Write(BytesOf(&header, 1));
    out.Write(BytesOf(pair.matches.data(), pair.matches.size()));
  }
  out.Flush();
  PublishFile(temporary, file);
}

ViewGraph ReadMatches(const fs::path& file, const FeatureFile& features,
                      std::span<const std::string> names) {
  StoreReader reader(file, kMatches);
  ViewGraph graph;
  const auto cameras = reader.Get<std::uint64_t>();
  for (std::uint64_t i = 0; i < cameras; ++i) {
    graph.focal_is_known.push_back(reader.Get<std::uint8_t>() != 0);
    graph.cameras.push_back(GetCamera(reader));
  }
  const auto camera_of = reader.GetAll<std::int32_t>(reader.Get<std::uint64_t>());
  if (camera_of.size() != names.size()) {
    reader.Reject(std::to_string(camera_of.size()) + " photos of " + std::to_string(names.size()));
  }
  for (size_t i = 0; i < names.size(); ++i) {
    if (camera_of[i] < 0 || static_cast<size_t>(camera_of[i]) >= graph.cameras.size()) {
      reader.Reject("an image without a camera");
    }
    GraphImage& image = graph.images.emplace_back(GraphImage{names[i], camera_of[i], {}});
    for (const Keypoint& k : features.KeypointsOf(i)) image.pixels.emplace_back(k.x_px, k.y_px);
  }
  const auto pairs = reader.Get<std::uint64_t>();
  for (std::uint64_t i = 0; i < pairs; ++i) graph.pairs.push_back(GetPair(reader, graph));
  if (reader.Left() > 0) reader.Reject("more than it should hold");
  return graph;
}

}  // namespace dtr::sfm
