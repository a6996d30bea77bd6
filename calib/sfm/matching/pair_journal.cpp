#include "calib/sfm/matching/pair_journal.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <type_traits>

#include "dtr/base/delete.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/hash.h"
#include "dtr/base/regular_file.h"

namespace dtr::sfm::matching {
namespace {

namespace fs = std::filesystem;

// "dtr pairs 2", the hash of the inputs, an end of line.
constexpr std::string_view kMagic = "dtr pairs 2 ";
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

// A block of pairs, each with its number, into `all`; nothing of it where it does not fit.
template <typename T, typename Get>
bool GetBlock(Reader& reader, const std::vector<std::pair<int, int>>& pairs,
              std::vector<std::optional<T>>& all, const Get& get) {
  std::vector<std::pair<size_t, T>> block;
  while (!reader.AtEnd()) {
    std::int32_t k = 0;
    if (!reader.Get(&k) || k < 0 || static_cast<size_t>(k) >= pairs.size()) return false;
    const auto& [a, b] = pairs[static_cast<size_t>(k)];
    auto& [number, value] = block.emplace_back(static_cast<size_t>(k), T{});
    if (!get(Two{a, b}, value)) return false;
  }
  for (auto& [number, value] : block) all[number] = std::move(value);
  return true;
}

std::string Header(const std::string& inputs) {
  return std::string(kMagic) + HashOfText(inputs) + '\n';
}

// FILE.PART of all parts, sorted.
std::vector<fs::path> PartsOf(const fs::path& file) {
  const std::string prefix = file.filename().string() + ".";
  std::vector<fs::path> parts;
  std::error_code error;
  fs::directory_iterator entry(file.parent_path(), error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    if (entry->path().filename().string().starts_with(prefix) && !IsTemporaryFile(entry->path())) {
      parts.push_back(entry->path());
    }
  }
  if (error) throw Error(file.parent_path().string() + ": cannot be listed: " + error.message());
  std::sort(parts.begin(), parts.end());
  return parts;
}

}  // namespace

PairJournal::PairJournal(const fs::path& file, const std::string& inputs,
                         std::span<const size_t> features, const std::string& part,
                         bool reads_parts) {
  file_ = part.empty() ? file : fs::path(file.string() + "." + part);
  // The file first: without its pairs the parts' records mean nothing.
  std::uint64_t whole = Read(file, inputs, features);
  if (!part.empty()) whole = 0;
  for (const fs::path& other : PartsOf(file)) {
    if (other != file_ && !reads_parts) continue;
    const std::uint64_t read = Read(other, inputs, features);
    if (other == file_) whole = read;
  }
  if (whole == 0) {
    WriteFileAtomically(file_, Header(inputs));
  } else {
    // What comes next must not follow a part of a record.
    fs::resize_file(file_, whole);
  }
}

void PairJournal::Remove(const fs::path& file) {
  std::vector<fs::path> all = PartsOf(file);
  all.push_back(file);
  for (const fs::path& one : all) {
    RemoveFile(one);
  }
}

// Takes over what the file holds and returns how many of its bytes are whole.
std::uint64_t PairJournal::Read(const fs::path& file, const std::string& inputs,
                                std::span<const size_t> features) {
  if (!fs::exists(file)) return 0;
  std::ifstream in = StreamOf(file);
  const std::uint64_t size = fs::file_size(file);
  const std::string expected = Header(inputs);
  std::string header(expected.size(), '\0');
  if (!in.read(header.data(), static_cast<std::streamsize>(header.size())) || header != expected) {
    return 0;
  }
  std::uint64_t whole = 0;
  do {
    whole = static_cast<std::uint64_t>(in.tellg());
  } while (ReadRecord(in, size - whole, features));
  return whole;
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
    content_.coarse.resize(pairs.size());
    content_.geometries.resize(pairs.size());
    content_.pairs = std::move(pairs);
    return true;
  }
  if (!content_.pairs) return false;
  if (what == kCoarse) {
    return GetBlock(reader, *content_.pairs, content_.coarse,
                    [&](const Two& photos, CoarsePair& pair) {
                      return GetCoarse(reader, features, photos, &pair);
                    });
  }
  return what == kGeometries &&
         GetBlock(reader, *content_.pairs, content_.geometries,
                  [&](const Two& photos, TriedPair& pair) {
                    return GetGeometry(reader, features, photos, &pair.geometry);
                  });
}

void PairJournal::AddPairs(std::span<const std::pair<int, int>> pairs) {
  if (file_.empty()) return;
  std::vector<Two> written;
  for (const auto& [a, b] : pairs) written.push_back({a, b});
  Writer writer(kPairs);
  writer.PutAll(written);
  AppendDurably(file_, writer.Record());
}

void PairJournal::AddCoarse(std::span<const int> which,
                            std::span<const std::optional<CoarsePair>> coarse) {
  if (file_.empty()) return;
  Writer writer(kCoarse);
  for (const int k : which) {
    writer.Put(static_cast<std::int32_t>(k));
    writer.PutAll(coarse[static_cast<size_t>(k)]->matches);
  }
  AppendDurably(file_, writer.Record());
}

void PairJournal::AddGeometries(std::span<const int> which,
                                std::span<const std::optional<TriedPair>> geometries) {
  if (file_.empty()) return;
  Writer writer(kGeometries);
  for (const int k : which) {
    const std::optional<PairGeometry>& pair = geometries[static_cast<size_t>(k)]->geometry;
    writer.Put(static_cast<std::int32_t>(k));
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
