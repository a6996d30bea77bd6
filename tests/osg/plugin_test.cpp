// What the plugin osgdb_dtr says to whoever loads a set with options.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <osgDB/Registry>

#include <string>

#include "dtr/base/files.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class Plugin : public ::testing::Test {
 protected:
  void SetUp() override {
    osgDB::Registry* registry = osgDB::Registry::instance();
    ASSERT_NE(registry->loadLibrary(std::string(DTR_OSG_PLUGINS) + "/osgdb_dtr.so"),
              osgDB::Registry::NOT_LOADED);
    reader_ = registry->getReaderWriterForExtension("dtr");
    ASSERT_NE(reader_, nullptr);
  }
  osgDB::ReaderWriter::ReadResult Load(const std::string& set, const std::string& options) const {
    const osg::ref_ptr<osgDB::Options> given = new osgDB::Options(options);
    return reader_->readNode(set, given.get());
  }

  osgDB::ReaderWriter* reader_ = nullptr;
};

TEST_F(Plugin, OptionsWithoutAMeaningAreToldBeforeAnythingIsRead) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "a.dtr");
  WriteFileAtomically(folder / "a.dtr/set.json", "no set");
  const std::string set = (folder / "a.dtr").string();
  for (const char* option : {"views=many", "resolution=2x", "time-step="}) {
    const auto result = Load(set, option);
    EXPECT_FALSE(result.success()) << option;
    EXPECT_THAT(result.message(), AllOf(StartsWith("osgdb_dtr: option "),
                                        HasSubstr(": expected a whole number, found ")))
        << option;
  }
  for (const char* option :
       {"blend=best", "keys=perhaps", "method=one-pass", "fill-holes=no", "smooth-edges=1"}) {
    const auto result = Load(set, option);
    EXPECT_FALSE(result.success()) << option;
    EXPECT_THAT(result.message(),
                AllOf(StartsWith("osgdb_dtr: option "), HasSubstr(": expected one of ")))
        << option;
  }
  EXPECT_THAT(Load(set, "blend=best").message(),
              HasSubstr("k-nearest, found best"));  // what it knows, and what it was given
  EXPECT_THAT(Load(set, "views=3").message(), HasSubstr("set.json"));
}

TEST_F(Plugin, AFolderThatIsNoSetIsToldOf) {
  const TemporaryFolder folder;
  const auto result = Load((folder / "none.dtr").string(), "");
  EXPECT_FALSE(result.success());
  EXPECT_THAT(result.message(), HasSubstr("expected a D+TR set's folder, found none"));
}

}  // namespace
}  // namespace dtr::testing
