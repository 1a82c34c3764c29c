#include <meniscus/field/field.h>
#include <meniscus/scene/build_field.h>

#include <gtest/gtest.h>

#include <filesystem>

namespace meniscus::scene {
namespace {

Document document(const std::string& surface, const std::string& params = "{}") {
  return Document::parse(R"({"format":"meniscus.scene","version":1,"params":)" + params + R"(,"surface":)" + surface + "}",
                         "test.json");
}

std::unique_ptr<field::Field> build(const std::string& surface, const std::string& params = "{}") {
  return build_field(document(surface, params));
}

std::string failure(const std::string& surface, const std::string& params = "{}") {
  try {
    build(surface, params);
  } catch (const IoError& e) {
    return e.what();
  }
  return "";
}

TEST(BuildField, KnownValues) {
  EXPECT_NEAR(field::value_at(*build(R"({"type":"sphere","center":[0,0,0],"radius":2})"), {3, 0, 0}), 1, 1e-15);
  EXPECT_NEAR(
      field::value_at(*build(R"({"type":"blobs","kernel":"gaussian","bias":0.5,"items":[{"center":[0,0,0],"radius":1}]})"),
                      {1, 0, 0}),
      0.5 - std::exp(-1.0), 1e-14);
  EXPECT_NEAR(field::value_at(*build(R"({"type":"expression","f":"x^2+y^2-r"})", R"({"r":{"value":4}})"), {3, 0, 7}), 5,
              1e-14);
  EXPECT_NEAR(field::value_at(*build(R"({"type":"transform","translate":[1,0,0],"rotate":[0,0,90],"scale":2,"input":
      {"type":"plane","point":[0,0,0],"normal":[1,0,0]}})"),
                              {1, 3, 0}),
              3, 1e-13);
}

TEST(BuildField, UnknownsAreNamedByTheirPlace) {
  const auto f = build(R"({"type":"union","inputs":[
      {"type":"sphere","center":[0,0,0],"radius":{"param":"r"},"freeze":["center"]},
      {"type":"offset","distance":0.1,"input":{"type":"sphere","center":[1,0,0],"radius":{"param":"r"},"freeze":["center.y"]}}]})",
                       R"({"r":{"value":0.7,"min":0.1,"max":2}})");
  std::vector<std::string> names;
  for (const auto& p : f->parameters()) names.push_back(p.name);
  EXPECT_EQ(names,
            (std::vector<std::string>{"r", "inputs[1].input.center.x", "inputs[1].input.center.z", "inputs[1].distance"}));
  EXPECT_EQ(f->parameters()[0].max, 2);
}

TEST(BuildField, CurvesAndFormulasMove) {
  const auto f = build(R"({"type":"sphere","center":[{"t":[0,1],"v":[0,2]},0,0],"radius":{"expr":"1+t^2"}})");
  f->set_time(0.5);
  const auto jets = field::evaluate(*f, {{4, 0, 0}}, field::Order::GradientTime);
  EXPECT_NEAR(jets.value(0), 4 - 1 - 1.25, 1e-14);
  EXPECT_NEAR(jets.time(0), -2 - 1, 1e-12);
}

TEST(BuildField, MistakesAreNamedWithTheirPlace) {
  EXPECT_NE(failure(R"({"type":"spere"})").find("did you mean 'sphere'"), std::string::npos);
  EXPECT_NE(failure(R"({"type":"sphere","center":[0,0,0],"raduis":1})")
                .find("surface: unknown key 'raduis' (did you mean 'radius'?)"),
            std::string::npos);
  EXPECT_NE(failure(R"({"type":"sphere","center":[0,0],"radius":1})").find("surface.center"), std::string::npos);
  EXPECT_NE(failure(R"({"type":"sphere","center":[0,0,0],"radius":-1})").find("radius must not be negative"),
            std::string::npos);
  EXPECT_NE(failure(R"({"type":"union","inputs":[]})").find("surface.inputs"), std::string::npos);
  EXPECT_NE(failure(R"({"type":"sphere","center":[0,0,0],"radius":{"param":"rr"}})", R"({"rrr":{"value":1}})")
                .find("did you mean 'rrr'"),
            std::string::npos);
  EXPECT_NE(failure(R"j({"type":"expression","f":"x + sni(y)"})j").find("surface.f"), std::string::npos);
  EXPECT_NE(failure(R"({"type":"mesh","file":"nowhere.obj"})").find("nowhere.obj"), std::string::npos);
  EXPECT_NE(failure(R"({"type":"sphere","center":[0,0,0],"radius":{"t":[1,0],"v":[1,2]}})").find("surface.radius"),
            std::string::npos);
}

TEST(BuildField, DeepNestingIsRefused) {
  std::string s = R"({"type":"sphere","center":[0,0,0],"radius":1})";
  for (int i = 0; i < 300; ++i) s = R"({"type":"offset","distance":0.1,"input":)" + s + "}";
  EXPECT_NE(failure(s).find("deep"), std::string::npos);
}

TEST(Document, HeaderIsChecked) {
  const auto parse = [](const std::string& text) { return Document::parse(text, "s.json"); };
  EXPECT_THROW(parse("{"), IoError);
  EXPECT_THROW(parse("[]"), IoError);
  EXPECT_THROW(parse(R"({"format":"other","version":1,"surface":{}})"), IoError);
  EXPECT_THROW(parse(R"({"format":"meniscus.scene","version":2,"surface":{}})"), IoError);
  EXPECT_THROW(parse(R"({"format":"meniscus.scene","version":1,"fps":0,"surface":{}})"), IoError);
  EXPECT_THROW(parse(R"({"format":"meniscus.scene","version":1,"range":[5,1],"surface":{}})"), IoError);
  EXPECT_THROW(parse(R"({"format":"meniscus.scene","version":1,"surfcae":{}})"), IoError);
  try {
    parse("{\n\n  \"format\": oops\n}");
    ADD_FAILURE();
  } catch (const IoError& e) {
    EXPECT_EQ(e.place().number, 3u) << e.what();
  }
  EXPECT_EQ(parse("\xEF\xBB\xBF// a comment\n{\"format\":\"meniscus.scene\",\"version\":1,\"fps\":25,\"surface\":{}}")
                .frames_per_second(),
            25);
}

TEST(Document, ParametersKeepTheirRange) {
  Document d = document("{}", R"({"r":{"value":1,"max":2}})");
  d.set_parameter("r", 2);
  EXPECT_THROW(d.set_parameter("r", 3), InvalidInput);
  EXPECT_EQ(d.json()["params"]["r"]["value"], 2);
  EXPECT_THROW(d.set_parameter("q", 1), InvalidInput);
}

}  // namespace
}  // namespace meniscus::scene
