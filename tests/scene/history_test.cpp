#include <meniscus/base/error.h>
#include <meniscus/scene/build_field.h>
#include <meniscus/scene/history.h>

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::scene {
namespace {

const char* kScene = R"({"format":"meniscus.scene","version":1,
  "params":{"r":{"value":0.7,"min":0.1,"max":2}},
  "surface":{"type":"union","inputs":[
    {"type":"blobs","kernel":"compact","threshold":0.4,"items":[
      {"center":[0,0.5,0],"radius":0.9,"weight":1},{"center":[1,0,0],"radius":{"param":"r"}}]},
    {"type":"offset","distance":0.1,"input":{"type":"capsule","a":[0,0,0],"b":[{"expr":"t"},1,0],"radius":0.2}}]}})";

std::vector<double> values(const field::Field& f) {
  std::vector<double> q;
  for (const auto& p : f.parameters()) q.push_back(p.value);
  return q;
}

TEST(WriteParameters, EveryUnknownFindsItsPlace) {
  Document document = Document::parse(kScene, "scene.json");
  const auto f = build_field(document);
  EXPECT_TRUE(parameter_changes(document, f->parameters()).empty());
  std::vector<double> q = values(*f);
  for (std::size_t k = 0; k < q.size(); ++k) q[k] += 0.01 * static_cast<double>(k + 1);
  f->set_parameters(q);
  const auto changes = parameter_changes(document, f->parameters());
  EXPECT_EQ(changes.size(), q.size());
  write_parameters(document, changes);
  EXPECT_EQ(values(*build_field(document)), q);
}

TEST(WriteParameters, AllOrNothing) {
  Document document = Document::parse(kScene, "scene.json");
  const auto before = document.json();
  const ParameterChange good{"inputs[0].items[0].radius", false, 0.9, 1.1};
  for (const ParameterChange& bad : {ParameterChange{"inputs[0].items[7].radius", false, 0, 1},
                                     ParameterChange{"inputs[0].items[0].centre.x", false, 0, 1},
                                     ParameterChange{"inputs[1].input.b.x", false, 0, 1}, ParameterChange{"s", true, 0, 1},
                                     ParameterChange{"r", true, 0.7, 5}, ParameterChange{"r", true, 0.7, std::nan("")}}) {
    EXPECT_THROW(write_parameters(document, {good, bad}), InvalidInput) << bad.name;
    EXPECT_EQ(document.json(), before);
  }
}

TEST(History, UndoAndRedo) {
  Document document = Document::parse(kScene, "scene.json");
  const auto first = document.json();
  History history;
  EXPECT_FALSE(history.undo(document));
  history.apply(document, {"wider", {{"inputs[0].items[0].radius", false, 0.9, 1.2}, {"r", true, 0.7, 0.8}}});
  const auto second = document.json();
  history.apply(document, {"nothing", {}});
  EXPECT_EQ(history.size(), 1u);
  history.apply(document, {"higher", {{"inputs[0].items[0].center.y", false, 0.5, 0.6}}});
  const auto third = document.json();
  EXPECT_EQ(history.undo_label(), "higher");
  EXPECT_TRUE(history.undo(document));
  EXPECT_EQ(document.json(), second);
  EXPECT_EQ(history.redo_label(), "higher");
  EXPECT_TRUE(history.redo(document));
  EXPECT_EQ(document.json(), third);
  EXPECT_FALSE(history.redo(document));
  EXPECT_TRUE(history.undo(document));
  EXPECT_TRUE(history.undo(document));
  EXPECT_EQ(document.json(), first);
  history.apply(document, {"other", {{"r", true, 0.7, 1.0}}});
  EXPECT_EQ(history.redo_label(), "") << "a new command ends what was undone";
  EXPECT_THROW(history.apply(document, {"broken", {{"q", true, 0, 1}}}), InvalidInput);
  EXPECT_EQ(history.undo_label(), "other");
}

}  // namespace
}  // namespace meniscus::scene
