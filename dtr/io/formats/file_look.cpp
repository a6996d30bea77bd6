#include "dtr/io/formats/file_look.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"
#include "dtr/base/regular_file.h"
#include "dtr/base/text_file.h"

namespace dtr::io {
namespace {

constexpr std::streamsize kHeadBytes = 64 << 10;
constexpr std::uintmax_t kMaxJsonBytes = 1u << 30;

// Collects the names of the fields of the object that begins at `depth_`.
class KeyCollector : public nlohmann::json_sax<nlohmann::json> {
 public:
  KeyCollector(std::set<std::string>& keys, int depth) : keys_(keys), object_depth_(depth) {}

  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override {
    ++depth_;
    return true;
  }
  bool key(string_t& name) override {
    constexpr size_t kMaxKeys = 4096;
    if (depth_ == object_depth_ && keys_.size() < kMaxKeys) keys_.insert(name);
    return true;
  }
  // The first object of a list is enough.
  bool end_object() override { return depth_-- > object_depth_; }
  bool start_array(std::size_t) override {
    ++depth_;
    return true;
  }
  bool end_array() override {
    --depth_;
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::json::exception&) override {
    is_broken_ = true;
    return false;
  }

  bool is_broken() const { return is_broken_; }

 private:
  std::set<std::string>& keys_;
  int object_depth_, depth_ = 0;
  bool is_broken_ = false;
};

}  // namespace

FileLook LookAt(const std::filesystem::path& file) {
  FileLook look;
  look.is_folder = std::filesystem::is_directory(file);
  if (look.is_folder) return look;
  std::ifstream in = StreamOf(file);
  look.head.resize(static_cast<size_t>(kHeadBytes));
  in.read(look.head.data(), kHeadBytes);
  if (in.bad()) throw Error(file.string() + ": cannot be read");
  look.head.resize(static_cast<size_t>(in.gcount()));
  look.head = TextOfHead(std::move(look.head));
  const size_t first = look.head.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) return look;
  look.is_json_list = look.head[first] == '[';
  look.is_json = look.is_json_list || look.head[first] == '{';
  if (!look.is_json) return look;
  KeyCollector collector(look.keys, look.is_json_list ? 2 : 1);
  nlohmann::json::sax_parse(ReadTextFile(file, kMaxJsonBytes), &collector);
  look.is_broken = collector.is_broken();
  return look;
}

}  // namespace dtr::io
