// What set_io.h tells about a set and about a run.
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <set>
#include <sstream>
#include <string_view>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/machine.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/json_fields.h"
#include "dtr/io/pruned.h"
#include "dtr/io/pruned_json.h"
#include "dtr/io/run_record_json.h"
#include "dtr/io/set_io.h"
#include "dtr/io/set_json.h"
#include "dtr/io/validation_result.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

// Of the files that are a view's own: no base, and no video of several time steps.
std::uint64_t BytesOf(const View& view) {
  std::uint64_t bytes = 0;
  for (const auto* file : {&view.mask_file, &view.depth_file, &view.completed_file,
                           &view.sigma_file, &view.mesh_file}) {
    if (*file) bytes += (*file)->bytes;
  }
  if (view.image_file && !view.image_frame) bytes += view.image_file->bytes;
  return bytes;
}

// What a set consists of, each file counted once, however many views name it.
struct SetPart {
  const char* name;
  std::uint64_t bytes = 0;
};

std::vector<SetPart> PartsOf(const DtrSet& set) {
  std::vector<SetPart> parts{{"images"},          {"masks"},    {"depth"},
                             {"completed_depth"}, {"sigma"},    {"meshes"},
                             {"still_parts"},     {"held_out"}, {"points"}};
  std::set<std::string> counted;
  const auto add = [&](const char* name, const std::optional<StoredFile>& file) {
    if (!file || !counted.insert(file->path).second) return;
    for (SetPart& part : parts) {
      if (std::string_view(part.name) == name) part.bytes += file->bytes;
    }
  };
  for (const Frame& frame : set.frames) {
    for (const View& view : frame.views) {
      const bool source = view.role == ViewRole::kSource;
      add(source ? "images" : "held_out", view.image_file);
      add(source ? "masks" : "held_out", view.mask_file);
      add("depth", view.depth_file);
      add("completed_depth", view.completed_file);
      add("sigma", view.sigma_file);
      add("meshes", view.mesh_file);
      for (const auto* base : {&view.depth_base, &view.completed_base, &view.sigma_base}) {
        add("still_parts", *base);
      }
    }
  }
  add("points", set.sparse_file);
  std::erase_if(parts, [](const SetPart& part) { return part.bytes == 0; });
  return parts;
}

std::uint64_t TotalOf(const std::vector<SetPart>& parts) {
  std::uint64_t bytes = 0;
  for (const SetPart& part : parts) bytes += part.bytes;
  return bytes;
}

Json Numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json ViewInfo(const View& view, size_t frame) {
  Json info = {{"id", view.id},
               {"name", view.name},
               {"role", NameOf(view.role)},
               {"frame", frame},
               {"width_px", view.camera.width_px()},
               {"height_px", view.camera.height_px()},
               {"fx_px", view.camera.fx_px()},
               {"fy_px", view.camera.fy_px()},
               {"cx_px", view.camera.cx_px()},
               {"cy_px", view.camera.cy_px()},
               {"center", Numbers(view.CenterInWorld())},
               {"reference_baseline", view.reference_baseline},
               {"bytes", BytesOf(view)},
               {"has_mask", view.mask_file.has_value()},
               {"has_depth", view.depth_file.has_value()},
               {"has_completed_depth", view.completed_file.has_value()},
               {"has_sigma", view.sigma_file.has_value()}};
  if (view.depth_file) {
    info["depth_coding"] = NameOf(view.depth_coding);
    if (view.depth_coding == DepthCoding::kZstdInverseDepth) info["depth_steps"] = view.depth_steps;
    info["depth_scale"] = view.depth_scale;
    info["near_z"] = view.near_z;
    info["far_z"] = view.far_z;
  }
  return info;
}

std::string Megabytes(std::uint64_t bytes) {
  std::ostringstream out;
  out.precision(1);
  out << std::fixed << static_cast<double>(bytes) / 1e6 << " MB";
  return out.str();
}

}  // namespace

std::string ValidationLine(const DtrSet& set) {
  const Json validation = ParseJson(set.validation_json, "verdict");
  if (validation.empty()) return "not validated";
  if (!validation.contains("passed") || !validation["passed"].is_boolean())
    return validation.dump();
  if (validation["passed"].get<bool>()) return "passed";
  std::string failed;
  const auto tests = validation.find("tests");
  for (const Json& test : tests != validation.end() && tests->is_array() ? *tests : Json::array()) {
    // A validation result of another form, from another tool, is no reason to reject the set.
    const bool known = test.is_object() && test.contains("passed") && test.contains("name") &&
                       test["passed"] == false && test["name"].is_string();
    if (known) failed += (failed.empty() ? "" : ", ") + test["name"].get<std::string>();
  }
  return "FAILED" + (failed.empty() ? "" : ": " + failed) + "; dtr validate says more";
}

std::string ValidationWarning(const DtrSet& set) {
  const std::string line = ValidationLine(set);
  return line.starts_with("FAILED") ? "WARNING: validation " + line : "";
}

