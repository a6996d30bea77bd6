#include "dtr/render/option_arguments.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "dtr/base/error.h"
#include "dtr/render/option_names.h"

namespace dtr {
namespace {

double RadiansOf(double degrees) { return degrees * std::numbers::pi / 180; }

/// Degrees with as few digits as come back as the same bits.
std::string DegreesOf(double radians) {
  constexpr int kMaxDigits = 17;
  const double degrees = radians * 180 / std::numbers::pi;
  for (int digits = 1; digits <= kMaxDigits; ++digits) {
    const double rounded = std::stod(fmt::format("{:.{}g}", degrees, digits));
    if (RadiansOf(rounded) == radians) return fmt::format("{}", rounded);
  }
  // The way back rounds, too: the neighbours are what is left.
  const double above = std::nextafter(degrees, HUGE_VAL);
  return fmt::format("{}", RadiansOf(above) == radians ? above : std::nextafter(degrees, 0));
}

/// What a flag's value must be, where it is not what was found.
struct Unfit {
  std::string expected;
};

template <typename T>
T Number(const std::string& text) {
  T number{};
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || stop != end) throw Unfit{"a number"};
  return number;
}

/// As wide as the options of `dtr render`.
int Whole(const std::string& text, int most) {
  const int number = Number<int>(text);
  if (number < 1 || number > most) throw Unfit{fmt::format("1 to {}", most)};
  return number;
}

/// Zero: the scale-free threshold.
std::optional<double> Absolute(const std::string& text) {
  const auto value = Number<double>(text);
  return value != 0 ? std::optional(value) : std::nullopt;
}

template <typename T, size_t N>
T OneOf(const std::array<T, N>& values, const std::string& text) {
  std::string names;
  for (const T value : values) {
    if (NameOf(value) == text) return value;
    names += (names.empty() ? "" : "|") + std::string(NameOf(value));
  }
  throw Unfit{names};
}

bool Truth(const std::string& text) {
  if (text == "true" || text == "false") return text == "true";
  throw Unfit{"no value, true or false"};
}

using Reader = void (*)(RenderOptions&, const std::string&);
const std::map<std::string, Reader>& Readers() {
  using O = RenderOptions;
  using Text = std::string;
  static const std::map<std::string, Reader> readers{
      {"--method", [](O& o, const Text& v) { o.method = OneOf(kRenderMethods, v); }},
      {"--primitive", [](O& o, const Text& v) { o.primitive = OneOf(kPrimitives, v); }},
      {"--blend", [](O& o, const Text& v) { o.blend = OneOf(kBlendWeights, v); }},
      {"--views", [](O& o, const Text& v) { o.views = Whole(v, 1024); }},
      {"--resolution", [](O& o, const Text& v) { o.resolution = Whole(v, 64); }},
      {"--point-size", [](O& o, const Text& v) { o.point_size = Number<double>(v); }},
      {"--exponent", [](O& o, const Text& v) { o.exponent = Number<double>(v); }},
      {"--falloff", [](O& o, const Text& v) { o.falloff = Number<double>(v); }},
      {"--blend-k", [](O& o, const Text& v) { o.blend_k = Whole(v, 64); }},
      {"--max-angle", [](O& o, const Text& v) { o.max_angle_rad = RadiansOf(Number<double>(v)); }},
      {"--delta", [](O& o, const Text& v) { o.delta_px = Number<double>(v); }},
      {"--depth-break", [](O& o, const Text& v) { o.depth_break_px = Number<double>(v); }},
      {"--mesh-tolerance", [](O& o, const Text& v) { o.mesh_tolerance_px = Number<double>(v); }},
      {"--absolute-delta", [](O& o, const Text& v) { o.absolute_delta = Absolute(v); }},
      {"--absolute-depth-break", [](O& o, const Text& v) { o.absolute_depth_break = Absolute(v); }},
      {"--blend-linear", [](O& o, const Text& v) { o.blend_in_linear_light = Truth(v); }},
      {"--blend-srgb", [](O& o, const Text& v) { o.blend_in_linear_light = !Truth(v); }},
      {"--fill-holes", [](O& o, const Text& v) { o.fill_holes = Truth(v); }}};
  return readers;
}

/// Collects "--flag VALUE" of what differs.
class Arguments {
 public:
  template <typename T>
  void Add(const char* flag, const T& value, const T& by_default) {
    if (value != by_default) Append(flag, fmt::format("{}", value));
  }
  void Add(const char* flag, const std::optional<double>& value,
           const std::optional<double>& by_default) {
    if (value != by_default) Append(flag, fmt::format("{}", value.value_or(0)));
  }
  void Append(const char* flag, std::string value) {
    arguments_.emplace_back(flag);
    arguments_.push_back(std::move(value));
  }
  void Flag(const char* flag) { arguments_.emplace_back(flag); }
  std::vector<std::string> Take() { return std::move(arguments_); }

