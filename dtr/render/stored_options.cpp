#include "dtr/render/stored_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/render/degrees.h"
#include "dtr/render/option_names.h"
#include "dtr/render/stored_options_json.h"

namespace dtr {
namespace {

using Json = nlohmann::ordered_json;

/// What a field's value must be, where it is not what was found.
struct Unfit {
  std::string expected;
};

/// How a field of RenderOptions is written, and read from what a file holds.
struct Field {
  std::string name;
  std::function<Json(const RenderOptions&)> write;
  std::function<void(RenderOptions&, const Json&)> read;
};

double NumberIn(const Json& value) {
  if (!value.is_number()) throw Unfit{"a number"};
  return value.get<double>();
}

Field Number(const char* name, double RenderOptions::*member) {
  return {name, [member](const RenderOptions& o) { return Json(o.*member); },
          [member](RenderOptions& o, const Json& value) { o.*member = NumberIn(value); }};
}

/// null: the scale-free threshold; so does 0, of a command line.
Field Threshold(const char* name, std::optional<double> RenderOptions::*member) {
  return {name,
          [member](const RenderOptions& o) { return o.*member ? Json(*(o.*member)) : Json(); },
          [member](RenderOptions& o, const Json& value) {
            const double number = value.is_null() ? 0 : NumberIn(value);
            o.*member = number != 0 ? std::optional(number) : std::nullopt;
          }};
}

/// As wide as the options of `dtr render`.
Field Whole(const char* name, int RenderOptions::*member, int max) {
  return {name, [member](const RenderOptions& o) { return Json(o.*member); },
          [member, max](RenderOptions& o, const Json& value) {
            const double number = NumberIn(value);
            if (!(number >= 1 && number <= max) || number != std::floor(number)) {
              throw Unfit{fmt::format("1 to {}", max)};
            }
            o.*member = static_cast<int>(number);
          }};
}

Field Truth(const char* name, bool RenderOptions::*member) {
  return {name, [member](const RenderOptions& o) { return Json(o.*member); },
          [member](RenderOptions& o, const Json& value) {
            if (!value.is_boolean()) throw Unfit{"true or false"};
            o.*member = value.get<bool>();
          }};
}

template <typename T, size_t N>
Field Choice(const char* name, T RenderOptions::*member, const std::array<T, N>& values) {
  return {name, [member](const RenderOptions& o) { return Json(NameOf(o.*member)); },
          [member, &values](RenderOptions& o, const Json& value) {
            std::string names;
            for (const T one : values) {
              if (value == NameOf(one)) {
                o.*member = one;
                return;
              }
              names += (names.empty() ? "" : "|") + std::string(NameOf(one));
            }
            throw Unfit{names};
          }};
}

const std::vector<Field>& Fields() {
  using O = RenderOptions;
  static const std::vector<Field> fields{
      Choice("method", &O::method, kRenderMethods),
      Choice("primitive", &O::primitive, kPrimitives),
      Choice("blend", &O::blend, kBlendWeights),
      Whole("views", &O::views, 1024),
      Whole("resolution", &O::resolution, 64),
      Number("point_size", &O::point_size),
      Number("exponent", &O::exponent),
      Number("falloff", &O::falloff),
      Whole("blend_k", &O::blend_k, 64),
      {"max_angle_deg", [](const O& o) { return Json(DegreesOf(o.max_angle_rad)); },
       [](O& o, const Json& value) {
         const double degrees = NumberIn(value);
         if (!(degrees > 0 && degrees <= 180)) throw Unfit{"more than 0 and at most 180"};
         o.max_angle_rad = RadiansOf(degrees);
       }},
      Number("delta_px", &O::delta_px),
      Number("depth_break_px", &O::depth_break_px),
      Number("mesh_tolerance_px", &O::mesh_tolerance_px),
      Threshold("absolute_delta", &O::absolute_delta),
      Threshold("absolute_depth_break", &O::absolute_depth_break),
      Truth("blend_in_linear_light", &O::blend_in_linear_light),
      Truth("fill_holes", &O::fill_holes),
      Truth("smooth_edges", &O::smooth_edges)};
  return fields;
}

/// The field that --flag of earlier builds set: by the same name but for units.
std::string FieldOf(std::string flag) {
  for (char& c : flag) c = c == '-' ? '_' : c;
  if (flag == "blend_linear" || flag == "blend_srgb") return "blend_in_linear_light";
  for (const Field& field : Fields()) {
    for (const char* unit : {"_deg", "_px"}) {
      if (field.name == flag + unit) return field.name;
    }
  }
  return flag;
}

bool IsFlag(const std::string& text) { return text.rfind("--", 0) == 0; }

Json ValueOf(const std::string& text) {
  if (text == "true" || text == "false") return text == "true";
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && stop == end ? Json(number) : Json(text);
}

/// ["--views", "4", "--fill-holes=false"] as {"views": 4, "fill_holes": false}.
Json FromWords(const Json& list, const std::string& where) {
  std::vector<std::string> words;
  for (const Json& word : list) {
    if (!word.is_string()) {
      throw Error(where + ": expected a list of strings, found " + list.dump());
    }
    words.push_back(word.get<std::string>());
  }
  Json object = Json::object();
  for (size_t i = 0; i < words.size(); ++i) {
    const size_t equals = words[i].find('=');
    const std::string flag = words[i].substr(0, equals);
    if (!IsFlag(flag)) throw Error(where + ": expected options of rendering, found " + flag);
    std::string text = "true";
    if (equals != std::string::npos) {
      text = words[i].substr(equals + 1);
    } else if (i + 1 < words.size() && !IsFlag(words[i + 1])) {
      text = words[++i];
    }
    Json value = ValueOf(text);
    if (flag == "--blend-srgb" && value.is_boolean()) value = !value.get<bool>();
    object[FieldOf(flag.substr(2))] = value;
  }
  return object;
}

}  // namespace

Json JsonOf(const RenderOptions& options, const RenderOptions& base) {
  Json object = Json::object();
  for (const Field& field : Fields()) {
    Json value = field.write(options);
    if (value != field.write(base)) object[field.name] = std::move(value);
  }
  return object;
}

std::string ToJson(const RenderOptions& options, const RenderOptions& base) {
  return JsonOf(options, base).dump();
}

RenderOptions WithStoredOptions(const RenderOptions& base, const std::string& json,
                                const std::string& where,
                                const std::function<bool(const std::string& field)>& skip) {
  Json stored = Json::parse(json, nullptr, false);
  if (stored.is_array()) stored = FromWords(stored, where);
  if (!stored.is_object()) throw Error(where + ": expected an object, found " + json);
  RenderOptions options = base;
  for (const auto& [name, value] : stored.items()) {
    const std::string& wanted = name;
    const auto field = std::find_if(Fields().begin(), Fields().end(),
                                    [&](const Field& f) { return f.name == wanted; });
    if (field == Fields().end()) {
      throw Error(where + ": expected options of rendering, found " + name);
    }
    if (skip(name)) continue;
    try {
      field->read(options, value);
      CheckRenderOptions(options);
    } catch (const Unfit& unfit) {
      throw Error(where + ": " + name + ": expected " + unfit.expected + ", found " + value.dump());
    } catch (const Error& error) {
      // "`delta`: expected ..." of the options: the file has a field.
      const std::string text = error.what();
      const size_t rest = text.find(": ");
      throw Error(where + ": " + name + text.substr(rest == std::string::npos ? 0 : rest));
    }
  }
  return options;
}

}  // namespace dtr
