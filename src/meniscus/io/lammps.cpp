#include <meniscus/io/attribute_names.h>
#include <meniscus/io/lammps.h>
#include <meniscus/io/text_scanner.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

namespace meniscus::io {
namespace {

struct SimulationBox {
  Vec3 low = Vec3::Zero();
  Mat3 edges = Mat3::Identity();  ///< columns
};

/// BOX BOUNDS: three lines "lo hi", or "lo hi tilt" with the bounds of the sheared box's own bounding box.
SimulationBox read_box(TextScanner& in, bool sheared) {
  std::array<double, 3> low{}, high{}, tilt{};
  for (std::size_t c = 0; c < 3; ++c) {
    low[c] = in.number();
    high[c] = in.number();
    if (sheared) tilt[c] = in.number();
    in.next_line();
  }
  const auto [xy, xz, yz] = tilt;
  SimulationBox box;
  box.low = Vec3(low[0] - std::min({0.0, xy, xz, xy + xz}), low[1] - std::min(0.0, yz), low[2]);
  const Vec3 top(high[0] - std::max({0.0, xy, xz, xy + xz}), high[1] - std::max(0.0, yz), high[2]);
  const Vec3 size = top - box.low;
  box.edges << size.x(), xy, xz, 0, size.y(), yz, 0, 0, size.z();
  return box;
}

/// Integer columns by LAMMPS's own definition; everything else is a real number.
bool integer_column(std::string_view name) {
  static constexpr std::array<std::string_view, 8> kNames = {"id", "mol", "proc", "procp1", "type", "ix", "iy", "iz"};
  return std::find(kNames.begin(), kNames.end(), name) != kNames.end();
}

std::vector<Column> read_column_names(TextScanner& in) {
  std::vector<Column> columns;
  while (!in.at_line_end()) {
    if (columns.size() == 1000) in.fail("more than 1000 columns");
    const std::string_view name = in.word();
    columns.push_back({std::string(name), integer_column(name) ? NumberType::Int64 : NumberType::Float64, {}, {}});
  }
  in.next_line();
  return columns;
}

void read_atoms(TextScanner& in, std::uint64_t count, std::vector<Column>& columns) {
  in.require(count, 2 * columns.size(), "atoms");
  const auto element = std::find_if(columns.begin(), columns.end(), [](const Column& c) { return c.name == "element"; });
  for (Column& c : columns) is_integer(c.type) ? c.integers.resize(count) : c.values.resize(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    for (auto c = columns.begin(); c != columns.end(); ++c) {
      if (c == element)
        in.word();
      else if (is_integer(c->type))
        c->integers[i] = in.integer();
      else
        c->values[i] = in.number();
    }
    if (!in.at_line_end()) in.fail("more numbers than columns");
    in.next_line();
  }
  if (element != columns.end()) columns.erase(element);
}

bool rename_positions(std::vector<Column>& columns, const std::array<std::string_view, 3>& names) {
  std::array<Column*, 3> found{};
  for (std::size_t c = 0; c < 3; ++c)
    for (Column& column : columns)
      if (column.name == names[c]) found[c] = &column;
  if (!found[0] || !found[1] || !found[2]) return false;
  for (std::size_t c = 0; c < 3; ++c) found[c]->name = std::string(1, "xyz"[c]);
  return true;
}

/// Row order by identity; equal identities keep the order of the file.
void sort_by_identity(mesh::Mesh& m) {
  const auto ids = m.attributes.integers(attribute::kId);
  if (ids.empty() || std::is_sorted(ids.begin(), ids.end())) return;
  std::vector<std::size_t> order(ids.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return ids[a] < ids[b]; });
  std::vector<Vec3> positions(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) positions[i] = m.positions[order[i]];
  m.positions = std::move(positions);
  m.attributes = m.attributes.gathered(order);
}

RawGeometry assemble(std::vector<Column> columns, const SimulationBox& box, const TextScanner& in) {
  bool scaled = false;
  if (!has_position_columns(columns) && !rename_positions(columns, {"xu", "yu", "zu"})) {
    scaled = rename_positions(columns, {"xsu", "ysu", "zsu"}) || rename_positions(columns, {"xs", "ys", "zs"});
    if (!scaled) in.fail("the atoms have no x y z, xu yu zu, xs ys zs or xsu ysu zsu");
  }
  RawGeometry out;
  add_columns(std::move(columns), out.mesh.positions, out.mesh.attributes);
  if (scaled)
    for (Vec3& p : out.mesh.positions) p = box.low + box.edges * p;
  sort_by_identity(out.mesh);
  return out;
}

}  // namespace

bool is_lammps_extension(std::string_view extension) {
  return extension == "lammpstrj" || extension == "dump" || extension == "lammps";
}

std::vector<std::size_t> lammps_frames(std::string_view bytes) {
  constexpr std::string_view kStart = "ITEM: TIMESTEP";
  std::vector<std::size_t> starts;
  for (std::size_t at = bytes.find(kStart); at != bytes.npos; at = bytes.find(kStart, at + kStart.size()))
    if (at == 0 || bytes[at - 1] == '\n' || bytes[at - 1] == '\r' || (at == 3 && bytes.starts_with("\xEF\xBB\xBF")))
      starts.push_back(at);
  return starts;
}

RawGeometry read_lammps(const Source& source, std::size_t frame, ReadReport&) {
  const std::vector<std::size_t> starts = lammps_frames(source.bytes);
  TextScanner in(source.bytes, source.path);
  if (starts.empty()) in.fail("not a LAMMPS dump: no 'ITEM: TIMESTEP'");
  if (frame >= starts.size())
    throw IoError(source.path, "time step " + std::to_string(frame) + " was asked for; the file has " +
                                   std::to_string(starts.size()) + " (0 to " + std::to_string(starts.size() - 1) + ")");
  in.seek_line(starts[frame]);

  std::optional<std::uint64_t> count;
  SimulationBox box;
  for (;;) {
    if (!in.skip_space()) in.fail("the file ends early");
    if (in.word() != "ITEM:") in.fail("expected a line 'ITEM: …'");
    const std::string_view item = in.word();
    if (item == "ATOMS") break;
    const std::string_view rest = in.rest_of_line();
    in.next_line();
    if (item == "NUMBER") {
      count = in.count();
      in.next_line();
    } else if (item == "BOX") {
      box = read_box(in, rest.find("xy") != rest.npos);
    } else {
      in.next_line();  // TIMESTEP, TIME, UNITS: one line each
    }
  }
  std::vector<Column> columns = read_column_names(in);
  if (!count) in.fail("no 'ITEM: NUMBER OF ATOMS' before the atoms");
  if (columns.empty()) in.fail("'ITEM: ATOMS' names no columns");
  read_atoms(in, *count, columns);
  return assemble(std::move(columns), box, in);
}

}  // namespace meniscus::io