namespace {

// The rig that a set was built with, in a line; nothing for others, or where another tool wrote
// something else in its place.
std::string RigLine(const DtrSet& set) {
  const Json provenance = ParseJson(set.provenance_json, "provenance");
  const Json none = Json::object();
  const auto part = [&](const Json& of, const char* key) -> const Json& {
    return of.is_object() && of.contains(key) ? of[key] : none;
  };
  const Json& rig = part(part(provenance, "calibration"), "rig");
  if (!part(rig, "file").is_string() || !part(rig, "cameras").is_array()) return "";
  std::ostringstream line;
  line << "rig: " << rig["file"].get<std::string>() << " with cameras";
  const char* between = " ";
  for (const Json& camera : rig["cameras"]) {
    if (!part(camera, "name").is_string()) return "";
    line << between << camera["name"].get<std::string>();
    between = ", ";
  }
  line << "; positions and scale are the rig's";
  if (part(rig, "frames").is_number() && part(rig, "scale_spread").is_number()) {
    line << ", " << rig["frames"] << " time steps, whose scales scatter by "
         << 100 * rig["scale_spread"].get<double>() << " %";
  }
  return line.str() + "\n";
}

std::string UtcNow() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

Json HostInfo() {
  utsname names{};
  uname(&names);
  return {{"name", names.nodename},
          {"system", std::string(names.sysname) + " " + names.release},
          {"processor", CpuModel()},
          {"cores", Cores()}};
}

}  // namespace

namespace {

// "73 kB", "1.4 MB".
std::string BytesText(std::uint64_t bytes) {
  return bytes < 1'000'000 ? std::to_string((bytes + 999) / 1000) + " kB" : Megabytes(bytes);
}

std::string PartsLine(const std::vector<SetPart>& parts) {
  std::string line;
  for (const SetPart& part : parts) {
    std::string name = part.name;
    std::replace(name.begin(), name.end(), '_', ' ');
    line += (line.empty() ? "" : ", ") + name + " " + BytesText(part.bytes);
  }
  return line;
}

}  // namespace

std::string DescribeSet(const DtrSet& set) {
  const std::vector<SetPart> parts = PartsOf(set);
  size_t sources = 0, held_out = 0;
  std::ostringstream lines;
  for (const Frame& frame : set.frames) {
    for (const View& view : frame.views) {
      ++(view.role == ViewRole::kSource ? sources : held_out);
      lines << "  " << view.name << ": " << NameOf(view.role) << ", " << view.camera.width_px()
            << "x" << view.camera.height_px() << ", f " << view.camera.fx_px() << " px";
      if (view.depth_file) {
        lines << ", depth " << NameOf(view.depth_coding) << " 1/" << view.depth_scale << " in ["
              << view.near_z << ", " << view.far_z << "]";
      } else if (view.role == ViewRole::kSource) {
        lines << ", no depth";
      }
      lines << ", " << Megabytes(BytesOf(view)) << "\n";
    }
  }
  std::ostringstream out;
  out << "D+TR set: " << sources << " source views, " << held_out << " held out, "
      << set.frames.size() << (set.frames.size() == 1 ? " frame, " : " frames, ")
      << Megabytes(TotalOf(parts)) << "\nparts: " << PartsLine(parts)
      << "\nunit: " << NameOf(set.unit) << "\n"
      << RigLine(set) << "scene centre: (" << set.scene_center.transpose()
      << ")\nvalidation: " << ValidationLine(set) << "\nviews:\n";
  return out.str() + lines.str() + DescribePruned(set);
}

std::string InfoJson(const DtrSet& set) {
  Json info = {{"format_version", FormatVersionOf(set)},
               {"unit", NameOf(set.unit)},
               {"world_origin", Numbers(set.world_origin)},
               {"scene_center", Numbers(set.scene_center)},
               {"bounds", nullptr},
               {"frames", set.frames.size()},
               {"bytes", 0},
               {"parts", Json::object()},
               {"has_sparse", set.sparse_file.has_value()},
               {"verdict", ParseJson(set.validation_json, "verdict")},
               {"provenance", ParseJson(set.provenance_json, "provenance")},
               {"views", Json::array()}};
  if (!set.bounds.empty()) {
    info["bounds"] = {{"min", Numbers(set.bounds.min)}, {"max", Numbers(set.bounds.max)}};
  }
  if (Json pruned = PrunedOf(set); !pruned.is_null()) info["pruned"] = std::move(pruned);
  for (size_t f = 0; f < set.frames.size(); ++f) {
    for (const View& view : set.frames[f].views) info["views"].push_back(ViewInfo(view, f));
  }
  const std::vector<SetPart> parts = PartsOf(set);
  for (const SetPart& part : parts) info["parts"][part.name] = part.bytes;
  info["bytes"] = TotalOf(parts);
  return PrettyJson(info, "info");
}

void WriteRunRecord(const fs::path& set_folder, const RunRecord& record) {
  WriteRunRecord(set_folder, record, Json::object());
}

void WriteRunRecord(const fs::path& set_folder, const RunRecord& record, const Json& extra) {
  Json run = {{"written_utc", UtcNow()},
              {"command", record.command},
              {"threads", record.threads},
              {"host", HostInfo()},
              {"stages", Json::array()}};
  for (const RunStage& stage : record.stages) {
    run["stages"].push_back({{"name", stage.name},
                             {"wall_s", stage.wall_s},
                             {"cpu_s", stage.cpu_s},
                             {"peak_rss_kib", stage.peak_rss_kib}});
  }
  run["log"] = record.log;
  for (const auto& [key, value] : extra.items()) {
    if (!run.contains(key)) run[key] = value;
  }
  const fs::path file = set_folder / "report" / "run.json";
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  if (error) throw Error(file.string() + ": its folder cannot be made: " + error.message());
  WriteFileAtomically(file, PrettyJson(run, file.string()));
}

}  // namespace dtr::io
