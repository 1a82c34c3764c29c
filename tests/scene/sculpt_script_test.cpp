#include <meniscus/scene/schema.h>
#include <meniscus/scene/sculpt_script.h>

#include <meniscus/base/error.h>
#include <meniscus/render/png.h>

#include "support/scratch.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace meniscus::scene {
namespace {

using pointset::Falloff;
using pointset::Stroke;
using test::Scratch;

bool fits_schema(const nlohmann::json& document) {
  const auto json = nlohmann::json::parse(sculpt_schema());
  valijson::Schema schema;
  valijson::SchemaParser().populateSchema(valijson::adapters::NlohmannJsonAdapter(json), schema);
  return valijson::Validator().validate(schema, valijson::adapters::NlohmannJsonAdapter(document), nullptr);
}

bool reads(const std::string& text) {
  try {
    parse_sculpt_script(text, "script.json");
    return true;
  } catch (const IoError&) {
    return false;
  }
}

void write_image(const std::string& path, int width, int height) {
  const auto bytes = render::encode_png(render::Image(width, height));
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

TEST(SculptScript, ReadsEveryKey) {
  const Scratch s;
  write_image(s / "dots.png", 4, 3);
  const std::string text = R"({"format": "meniscus.sculpt", "version": 1, "spacing": 0.02, "strokes": [
    // comments are allowed
    {"tool": "force", "label": "nose", "path": [[0,0,1],[0,0.1,1]], "radius": 0.3, "strength": -0.1, "falloff": "spherical",
     "direction": [0,0,2], "mirror": "xz", "region": {"min": [-1,-1,-1], "max": [1,1,1]},
     "material": {"mass": 2, "damping": 3, "stiffness": 4}, "seconds": 0.25, "steps": 5, "voxels": 16},
    {"tool": "inflate", "path": [1,2,3], "radius": 1, "strength": 0.5, "falloff": [1, 0.5, 0]},
    {"tool": "undo"}, {"tool": "redo"},
    {"tool": "emboss", "image": "dots.png", "strength": 0.1,
     "projection": {"type": "spherical", "origin": [1,0,0], "direction": [0,0,1], "up": [0,1,0], "width": 90, "height": 45}},
    {"tool": "refine", "spacing": 0.01}]})";
  const SculptScript script = parse_sculpt_script(text, s / "script.json");
  EXPECT_EQ(script.spacing, 0.02);
  ASSERT_EQ(script.commands.size(), 6u);
  const Stroke& force = script.commands[0].stroke;
  EXPECT_EQ(force.tool, Stroke::Tool::Force);
  EXPECT_EQ(force.label, "nose");
  EXPECT_EQ(force.path.size(), 2u);
  EXPECT_EQ(force.falloff.kind, Falloff::Kind::Spherical);
  EXPECT_EQ(force.mirror, (std::array<bool, 3>{true, false, true}));
  EXPECT_EQ(force.region->max, Vec3(1, 1, 1));
  EXPECT_EQ(force.material.stiffness, 4);
  EXPECT_EQ(force.voxels, 16);
  EXPECT_EQ(script.commands[1].stroke.falloff.custom, (std::vector<double>{1, 0.5, 0}));
  EXPECT_EQ(script.commands[1].stroke.label, "inflate");
  EXPECT_EQ(script.commands[2].kind, SculptCommand::Kind::Undo);
  EXPECT_EQ(script.commands[4].stroke.image->width, 4u);
  EXPECT_EQ(script.commands[4].stroke.projection.height, 45);
  EXPECT_EQ(script.commands[5].stroke.spacing, 0.01);
  EXPECT_TRUE(fits_schema(nlohmann::json::parse(text, nullptr, true, true)));
}

TEST(SculptScript, SchemaAndReaderRejectTheSameSlips) {
  const std::string good = R"({"strokes":[{"tool":"inflate","path":[0,0,1],"radius":1,"strength":1}]})";
  EXPECT_TRUE(reads(good));
  EXPECT_TRUE(fits_schema(nlohmann::json::parse(good)));
  for (const char* bad :
       {R"({"strokes":[]})", R"({"stroke":[]})", R"({"strokes":[{"tool":"inflat","path":[0,0,1],"radius":1,"strength":1}]})",
        R"({"strokes":[{"tool":"inflate","path":[0,1],"radius":1,"strength":1}]})",
        R"({"strokes":[{"tool":"inflate","path":[0,0,1],"radius":0,"strength":1}]})",
        R"({"strokes":[{"tool":"inflate","path":[0,0,1],"radius":1,"strength":"1"}]})",
        R"({"strokes":[{"tool":"inflate","path":[0,0,1],"radius":1,"strenght":1}]})",
        R"({"strokes":[{"tool":"inflate","path":[0,0,1],"radius":1,"strength":1,"mirror":"w"}]})",
        R"({"strokes":[{"tool":"force","path":[0,0,1],"radius":1,"strength":1,"steps":1.5}]})",
        R"({"strokes":[{"tool":"force","path":[0,0,1],"radius":1,"strength":1,"material":{"mass":0}}]})",
        R"({"version":2,"strokes":[{"tool":"undo"}]})"}) {
    EXPECT_FALSE(reads(bad)) << bad;
    EXPECT_FALSE(fits_schema(nlohmann::json::parse(bad))) << bad;
  }
}

TEST(SculptScript, ErrorsNameThePlaceAndTheRemedy) {
  const auto message = [](const std::string& text) {
    try {
      parse_sculpt_script(text, "script.json");
      return std::string();
    } catch (const IoError& e) {
      return std::string(e.what());
    }
  };
  EXPECT_NE(message(R"({"strokes":[{"tool":"undo"},{"tool":"inflat"}]})").find("strokes[1].tool"), std::string::npos);
  EXPECT_NE(message(R"({"strokes":[{"tool":"inflat"}]})").find("inflate"), std::string::npos);
  EXPECT_NE(message(R"({"strokes":[{"tool":"drag","path":[0,0,0],"radius":1}]})").find("direction"), std::string::npos);
  EXPECT_NE(message("{\"strokes\":\n[}").find("line 2"), std::string::npos);
}

TEST(SculptScript, AnImageThatIsMissingOrHasNothingToShowIsAnError) {
  const Scratch s;
  write_image(s / "dot.png", 1, 1);
  std::ofstream(s / "text.png") << "no image";
  for (const std::string name : {"missing.png", "dot.png", "text.png"}) try {
      parse_sculpt_script(R"({"strokes":[{"tool":"emboss","strength":1,"image":")" + name + R"("}]})", s / "script.json");
      FAIL() << name;
    } catch (const IoError& e) {
      EXPECT_NE(std::string(e.what()).find(name), std::string::npos) << e.what();
    }
}

TEST(SculptScript, ExamplesReadAndFitTheSchema) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(MENISCUS_SOURCE_DIR "/examples/sculpt")) {
    if (entry.path().extension() != ".json") continue;
    std::ifstream file(entry.path());
    std::ostringstream text;
    text << file.rdbuf();
    const auto json = nlohmann::json::parse(text.str(), nullptr, true, true);
    if (!json.contains("strokes")) continue;
    EXPECT_TRUE(fits_schema(json)) << entry.path();
    EXPECT_NO_THROW(load_sculpt_script(entry.path().string())) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 3);
}

}  // namespace
}  // namespace meniscus::scene
