// osgdb_dtr: `osgviewer scene.dtr`, osgDB::readNodeFile("scene.dtr").
#include <osgDB/FileNameUtils>
#include <osgDB/FileUtils>
#include <osgDB/ReaderWriter>
#include <osgDB/Registry>

#include <filesystem>
#include <sstream>
#include <string>

#include "dtr/base/error.h"
#include "viewer/osg/depth_tr.h"
#include "viewer/osg/key_handler.h"

namespace osgDTR {
namespace {

/// What a loader's options say (osgviewer -O "views=6 blend=cosine").
struct PluginOptions {
  dtr::RenderOptions render;
  DrawPath path = DrawPath::kGpu;
  FillTime fill_time = FillTime::kAlways;
  int time_step = 0;  ///< of a dynamic set: the first to be shown
  bool play = false;  ///< from there on
  bool keys = true;   ///< the report's keys, and the input camera in the middle as home
};

int WholeNumber(const std::string& name, const std::string& value) {
  size_t used = 0;
  int number = 0;
  try {
    number = std::stoi(value, &used);
  } catch (const std::exception&) {
  }
  if (used == 0 || used != value.size()) {
    throw dtr::UsageError("osgdb_dtr: option " + name + ": expected a whole number, found " +
                          value);
  }
  return number;
}

template <typename T>
T OneOf(const std::string& name, const std::string& value,
        std::initializer_list<std::pair<const char*, T>> known) {
  std::string names;
  for (const auto& [known_name, meaning] : known) {
    if (value == known_name) return meaning;
    names += (names.empty() ? "" : ", ") + std::string(known_name);
  }
  throw dtr::UsageError("osgdb_dtr: option " + name + ": expected one of " + names + ", found " +
                        value);
}

bool OnOrOff(const std::string& name, const std::string& value) {
  return OneOf<bool>(name, value, {{"on", true}, {"off", false}});
}

/// Words without a meaning here belong to other plugins: OpenSceneGraph hands all of them to all.
PluginOptions Parse(const osgDB::Options* given, const dtr::RenderOptions& defaults) {
  PluginOptions options;
  options.render = defaults;
  std::istringstream words(given == nullptr ? "" : given->getOptionString());
  for (std::string word; words >> word;) {
    const size_t equals = word.find('=');
    if (equals == std::string::npos) continue;
    const std::string name = word.substr(0, equals), value = word.substr(equals + 1);
    if (name == "views") options.render.views = WholeNumber(name, value);
    if (name == "resolution") options.render.resolution = WholeNumber(name, value);
    if (name == "blend") {
      options.render.blend =
          OneOf<dtr::BlendWeight>(name, value,
                                  {{"cosine", dtr::BlendWeight::kCosine},
                                   {"exponential", dtr::BlendWeight::kExponential},
                                   {"angle", dtr::BlendWeight::kAngle},
                                   {"inverse-angle", dtr::BlendWeight::kInverseAngle},
                                   {"k-nearest", dtr::BlendWeight::kKNearest}});
    }
    if (name == "method") {
      options.render.method = OneOf<dtr::RenderMethod>(
          name, value,
          {{"deferred", dtr::RenderMethod::kDeferred}, {"two-pass", dtr::RenderMethod::kTwoPass}});
    }
    if (name == "primitive") {
      options.render.primitive = OneOf<dtr::Primitive>(
          name, value, {{"mesh", dtr::Primitive::kMesh}, {"splat", dtr::Primitive::kSplat}});
    }
    if (name == "path") {
      options.path = OneOf<DrawPath>(name, value,
                                     {{"gpu", DrawPath::kGpu}, {"read-back", DrawPath::kReadBack}});
    }
    if (name == "keys") options.keys = OnOrOff(name, value);
    if (name == "time-step") options.time_step = WholeNumber(name, value);
    if (name == "play") options.play = OnOrOff(name, value);
    if (name == "smooth-edges") options.render.smooth_edges = OnOrOff(name, value);
    if (name == "fill-holes") {
      options.render.fill_holes = value != "off";
      options.fill_time = OneOf<FillTime>(
          name, value,
          {{"on", FillTime::kAlways}, {"still", FillTime::kWhenStill}, {"off", FillTime::kAlways}});
    }
  }
  return options;
}

std::string WithoutSlash(std::string name) {
  while (name.size() > 1 && name.back() == '/') name.pop_back();
  return name;
}

/// The folder of the set that `file` names: itself, or that of its set.json. Empty: no set.
std::filesystem::path SetFolder(const std::string& file) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  fs::path path(file);
  if (path.filename().empty()) path = path.parent_path();  // scene.dtr/
  if (path.filename() == "set.json" && fs::is_regular_file(path, ignored)) {
    return path.has_parent_path() ? path.parent_path() : fs::path(".");
  }
  if (fs::is_directory(path, ignored) && fs::is_regular_file(path / "set.json", ignored)) {
    return path;
  }
  return {};
}

}  // namespace

class ReaderWriterDTR : public osgDB::ReaderWriter {
 public:
  ReaderWriterDTR() {
    supportsExtension("dtr", "Depth + texture representation: the set's folder, or its set.json");
    supportsOption("views", "Views that an image is blended from at most [8]");
    supportsOption("resolution", "Every R-th depth pixel [1]");
    supportsOption("blend", "cosine|exponential|angle|inverse-angle|k-nearest");
    supportsOption("method", "deferred|two-pass");
    supportsOption("primitive", "mesh|splat, of two-pass");
    supportsOption("fill-holes",
                   "on|still|off: fill what no view saw; still: not while moving [off]");
    supportsOption("time-step", "Of a dynamic set: the time step that is shown [0]");
    supportsOption("play", "on|off: of a dynamic set: play it, in a loop [off]");
    supportsOption("path", "gpu|read-back");
    supportsOption("keys", "on|off: the keys of the founding report [on]");
  }
  const char* className() const override { return "D+TR set reader"; }

  ReadResult readObject(const std::string& file, const osgDB::Options* options) const override {
    return readNode(file, options);
  }

  ReadResult readNode(const std::string& file, const osgDB::Options* options) const override {
    std::filesystem::path folder = SetFolder(file);
    // Relative names are looked for where OpenSceneGraph looks: OSG_FILE_PATH, the options' paths,
    // and for a set that another file names, beside that file.
    if (folder.empty()) folder = SetFolder(osgDB::findDataFile(WithoutSlash(file), options));
    if (folder.empty()) {
      // Others may know this extension: only what is called a set must be one.
      const bool called_set = osgDB::getLowerCaseFileExtension(file) == "dtr";
      if (!called_set) return ReadResult::FILE_NOT_HANDLED;
      return ReadResult("osgdb_dtr: " + file + ": expected a D+TR set's folder, found none");
    }
    try {
      (void)Parse(options, {});  // words without meaning, before anything is read
      osg::ref_ptr<DepthTR> node = new DepthTR;
      node->load(folder.string());
      const PluginOptions parsed = Parse(options, node->getDefaultRenderOptions());
      node->setRenderOptions(parsed.render);
      node->setDrawPath(parsed.path);
      node->setFillTime(parsed.fill_time);
      node->setTimeStep(parsed.time_step);
      node->setPlaying(parsed.play);
      node->setName(folder.filename().string());
      if (parsed.keys) node->addEventCallback(new KeyHandler(node.get(), true));
      return node.release();
    } catch (const std::exception& error) {
      OSG_WARN << error.what() << std::endl;
      return ReadResult(std::string(error.what()));
    }
  }
};

REGISTER_OSGPLUGIN(dtr, ReaderWriterDTR)

}  // namespace osgDTR
