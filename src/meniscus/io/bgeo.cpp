#include <meniscus/io/attribute_names.h>
#include <meniscus/io/bgeo.h>
#include <meniscus/io/byte_cursor.h>
#include <meniscus/io/triangulate.h>

#include <optional>

namespace meniscus::io {
namespace {

enum class FieldType : std::uint32_t { Float = 0, Integer = 1, Text = 2, Index = 4, Vector = 5 };

struct Field {
  std::string name;
  FieldType type = FieldType::Float;
  std::size_t components = 1;
};

struct Counts {
  std::uint32_t points, primitives, point_groups, primitive_groups;
  std::uint32_t point_fields, vertex_fields, primitive_fields, detail_fields;
};

constexpr std::uint32_t kPolygon = 1;
constexpr std::uint32_t kRun = 0xFFFFFFFFu;

std::string read_text(ByteCursor& in) { return std::string(in.take(in.read<std::uint16_t>())); }

Field read_field(ByteCursor& in) {
  Field field;
  field.name = read_text(in);
  field.components = in.read<std::uint16_t>();
  const auto type = in.read<std::uint32_t>();
  field.type = static_cast<FieldType>(type);
  switch (field.type) {
    case FieldType::Float:
    case FieldType::Integer:
    case FieldType::Vector: in.take(4 * field.components); break;  // default values
    case FieldType::Index: {
      const auto texts = in.read<std::uint32_t>();
      in.require(texts, 2, "texts of an attribute");
      for (std::uint32_t i = 0; i < texts; ++i) read_text(in);
      break;
    }
    default:
      in.fail("attribute '" + safe_name(field.name.substr(0, 40)) + "' has the unsupported type " + std::to_string(type));
  }
  if (field.components == 0) in.fail("attribute '" + safe_name(field.name.substr(0, 40)) + "' has no components");
  return field;
}

std::vector<Field> read_fields(ByteCursor& in, std::uint32_t count) {
  in.require(count, 8, "attributes");
  if (count > 1000) in.fail("more than 1000 attributes");
  std::vector<Field> fields;
  for (std::uint32_t i = 0; i < count; ++i) fields.push_back(read_field(in));
  return fields;
}

std::uint64_t bytes_of(const std::vector<Field>& fields) {
  std::uint64_t bytes = 0;
  for (const Field& f : fields) bytes += 4 * f.components;
  return bytes;
}

void read_points(ByteCursor& in, const Counts& counts, RawGeometry& out) {
  const std::vector<Field> fields = read_fields(in, counts.point_fields);
  const std::uint64_t stride = 16 + bytes_of(fields);  // x y z w
  in.require(counts.points, stride, "points");
  const std::string_view rows = in.take(counts.points * stride);
  const auto number = [&](std::size_t row, std::size_t offset) {
    return static_cast<double>(load<float>(rows.data() + row * stride + offset, std::endian::big));
  };
  out.mesh.positions.resize(counts.points);
  for (std::size_t i = 0; i < counts.points; ++i) out.mesh.positions[i] = Vec3(number(i, 0), number(i, 4), number(i, 8));

  std::size_t offset = 16;
  for (const Field& f : fields) {
    const std::size_t n = f.components;
    if (f.type == FieldType::Integer || f.type == FieldType::Index) {
      std::vector<std::int64_t> values(counts.points * n);
      for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = load<std::int32_t>(rows.data() + (i / n) * stride + offset + 4 * (i % n), std::endian::big);
      add_attribute(out.mesh.attributes, f.name, n, std::move(values), NumberType::Int32);
    } else {
      std::vector<double> values(counts.points * n);
      for (std::size_t i = 0; i < values.size(); ++i) values[i] = number(i / n, offset + 4 * (i % n));
      add_attribute(out.mesh.attributes, f.name, n, std::move(values), NumberType::Float32);
    }
    offset += 4 * n;
  }
}

/// Reads one polygon; its corners are 16-bit numbers when the file has few points.
void read_polygon(ByteCursor& in, const Counts& counts, std::uint64_t vertex_bytes, std::uint64_t primitive_bytes,
                  std::vector<Triangle>& triangles) {
  const auto corners = in.read<std::uint32_t>();
  constexpr char kClosed = '<';
  const bool closed = in.take(1).front() == kClosed;
  const bool narrow = counts.points <= 0xFFFF;
  in.require(corners, (narrow ? 2 : 4) + vertex_bytes, "corners of a polygon");
  std::vector<std::int64_t> polygon(corners);
  for (std::int64_t& c : polygon) {
    c = narrow ? in.read<std::uint16_t>() : in.read<std::uint32_t>();
    in.take(vertex_bytes);
  }
  in.take(primitive_bytes);
  if (closed) add_polygon(polygon, triangles);
}

/// False when the file has a primitive of another kind, whose size is unknown here.
bool read_polygons(ByteCursor& in, const Counts& counts, std::vector<Triangle>& triangles) {
  const std::uint64_t vertex_bytes = bytes_of(read_fields(in, counts.vertex_fields));
  const std::uint64_t primitive_bytes = bytes_of(read_fields(in, counts.primitive_fields));
  in.require(counts.primitives, 5, "primitives");
  for (std::uint64_t done = 0; done < counts.primitives;) {
    std::uint32_t key = in.read<std::uint32_t>();
    std::uint64_t run = 1;
    if (key == kRun) {
      run = in.read<std::uint16_t>();
      key = in.read<std::uint32_t>();
    }
    if (key != kPolygon) return false;
    if (run == 0 || run > counts.primitives - done) in.fail("a run of polygons is longer than the file says");
    for (std::uint64_t i = 0; i < run; ++i) read_polygon(in, counts, vertex_bytes, primitive_bytes, triangles);
    done += run;
  }
  return true;
}

}  // namespace

RawGeometry read_bgeo(const Source& source, ReadReport& report) {
  ByteCursor in(source.bytes, source.path, std::endian::big);
  if (in.remaining() >= 4 && source.bytes.starts_with("\x7fNSJ"))
    in.fail("this is the newer (JSON) BGEO; save it as classic .bgeo or PLY");
  if (in.take(5) != "BgeoV") in.fail("not a classic BGEO file: it does not start with 'BgeoV'");
  if (const auto version = in.read<std::uint32_t>(); version != 5)
    in.fail("BGEO version " + std::to_string(version) + "; only 5 is known");
  Counts counts{};
  for (std::uint32_t* n : {&counts.points, &counts.primitives, &counts.point_groups, &counts.primitive_groups,
                           &counts.point_fields, &counts.vertex_fields, &counts.primitive_fields, &counts.detail_fields})
    *n = in.read<std::uint32_t>();

  RawGeometry out;
  read_points(in, counts, out);
  if (counts.primitives == 0) return out;
  if (read_polygons(in, counts, out.mesh.triangles)) {
    out.kind = Geometry::Kind::Mesh;
  } else {
    out.mesh.triangles.clear();
    warn(report, "ignored-primitives", "primitives other than polygons were skipped; the points are there", source.path);
  }
  return out;
}

}  // namespace meniscus::io
