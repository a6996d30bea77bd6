// osgdb_: `osgviewer scene.dtr/`. OpenSceneGraph names plugins by what follows a name's last dot,
// if no slash follows that: for `scene.dtr/` it asks for the plugin of the empty ending, which is
// this one. It hands sets to osgdb_dtr and leaves everything else alone.
#include <osgDB/ReaderWriter>
#include <osgDB/Registry>

#include <filesystem>
#include <string>

namespace osgDTR {
namespace {

class ReaderWriterFolder : public osgDB::ReaderWriter {
 public:
  const char* className() const override { return "D+TR folder reader"; }

  ReadResult readObject(const std::string& file, const osgDB::Options* options) const override {
    return readNode(file, options);
  }

  ReadResult readNode(const std::string& file, const osgDB::Options* options) const override {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(std::filesystem::path(file) / "set.json", ignored)) {
      return ReadResult::FILE_NOT_HANDLED;
    }
    osgDB::ReaderWriter* const sets =
        osgDB::Registry::instance()->getReaderWriterForExtension("dtr");
    return sets == nullptr ? ReadResult::FILE_NOT_HANDLED : sets->readNode(file, options);
  }
};

const osgDB::RegisterReaderWriterProxy<ReaderWriterFolder> registered;

}  // namespace
}  // namespace osgDTR
