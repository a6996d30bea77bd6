#include "cli/render_options.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "cli/render_arguments.h"
#include "cli/shell_words.h"
#include "dtr/base/error.h"
#include "dtr/base/process.h"
#include "dtr/base/random.h"
#include "dtr/io/pruned.h"
#include "dtr/render/option_names.h"
#include "dtr/render/stored_options.h"

namespace dtr::cli {
namespace {

RenderOptions Parsed(const std::vector<std::string>& arguments) {
  CLI::App app;
  const auto options = AddRenderOptions(app);
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());  // CLI11's order
  app.parse(reversed);
  return *options;
}

double OneOf(Random& random, double by_default) {
  return random.Index(2) == 0 ? by_default : random.Uniform(0.01, 50);
}

RenderOptions RandomOptions(Random& random) {
  RenderOptions options;
  options.method = kRenderMethods[static_cast<size_t>(random.Index(2))];
  options.primitive = kPrimitives[static_cast<size_t>(random.Index(2))];
  options.blend = kBlendWeights[static_cast<size_t>(random.Index(5))];
  options.views = 1 + random.Index(64);
  options.resolution = 1 + random.Index(8);
  options.blend_k = 1 + random.Index(8);
  options.point_size = OneOf(random, 1);
  options.exponent = OneOf(random, 8);
  options.falloff = OneOf(random, 8);
  options.delta_px = OneOf(random, 1);
  options.depth_break_px = OneOf(random, 1);
  options.mesh_tolerance_px = OneOf(random, 0.7);
  const double degrees = random.Index(2) == 0 ? 1 + random.Index(180) : random.Uniform(1, 180);
  options.max_angle_rad = degrees * std::numbers::pi / 180;
  if (random.Index(2) == 0) options.absolute_delta = random.Uniform(1e-6, 1e3);
  if (random.Index(2) == 0) options.absolute_depth_break = 3.5;
  options.blend_in_linear_light = random.Index(2) == 0;
  options.fill_holes = random.Index(2) == 0;
  options.smooth_edges = random.Index(2) == 0;
  return options;
}

TEST(RenderOptionArguments, SayNothingOfDefaults) {
  EXPECT_TRUE(RenderOptionArguments({}).empty());
  RenderOptions options;
  options.max_angle_rad = 50 * std::numbers::pi / 180;
  EXPECT_EQ(RenderOptionArguments(options), (std::vector<std::string>{"--max-angle", "50"}));
}

TEST(RenderOptionArguments, GiveTheSameOptionsBitByBit) {
  Random random(11);
  for (int draw = 0; draw < 500; ++draw) {
    const RenderOptions options = RandomOptions(random);
    const auto arguments = RenderOptionArguments(options);
    EXPECT_EQ(Parsed(arguments), options) << ShellLine(arguments);
    EXPECT_EQ(WithStoredOptions({}, ToJson(options), "here"), options) << ToJson(options);
    const RenderOptions other = RandomOptions(random);
    EXPECT_EQ(WithStoredOptions(other, ToJson(options, other), "here"), options);
    // Sets of version 0.1 hold such words.
    EXPECT_EQ(WithStoredOptions({}, nlohmann::json(arguments).dump(), "here"), options)
        << ShellLine(arguments);
  }
}

DtrSet PrunedFor(const std::string& options_json) {
  DtrSet set;
  io::SetPrunedJson(set, R"({"render": )" + options_json + "}");
  return set;
}

TEST(RenderOptionArguments, TurnOffWhatASetStores) {
  Random random(13);
  for (int draw = 0; draw < 500; ++draw) {
    const RenderOptions stored = RandomOptions(random), wanted = RandomOptions(random);
    const DtrSet set = PrunedFor(ToJson(stored));
    EXPECT_EQ(StoredRenderOptions(set), stored);
    const auto arguments = RenderOptionArguments(wanted, stored);
    CLI::App app;
    const auto options = AddRenderOptions(app);
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    UseStoredOptions(app, set, *options);
    EXPECT_EQ(*options, wanted) << ShellLine(RenderOptionArguments(stored)) << " + "
                                << ShellLine(arguments);
    EXPECT_TRUE(RenderOptionArguments(stored, stored).empty());
  }
}

std::string ErrorOf(const std::string& json) {
  try {
    WithStoredOptions({}, json, "here");
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing";
}

TEST(WithStoredOptions, SaysWhichValueHasNoMeaning) {
  EXPECT_EQ(ErrorOf(R"({"views": "many"})"), "here: views: expected a number, found \"many\"");
  EXPECT_EQ(ErrorOf(R"({"views": 1000000})"), "here: views: expected 1 to 1024, found 1000000");
  EXPECT_EQ(ErrorOf(R"({"views": 2.5})"), "here: views: expected 1 to 1024, found 2.5");
  EXPECT_EQ(ErrorOf(R"({"method": "best"})"),
            "here: method: expected deferred|two-pass, found \"best\"");
  EXPECT_EQ(ErrorOf(R"({"fill_holes": 1})"), "here: fill_holes: expected true or false, found 1");
  EXPECT_EQ(ErrorOf(R"({"delta_px": -1})"), "here: delta_px: expected 0 or more, found -1.000000");
  EXPECT_EQ(ErrorOf("7"), "here: expected an object, found 7");
  EXPECT_EQ(ErrorOf(R"(["--views", "many"])"), "here: views: expected a number, found \"many\"");
  EXPECT_EQ(ErrorOf(R"(["--views", 4])"),
            "here: expected a list of strings, found [\"--views\",4]");
}

TEST(StoredRenderOptions, ReadsSetsOfVersion01) {
  DtrSet set;
  io::SetPrunedJson(set, R"({"render_arguments": ["--views", "4", "--blend-linear",
                                                  "--fill-holes=false", "--max-angle", "50"]})");
  RenderOptions expected;
  expected.views = 4;
  expected.blend_in_linear_light = true;
  expected.max_angle_rad = 50 * std::numbers::pi / 180;
  EXPECT_EQ(StoredRenderOptions(set), expected);
}

