#include "calib/sfm/matching/pair_journal.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <type_traits>

#include "dtr/base/durable.h"
#include "dtr/base/files.h"
#include "dtr/base/hash.h"

namespace dtr::sfm::matching {
namespace {

namespace fs = std::filesystem;

// "dtr pairs 1", the hash of the inputs, an end of line.
constexpr std::string_view kMagic = "dtr pairs 1 ";
constexpr size_t kHash = 64;
// A record: its size in bytes and its hash, then a byte that says what follows.
constexpr size_t kRecordHeader = sizeof(std::uint64_t) + kHash;
constexpr char kPairs = 'p', kCoarse = 'c', kGeometries = 'g';

std::string HashOfText(std::string_view text) {
  return Sha256(std::as_bytes(std::span(text.data(), text.size())));
}

class Writer {
 public:
  explicit Writer(char what) { Put(what); }

  template <typename T>
  void Put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    content_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <typename T>
  void PutAll(const std::vector<T>& values) {
    Put(static_cast<std::uint64_t>(values.size()));
    for (const T& value : values) Put(value);
  }

  /// Size, hash and content.
  std::string Record() const {
    const std::uint64_t size = content_.size();
    return std::string(reinterpret_cast<const char*>(&size), sizeof size) + HashOfText(content_) +
           content_;
  }

 private:
  std::string content_;
};

class Reader {
 public:
  explicit Reader(std::string_view content) : left_(content) {}

  bool AtEnd() const { return left_.empty(); }

  template <typename T>
  bool Get(T* value) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (left_.size() < sizeof *value) return false;
    std::memcpy(value, left_.data(), sizeof *value);
    left_.remove_prefix(sizeof *value);
    return true;
  }
  template <typename T>
  bool GetAll(std::vector<T>* values) {
    std::uint64_t count = 0;
    if (!Get(&count) || count > left_.size() / sizeof(T)) return false;
    values->resize(count);
    return std::all_of(values->begin(), values->end(), [&](T& value) { return Get(&value); });
  }

 private:
  std::string_view left_;
};

// std::pair is not trivially copyable.
struct Two {
  std::int32_t first = 0, second = 0;
};

bool AreFeatures(std::span<const size_t> features, const Two& photos, auto first, auto second) {
  return static_cast<size_t>(first) < features[static_cast<size_t>(photos.first)] &&
         static_cast<size_t>(second) < features[static_cast<size_t>(photos.second)];
}

bool GetPairs(Reader& reader, size_t photos, std::vector<std::pair<int, int>>* pairs) {
  std::vector<Two> read;
  if (!reader.GetAll(&read)) return false;
  for (const Two& p : read) {
    if (p.first < 0 || p.first >= p.second || static_cast<size_t>(p.second) >= photos) return false;
    pairs->emplace_back(p.first, p.second);
  }
  return true;
}

bool GetCoarse(Reader& reader, std::span<const size_t> features, const Two& photos,
               CoarsePair* pair) {
  pair->a = photos.first;
  pair->b = photos.second;
  return reader.GetAll(&pair->matches) &&
         std::all_of(pair->matches.begin(), pair->matches.end(), [&](const CoarseMatch& m) {
           return m.a >= 0 && m.b >= 0 && AreFeatures(features, photos, m.a, m.b);
         });
}

bool GetGeometry(Reader& reader, std::span<const size_t> features, const Two& photos,
                 std::optional<PairGeometry>* geometry) {
  std::uint8_t found = 0;
  if (!reader.Get(&found)) return false;
  if (found == 0) return true;
  PairGeometry& pair = geometry->emplace();
  pair.image_a = photos.first;
  pair.image_b = photos.second;
  std::vector<Two> matches;
  if (!reader.Get(&pair.kind) || !reader.Get(&pair.parallax_rad)) return false;
  for (double& v : pair.b_rotation_a.reshaped()) {
    if (!reader.Get(&v)) return false;
  }
  for (double& v : pair.b_translation_a.reshaped()) {
    if (!reader.Get(&v)) return false;
  }
  if (!reader.GetAll(&matches)) return false;
  for (const Two& m : matches) {
    if (m.first < 0 || m.second < 0 || !AreFeatures(features, photos, m.first, m.second)) {
      return false;
    }
    pair.matches.emplace_back(m.first, m.second);
  }
  return pair.b_rotation_a.allFinite() && pair.b_translation_a.allFinite() &&
         pair.kind >= PairKind::kCalibrated && pair.kind <= PairKind::kRotation;
}

}  // namespace

