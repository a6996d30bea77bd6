// tests/cli/field_scene.h -- the scene that several cases of shared/data/field are of.
#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

using Json = nlohmann::json;

class FieldScene : public ::testing::Test {
 protected:
  void SetUp() override { DTR_REQUIRE_DATA(Field("_scene")); }

  static std::filesystem::path Field(const std::string& name) {
    return DataFolder() / "field" / name;
  }
  std::string Set() const { return (folder_ / "set.dtr").string(); }
  // The scene's cameras of that file, with its photos and depth maps in millimetres.
  std::vector<std::string> Import(const std::filesystem::path& cameras,
                                  std::vector<std::string> further = {}) {
    const std::string scene = Field("_scene").string();
    std::vector<std::string> args = {"import",
                                     "--cameras",
                                     cameras.string(),
                                     "--images",
                                     scene,
                                     "--depth",
                                     scene,
                                     "--depth-unit",
                                     "0.001",
                                     "--force",
                                     "-o",
                                     Set(),
                                     "--json",
                                     (folder_ / "result.json").string()};
    args.insert(args.end(), further.begin(), further.end());
    return args;
  }
  Json Result() const { return Json::parse(Text(folder_ / "result.json")); }
  std::string Notes() const { return Result().at("notes").dump(); }
  // A transforms file of the scene with some of its fields changed.
  std::filesystem::path Changed(const std::string& from, const Json& fields) {
    Json file = Json::parse(Text(Field("_scene") / from));
    file.update(fields);
    const std::filesystem::path to = folder_ / "transforms_changed.json";
    std::ofstream(to) << file.dump();
    return to;
  }

  TemporaryFolder folder_;
};

}  // namespace dtr::testing