TEST(UseStoredOptions, TakesOptionsOfRenderingAndNothingElse) {
  for (const std::string hostile :
       {R"({"json": "/tmp/x"})", R"({"views": 3, "force": true})", R"(["--json", "/tmp/x"])",
        R"(["--views", "3", "--force"])", R"(["views", "3"])"}) {
    CLI::App app;
    std::string json;
    bool force = false;
    app.add_option("--json", json);
    app.add_flag("--force", force);
    const auto options = AddRenderOptions(app);
    app.parse(std::vector<std::string>{});
    EXPECT_THROW(UseStoredOptions(app, PrunedFor(hostile), *options), Error) << hostile;
    EXPECT_EQ(json, "");
    EXPECT_FALSE(force);
  }
  // All that is ever stored may be used, and what the user asked for stays.
  Random random(12);
  for (int draw = 0; draw < 200; ++draw) {
    const RenderOptions stored = RandomOptions(random);
    CLI::App app;
    const auto options = AddRenderOptions(app);
    app.parse(std::vector<std::string>{"7", "--views"});  // CLI11's order
    UseStoredOptions(app, PrunedFor(ToJson(stored)), *options);
    RenderOptions expected = stored;
    expected.views = 7;
    EXPECT_EQ(*options, expected);
  }
}

TEST(ShellLine, GivesAShellTheSameWords) {
  const std::vector<std::string> words{"printf",    "[%s]\\n", "plain",     "",
                                       "two words", "it's",    "$HOME;`x`", "\"*\" ?"};
  std::vector<std::string> lines;
  ProcessOptions options;
  options.on_line = [&](const std::string& line) { lines.push_back(line); };
  ASSERT_TRUE(RunProcess({"sh", "-c", ShellLine(words)}, options).Ok());
  std::vector<std::string> expected;
  for (size_t i = 2; i < words.size(); ++i) expected.push_back("[" + words[i] + "]");
  EXPECT_EQ(lines, expected);
}

}  // namespace
}  // namespace dtr::cli