 private:
  std::vector<std::string> arguments_;
};

}  // namespace

std::vector<std::string> RenderOptionArguments(const RenderOptions& options,
                                               const RenderOptions& base) {
  Arguments arguments;
  // Asking for splats alone would change the method, too.
  const bool primitive = options.primitive != base.primitive;
  if (options.method != base.method || (primitive && options.primitive == Primitive::kSplat)) {
    arguments.Append("--method", NameOf(options.method));
  }
  if (primitive) arguments.Append("--primitive", NameOf(options.primitive));
  if (options.blend != base.blend) arguments.Append("--blend", NameOf(options.blend));
  arguments.Add("--views", options.views, base.views);
  arguments.Add("--resolution", options.resolution, base.resolution);
  arguments.Add("--point-size", options.point_size, base.point_size);
  arguments.Add("--exponent", options.exponent, base.exponent);
  arguments.Add("--falloff", options.falloff, base.falloff);
  arguments.Add("--blend-k", options.blend_k, base.blend_k);
  if (options.max_angle_rad != base.max_angle_rad) {
    arguments.Append("--max-angle", DegreesOf(options.max_angle_rad));
  }
  arguments.Add("--delta", options.delta_px, base.delta_px);
  arguments.Add("--depth-break", options.depth_break_px, base.depth_break_px);
  arguments.Add("--mesh-tolerance", options.mesh_tolerance_px, base.mesh_tolerance_px);
  arguments.Add("--absolute-delta", options.absolute_delta, base.absolute_delta);
  arguments.Add("--absolute-depth-break", options.absolute_depth_break, base.absolute_depth_break);
  if (options.blend_in_linear_light != base.blend_in_linear_light) {
    arguments.Flag(options.blend_in_linear_light ? "--blend-linear" : "--blend-srgb");
  }
  if (options.fill_holes != base.fill_holes) {
    arguments.Flag(options.fill_holes ? "--fill-holes" : "--fill-holes=false");
  }
  return arguments.Take();
}

RenderOptions WithArguments(const RenderOptions& base, const std::vector<std::string>& arguments,
                            const std::string& where,
                            const std::function<bool(const std::string& flag)>& skip) {
  RenderOptions options = base;
  const auto is_flag = [](const std::string& text) { return text.rfind("--", 0) == 0; };
  for (size_t i = 0; i < arguments.size(); ++i) {
    const size_t equals = arguments[i].find('=');
    const std::string flag = arguments[i].substr(0, equals);
    std::string value = "true";
    if (equals != std::string::npos) {
      value = arguments[i].substr(equals + 1);
    } else if (i + 1 < arguments.size() && !is_flag(arguments[i + 1])) {
      value = arguments[++i];
    }
    const auto reader = Readers().find(flag);
    if (reader == Readers().end()) {
      throw Error(where + ": expected options of rendering, found " + flag);
    }
    if (skip(flag)) continue;
    try {
      reader->second(options, value);
      CheckRenderOptions(options);
    } catch (const Unfit& unfit) {
      throw Error(where + ": " + flag + ": expected " + unfit.expected + ", found " + value);
    } catch (const Error& error) {
      throw Error(where + ": " + error.what());
    }
  }
  return options;
}

}  // namespace dtr
