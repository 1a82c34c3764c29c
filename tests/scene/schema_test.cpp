#include <meniscus/base/error.h>
#include <meniscus/scene/build_field.h>
#include <meniscus/scene/schema.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>

#include <filesystem>
#include <fstream>

namespace meniscus::scene {
namespace {

bool fits_schema(const nlohmann::json& document) {
  const auto json = nlohmann::json::parse(scene_schema());
  valijson::Schema schema;
  valijson::SchemaParser().populateSchema(valijson::adapters::NlohmannJsonAdapter(json), schema);
  return valijson::Validator().validate(schema, valijson::adapters::NlohmannJsonAdapter(document), nullptr);
}

bool loads(const nlohmann::json& document) {
  try {
    build_field(Document::parse(document.dump(), MENISCUS_SOURCE_DIR "/scenes/test.json"));
    return true;
  } catch (const Error&) {
    return false;
  }
}

TEST(Schema, EveryShippedSceneFitsAndLoads) {
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(MENISCUS_SOURCE_DIR "/scenes")) {
    if (entry.path().extension() != ".json") continue;
    ++scenes;
    const auto json = nlohmann::json::parse(std::ifstream(entry.path()), nullptr, true, true);
    EXPECT_TRUE(fits_schema(json)) << entry.path();
    EXPECT_TRUE(loads(json)) << entry.path();
  }
  EXPECT_GE(scenes, 8);
}

TEST(Schema, AgreesWithTheLoaderOnMistakes) {
  const nlohmann::json good = nlohmann::json::parse(
      R"({"format":"meniscus.scene","version":1,"surface":{"type":"blobs","bias":0.3,"items":[{"center":[0,0,0],"radius":1}]}})");
  EXPECT_TRUE(fits_schema(good) && loads(good));
  const char* mistakes[] = {
      R"([{"op":"remove","path":"/format"}])",
      R"([{"op":"add","path":"/colour","value":1}])",
      R"([{"op":"replace","path":"/surface/type","value":"blob"}])",
      R"([{"op":"add","path":"/surface/radius","value":1}])",
      R"([{"op":"remove","path":"/surface/items"}])",
      R"([{"op":"replace","path":"/surface/items/0/center","value":[0,0]}])",
      R"([{"op":"replace","path":"/surface/items/0/radius","value":"big"}])",
      R"([{"op":"replace","path":"/surface/items/0/radius","value":{"expr":"1","t":[0]}}])",
      R"([{"op":"add","path":"/surface/items/0/size","value":1}])",
      R"([{"op":"add","path":"/fps","value":-1}])",
  };
  for (const char* patch : mistakes) {
    const auto bad = good.patch(nlohmann::json::parse(patch));
    EXPECT_FALSE(fits_schema(bad)) << patch;
    EXPECT_FALSE(loads(bad)) << patch;
  }
}

}  // namespace
}  // namespace meniscus::scene
