#include <meniscus/base/error.h>
#include <meniscus/io/atomic_file.h>
#include <meniscus/scene/track_state.h>

#include <nlohmann/json.hpp>

#include <fstream>

namespace meniscus::scene {
namespace {

using nlohmann::json;

json to_json(const std::vector<Vec3>& vectors) {
  std::vector<double> flat;
  flat.reserve(3 * vectors.size());
  for (const Vec3& v : vectors) flat.insert(flat.end(), {v.x(), v.y(), v.z()});
  return flat;
}

std::vector<Vec3> vectors_from(const json& j) {
  const auto flat = j.get<std::vector<double>>();
  std::vector<Vec3> vectors;
  for (std::size_t i = 0; i + 2 < flat.size(); i += 3) vectors.emplace_back(flat[i], flat[i + 1], flat[i + 2]);
  return vectors;
}

json to_json(const Attributes& attributes) {
  json list = json::array();
  for (const Attribute& a : attributes)
    list.push_back({{"name", a.name},
                    {"components", a.components},
                    {"integer", a.is_integer()},
                    {"data", std::visit([](const auto& values) { return json(values); }, a.data)}});
  return list;
}

Attributes attributes_from(const json& list) {
  Attributes attributes;
  for (const json& a : list) {
    const auto name = a.at("name").get<std::string>();
    const auto components = a.at("components").get<std::size_t>();
    if (a.at("integer").get<bool>())
      attributes.set_integers(name, components, a.at("data").get<std::vector<std::int64_t>>());
    else
      attributes.set(name, components, a.at("data").get<std::vector<double>>());
  }
  return attributes;
}

TrackState state_from(const json& j) {
  TrackState state;
  state.mesh.positions = vectors_from(j.at("positions"));
  state.mesh.triangles = j.at("triangles").get<std::vector<Triangle>>();
  state.mesh.attributes = attributes_from(j.at("attributes"));
  state.references = {j.at("lengths").get<std::vector<double>>(),
                      j.at("areas").get<std::vector<double>>(),
                      vectors_from(j.at("velocity")),
                      {vectors_from(j.at("isometric").at(0)), vectors_from(j.at("isometric").at(1)),
                       j.at("isometric").at(2).get<std::vector<double>>()}};
  state.next_id = j.at("next_id").get<std::int64_t>();
  state.steps = j.at("steps").get<std::int64_t>();
  return state;
}

}  // namespace

void save_track_state(const std::string& path, const TrackState& state, const io::WriteOptions& options) {
  const auto& memory = state.references.isometric;
  const json j{{"positions", to_json(state.mesh.positions)},
               {"triangles", state.mesh.triangles},
               {"attributes", to_json(state.mesh.attributes)},
               {"lengths", state.references.lengths},
               {"areas", state.references.areas},
               {"velocity", to_json(state.references.velocity)},
               {"isometric", json::array({to_json(memory.positions), to_json(memory.normals), memory.tangential})},
               {"next_id", state.next_id},
               {"steps", state.steps}};
  const std::vector<std::uint8_t> bytes = json::to_cbor(j);
  io::AtomicFile file(path, options);
  file.write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  file.commit();
}

TrackState load_track_state(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw IoError(path, "cannot be read");
  try {
    return state_from(json::from_cbor(in));
  } catch (const json::exception&) {
    throw IoError(path, "is not the state of a tracking job");
  }
}

}  // namespace meniscus::scene
