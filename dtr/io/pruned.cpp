#include "dtr/io/pruned.h"

#include <sstream>

#include "dtr/base/error.h"
#include "dtr/io/json_fields.h"
#include "dtr/io/pruned_json.h"

namespace dtr::io {
namespace {

constexpr char kPruned[] = "pruned";
constexpr char kWhere[] = "set.json: pruned";
constexpr char kRender[] = "render";
constexpr char kRenderWords[] = "render_arguments";  // of earlier builds: a list of words

Json ExtraOf(const DtrSet& set) {
  return set.extra_json.empty() ? Json::object() : ParseJson(set.extra_json, kWhere);
}

/// A number of an object, if it has one of that name.
std::optional<double> NumberAt(const Json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

std::string TextAt(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "?";
}

/// The steps of a list, a line each; of another tool: no reason to reject the set.
void DescribeSteps(const Json& pruned, const char* list, const char* before,
                   std::ostringstream& out) {
  const auto found = pruned.find(list);
  if (found == pruned.end() || !found->is_array()) return;
  for (const Json& step : *found) {
    if (!step.is_object()) continue;
    out << "  " << before << TextAt(step, "kind") << ": " << TextAt(step, "what");
    if (const auto loss = NumberAt(step, "loss_db")) out << ", " << *loss << " dB";
    if (const auto bytes = NumberAt(step, "bytes_share")) {
      out << ", " << 100 * *bytes << " % of the bytes";
    }
    if (const auto frame = NumberAt(step, "frame_share"); frame && *frame > 0) {
      out << ", " << 100 * *frame << " % of a frame's work";
    }
    out << "\n";
  }
}

/// KIND_loss_db with KIND_error_db, its standard error.
void DescribeLoss(const Json& pruned, const std::string& kind, const char* words,
                  std::ostringstream& out) {
  const auto loss_db = NumberAt(pruned, (kind + "_loss_db").c_str());
  if (!loss_db) return;
  out << words << ": " << *loss_db;
  if (const auto error_db = NumberAt(pruned, (kind + "_error_db").c_str())) {
    out << " +- " << *error_db;
  }
  out << " dB\n";
}

/// The rendering options among what was pruned, and the name of their field; null where there are
/// none.
std::pair<Json, std::string> StoredOptionsIn(const Json& pruned) {
  for (const char* field : {kRender, kRenderWords}) {
    const auto found = pruned.find(field);
    if (found == pruned.end()) continue;
    const std::string where = std::string(kWhere) + "." + field;
    if (!found->is_structured()) {
      throw Error(where + ": expected an object, found " + found->dump());
    }
    return {*found, where};
  }
  return {nullptr, ""};
}

/// {"views": 4, "method": "two-pass"} as: views 4, method two-pass.
std::string InWords(const Json& options) {
  std::string words;
  for (const auto& [name, value] : options.items()) {
    const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
    if (options.is_array()) {
      words += (words.empty() ? "" : " ") + text;
    } else {
      words += (words.empty() ? "" : ", ") + name + " " + text;
    }
  }
  return words.empty() ? "the usual options" : words;
}

}  // namespace

Json PrunedOf(const DtrSet& set) {
  const Json extra = ExtraOf(set);
  const auto found = extra.find(kPruned);
  if (found == extra.end()) return nullptr;
  if (!found->is_object()) {
    throw Error(std::string(kWhere) + ": expected an object, found " + found->dump());
  }
  return *found;
}

void SetPruned(DtrSet& set, const Json& pruned) {
  Json extra = ExtraOf(set);
  extra[kPruned] = pruned;
  set.extra_json = extra.dump();
}

std::string PrunedJson(const DtrSet& set) {
  const Json pruned = PrunedOf(set);
  return pruned.is_null() ? "" : pruned.dump();
}

void SetPrunedJson(DtrSet& set, const std::string& json) {
  if (!json.empty()) return SetPruned(set, ParseJson(json, kWhere));
  Json extra = ExtraOf(set);
  extra.erase(kPruned);
  set.extra_json = extra.dump();
}

StoredRenderOptions RenderOptionsOf(const DtrSet& set) {
  const Json pruned = PrunedOf(set);
  if (pruned.is_null()) return {};
  const auto [options, where] = StoredOptionsIn(pruned);
  if (options.is_null()) return {};
  return {options.dump(), where};
}

std::string DescribePruned(const DtrSet& set) {
  const Json pruned = PrunedOf(set);
  if (pruned.is_null()) return "";
  std::ostringstream out;
  out.precision(3);
  const auto loss_db = NumberAt(pruned, "loss_db"), max_db = NumberAt(pruned, "max_loss_db");
  out << "left out by dtr prune";
  if (loss_db && max_db) out << ", " << *loss_db << " dB lost of " << *max_db << " allowed";
  out << ":\n";
  DescribeSteps(pruned, "removed", "", out);
  DescribeSteps(pruned, "put_back", "taken back: ", out);
  DescribeLoss(pruned, "probe", "lost between input cameras", out);
  DescribeLoss(pruned, "witness", "lost at photos that did not decide", out);
  out << "rendered by default with: " << InWords(StoredOptionsIn(pruned).first) << "\n";
  return out.str();
}

}  // namespace dtr::io