PairJournal::PairJournal(fs::path file, const std::string& inputs, std::span<const size_t> features)
    : file_(std::move(file)) {
  std::uint64_t whole = 0;
  if (std::ifstream in(file_, std::ios::binary | std::ios::ate); in) {
    const auto size = static_cast<std::uint64_t>(std::max<std::streamoff>(0, in.tellg()));
    in.seekg(0);
    if (ReadHeader(in, inputs)) {
      do {
        whole = static_cast<std::uint64_t>(in.tellg());
      } while (ReadRecord(in, size - whole, features));
    }
  }
  if (whole == 0) {
    WriteFileAtomically(file_, std::string(kMagic) + HashOfText(inputs) + '\n');
  } else {
    // What comes next must not follow a part of a record.
    fs::resize_file(file_, whole);
  }
}

bool PairJournal::ReadHeader(std::istream& in, const std::string& inputs) {
  const std::string expected = std::string(kMagic) + HashOfText(inputs) + '\n';
  std::string header(expected.size(), '\0');
  return in.read(header.data(), static_cast<std::streamsize>(header.size())) && header == expected;
}

// False at the end of the file and of what fits together.
bool PairJournal::ReadRecord(std::istream& in, std::uint64_t left,
                             std::span<const size_t> features) {
  std::uint64_t size = 0;
  char hash[kHash];
  if (left < kRecordHeader) return false;
  in.read(reinterpret_cast<char*>(&size), sizeof size).read(hash, sizeof hash);
  if (!in || size > left - kRecordHeader) return false;
  std::string content(size, '\0');
  if (!in.read(content.data(), static_cast<std::streamsize>(size))) return false;
  if (HashOfText(content) != std::string_view(hash, sizeof hash)) return false;

  Reader reader(content);
  char what = 0;
  if (!reader.Get(&what)) return false;
  if (what == kPairs) {
    if (content_.pairs) return false;
    std::vector<std::pair<int, int>> pairs;
    if (!GetPairs(reader, features.size(), &pairs) || !reader.AtEnd()) return false;
    content_.pairs = std::move(pairs);
    return true;
  }
  if (!content_.pairs || (what != kCoarse && what != kGeometries)) return false;
  std::vector<CoarsePair> coarse;
  std::vector<std::optional<PairGeometry>> geometries;
  size_t next = what == kCoarse ? content_.coarse.size() : content_.geometries.size();
  for (; !reader.AtEnd(); ++next) {
    if (next >= content_.pairs->size()) return false;
    const Two photos{(*content_.pairs)[next].first, (*content_.pairs)[next].second};
    const bool fits = what == kCoarse
                          ? GetCoarse(reader, features, photos, &coarse.emplace_back())
                          : GetGeometry(reader, features, photos, &geometries.emplace_back());
    if (!fits) return false;
  }
  std::move(coarse.begin(), coarse.end(), std::back_inserter(content_.coarse));
  std::move(geometries.begin(), geometries.end(), std::back_inserter(content_.geometries));
  return true;
}

void PairJournal::AddPairs(std::span<const std::pair<int, int>> pairs) {
  if (file_.empty()) return;
  std::vector<Two> written;
  for (const auto& [a, b] : pairs) written.push_back({a, b});
  Writer writer(kPairs);
  writer.PutAll(written);
  AppendDurably(file_, writer.Record());
}

void PairJournal::AddCoarse(std::span<const CoarsePair> block) {
  if (file_.empty()) return;
  Writer writer(kCoarse);
  for (const CoarsePair& pair : block) writer.PutAll(pair.matches);
  AppendDurably(file_, writer.Record());
}

void PairJournal::AddGeometries(std::span<const std::optional<PairGeometry>> block) {
  if (file_.empty()) return;
  Writer writer(kGeometries);
  for (const std::optional<PairGeometry>& pair : block) {
    writer.Put(static_cast<std::uint8_t>(pair ? 1 : 0));
    if (!pair) continue;
    writer.Put(pair->kind);
    writer.Put(pair->parallax_rad);
    for (const double v : pair->b_rotation_a.reshaped()) writer.Put(v);
    for (const double v : pair->b_translation_a.reshaped()) writer.Put(v);
    std::vector<Two> matches;
    for (const auto& [a, b] : pair->matches) {
      matches.push_back({static_cast<std::int32_t>(a), static_cast<std::int32_t>(b)});
    }
    writer.PutAll(matches);
  }
  AppendDurably(file_, writer.Record());
}

}  // namespace dtr::sfm::matching
