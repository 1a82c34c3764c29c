#include <meniscus/io/atomic_file.h>
#include <meniscus/io/attribute_names.h>
#include <meniscus/io/byte_cursor.h>
#include <meniscus/io/ply.h>
#include <meniscus/io/text_scanner.h>
#include <meniscus/io/triangulate.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <optional>

namespace meniscus::io {
namespace {

static_assert(std::endian::native == std::endian::little, "binary PLY is written in memory order");

struct Property {
  std::string name;
  NumberType type = NumberType::Float32;
  std::optional<NumberType> list_count;  ///< set for lists
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  bool has_lists() const {
    return std::any_of(properties.begin(), properties.end(), [](const Property& p) { return p.list_count.has_value(); });
  }
};

enum class Encoding { Ascii, Little, Big };

struct Header {
  Encoding encoding = Encoding::Ascii;
  std::vector<Element> elements;
};

constexpr std::size_t kMostProperties = 1000;

NumberType parse_type(std::string_view word, const TextScanner& in) {
  struct Name {
    std::string_view name;
    NumberType type;
  };
  static constexpr std::array kNames = {
      Name{"char", NumberType::Int8},       Name{"int8", NumberType::Int8},       Name{"uchar", NumberType::UInt8},
      Name{"uint8", NumberType::UInt8},     Name{"short", NumberType::Int16},     Name{"int16", NumberType::Int16},
      Name{"ushort", NumberType::UInt16},   Name{"uint16", NumberType::UInt16},   Name{"int", NumberType::Int32},
      Name{"int32", NumberType::Int32},     Name{"uint", NumberType::UInt32},     Name{"uint32", NumberType::UInt32},
      Name{"float", NumberType::Float32},   Name{"float32", NumberType::Float32}, Name{"double", NumberType::Float64},
      Name{"float64", NumberType::Float64}, Name{"int64", NumberType::Int64},     Name{"uint64", NumberType::UInt64}};
  for (const Name& n : kNames)
    if (n.name == word) return n.type;
  in.fail("unknown property type '" + safe_name(word.substr(0, 40)) + "'");
}

void parse_property(TextScanner& in, Header& header) {
  if (header.elements.empty()) in.fail("a property before any element");
  Element& element = header.elements.back();
  if (element.properties.size() == kMostProperties) in.fail("more than 1000 properties in an element");
  Property p;
  std::string_view type = in.word();
  if (type == "list") {
    p.list_count = parse_type(in.word(), in);
    if (!is_integer(*p.list_count)) in.fail("the length of a list must have an integer type");
    type = in.word();
  }
  p.type = parse_type(type, in);
  p.name = in.word();
  if (p.name.empty()) in.fail("a property without a name");
  element.properties.push_back(std::move(p));
}

Header parse_header(TextScanner& in) {
  if (in.word() != "ply") in.fail("not a PLY file: the first line is not 'ply'");
  const std::size_t end_of_magic = in.position();
  in.next_line();
  const bool crlf = in.position() - end_of_magic == 2;  // then "end_header" ends so too, even before binary data
  Header header;
  bool format_seen = false;
  for (;; in.next_line()) {
    if (in.at_end()) in.fail("the file ends within its header");
    const std::string_view key = in.word();
    if (key == "end_header") break;
    if (key == "format") {
      const std::string_view name = in.word();
      if (name == "binary_little_endian")
        header.encoding = Encoding::Little;
      else if (name == "binary_big_endian")
        header.encoding = Encoding::Big;
      else if (name != "ascii")
        in.fail("unknown format '" + safe_name(name.substr(0, 40)) + "'");
      format_seen = true;
    } else if (key == "element") {
      if (header.elements.size() == kMostProperties) in.fail("more than 1000 elements");
      Element e;
      e.name = in.word();
      e.count = in.count();
      header.elements.push_back(std::move(e));
    } else if (key == "property") {
      parse_property(in, header);
    } else if (!key.empty() && key != "comment" && key != "obj_info") {
      in.fail("unknown header line '" + safe_name(key.substr(0, 40)) + "'");
    }
  }
  if (!format_seen) in.fail("the header has no format line");
  if (header.encoding == Encoding::Ascii) {
    in.next_line();
  } else {
    in.take(crlf ? 2 : 1);
  }
  return header;
}

template <class T>
void load_column(const char* first, std::size_t stride, std::endian order, std::uint64_t count, Column& column) {
  if constexpr (std::is_integral_v<T>) {
    column.integers.resize(count);
    for (std::size_t i = 0; i < count; ++i)
      column.integers[i] = static_cast<std::int64_t>(load<T>(first + i * stride, order));
  } else {
    column.values.resize(count);
    for (std::size_t i = 0; i < count; ++i) column.values[i] = static_cast<double>(load<T>(first + i * stride, order));
  }
}

void load_column(const char* first, std::size_t stride, std::endian order, std::uint64_t count, Column& column) {
  switch (column.type) {
    case NumberType::Int8: return load_column<std::int8_t>(first, stride, order, count, column);
    case NumberType::UInt8: return load_column<std::uint8_t>(first, stride, order, count, column);
    case NumberType::Int16: return load_column<std::int16_t>(first, stride, order, count, column);
    case NumberType::UInt16: return load_column<std::uint16_t>(first, stride, order, count, column);
    case NumberType::Int32: return load_column<std::int32_t>(first, stride, order, count, column);
    case NumberType::UInt32: return load_column<std::uint32_t>(first, stride, order, count, column);
    case NumberType::Int64: return load_column<std::int64_t>(first, stride, order, count, column);
    case NumberType::UInt64: return load_column<std::uint64_t>(first, stride, order, count, column);
    case NumberType::Float32: return load_column<float>(first, stride, order, count, column);
    case NumberType::Float64: return load_column<double>(first, stride, order, count, column);
  }
}

std::int64_t read_integer(ByteCursor& in, NumberType type) {
  switch (type) {
    case NumberType::Int8: return in.read<std::int8_t>();
    case NumberType::UInt8: return in.read<std::uint8_t>();
    case NumberType::Int16: return in.read<std::int16_t>();
    case NumberType::UInt16: return in.read<std::uint16_t>();
    case NumberType::Int32: return in.read<std::int32_t>();
    case NumberType::UInt32: return in.read<std::uint32_t>();
    case NumberType::Int64: return in.read<std::int64_t>();
    case NumberType::UInt64: {
      const auto value = in.read<std::uint64_t>();
      return value > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()) ? -1
                                                                                          : static_cast<std::int64_t>(value);
    }
    case NumberType::Float32:
    case NumberType::Float64: break;
  }
  in.fail("an index has a floating-point type");
}

std::uint64_t read_list_length(ByteCursor& in, NumberType type) {
  const std::int64_t n = read_integer(in, type);
  if (n < 0) in.fail("a list has a negative length");
  return static_cast<std::uint64_t>(n);
}

bool is_face_list(const Property& p) { return p.list_count && (p.name == "vertex_indices" || p.name == "vertex_index"); }

std::vector<Column> empty_columns(const Element& element) {
  std::vector<Column> columns;
  for (const Property& p : element.properties) columns.push_back({p.name, p.type, {}, {}});
  return columns;
}

/// Fewest bytes one entry of the element takes.
std::uint64_t smallest_entry(const Element& element) {
  std::uint64_t bytes = 0;
  for (const Property& p : element.properties) bytes += size_of(p.list_count ? *p.list_count : p.type);
  return bytes;
}

std::vector<Column> read_table(ByteCursor& in, const Element& element) {
  if (element.has_lists()) in.fail("element 'vertex' has a list property, which is not supported");
  const std::size_t stride = static_cast<std::size_t>(smallest_entry(element));
  const std::string_view rows = in.take(element.count * stride);
  std::vector<Column> columns = empty_columns(element);
  std::size_t offset = 0;
  for (Column& column : columns) {
    load_column(rows.data() + offset, stride, in.order(), element.count, column);
    offset += size_of(column.type);
  }
  return columns;
}

void skip_property(ByteCursor& in, const Property& p) {
  const std::uint64_t n = p.list_count ? read_list_length(in, *p.list_count) : 1;
  in.require(n, size_of(p.type), "list items");
  in.take(n * size_of(p.type));
}

/// Reads faces, or walks over the entries of an element nobody asked for.
void read_faces(ByteCursor& in, const Element& element, std::vector<Triangle>& triangles) {
  std::vector<std::int64_t> corners;
  for (std::uint64_t i = 0; i < element.count; ++i)
    for (const Property& p : element.properties) {
      if (element.name != "face" || !is_face_list(p)) {
        skip_property(in, p);
        continue;
      }
      const std::uint64_t n = read_list_length(in, *p.list_count);
      in.require(n, size_of(p.type), "corners of a face");
      corners.resize(n);
      for (std::int64_t& c : corners) c = read_integer(in, p.type);
      add_polygon(corners, triangles);
    }
}

/// Ascii entries may be split over lines as they like; the standard says one a line, writers differ.
void next_word(TextScanner& in) {
  if (!in.skip_space()) in.fail("the file ends early");
}

std::vector<Column> read_table(TextScanner& in, const Element& element) {
  if (element.has_lists()) in.fail("element 'vertex' has a list property, which is not supported");
  std::vector<Column> columns = empty_columns(element);
  for (Column& c : columns) is_integer(c.type) ? c.integers.resize(element.count) : c.values.resize(element.count);
  for (std::uint64_t i = 0; i < element.count; ++i)
    for (Column& c : columns) {
      next_word(in);
      if (is_integer(c.type))
        c.integers[i] = in.integer();
      else
        c.values[i] = in.number();
    }
  return columns;
}

void read_faces(TextScanner& in, const Element& element, std::vector<Triangle>& triangles) {
  std::vector<std::int64_t> corners;
  for (std::uint64_t i = 0; i < element.count; ++i)
    for (const Property& p : element.properties) {
      next_word(in);
      const std::uint64_t n = p.list_count ? in.count() : 1;
      in.require(n, 2, "list items");
      const bool wanted = element.name == "face" && is_face_list(p);
      corners.clear();
      for (std::uint64_t k = 0; k < n; ++k) {
        next_word(in);
        if (wanted)
          corners.push_back(in.integer());
        else
          in.number();
      }
      add_polygon(corners, triangles);
    }
}

template <class Input>
RawGeometry read_body(Input& in, const Header& header, const Source& source, ReadReport& report) {
  RawGeometry out;
  bool vertices = false;
  for (const Element& element : header.elements) {
    const bool text = header.encoding == Encoding::Ascii;
    if (element.properties.empty()) {
      if (element.count != 0)
        warn(report, "ignored-element", "element '" + safe_name(element.name) + "' has no properties", source.path);
      continue;
    }
    in.require(element.count, text ? 2 * element.properties.size() : smallest_entry(element),
               "entries of element '" + safe_name(element.name) + "'");
    if (element.name == "vertex" && !vertices) {
      vertices = true;
      if (!add_columns(read_table(in, element), out.mesh.positions, out.mesh.attributes))
        in.fail("element 'vertex' has no x, y and z");
      continue;
    }
    if (element.name == "face") {
      // Clouds are often written with a face element of no faces; an empty mesh stays a mesh.
      if (element.count > 0 || out.mesh.positions.empty()) out.kind = Geometry::Kind::Mesh;
    } else {
      warn(report, "ignored-element", "element '" + safe_name(element.name) + "' was skipped", source.path);
    }
    read_faces(in, element, out.mesh.triangles);
  }
  if (!vertices) in.fail("the file has no element 'vertex'");
  return out;
}

std::string_view type_name(const Attribute& a, Precision precision) {
  if (a.is_integer()) {
    // PLY knows no 64-bit integers; doubles hold what does not fit 32 bits exactly up to 2^53.
    const auto& values = std::get<1>(a.data);
    const bool small = std::all_of(values.begin(), values.end(), [](std::int64_t v) {
      return v >= std::numeric_limits<std::int32_t>::min() && v <= std::numeric_limits<std::int32_t>::max();
    });
    return small ? "int" : "double";
  }
  return precision == Precision::Float64 ? "double" : "float";
}

struct OutputColumn {
  const Attribute* attribute;
  std::size_t component;
  std::string_view type;
};

template <class T>
void append(std::string& row, T value) {
  row.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class T>
void append_text(std::string& row, T value) {
  char text[40];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value);
  row.append(text, end);
  row += ' ';
}

/// One number in the type of its column.
template <class T>
void append_number(std::string& row, T value, std::string_view type, bool text) {
  if (type == "int")
    return text ? append_text(row, static_cast<std::int32_t>(value)) : append(row, static_cast<std::int32_t>(value));
  if (type == "float") return text ? append_text(row, static_cast<float>(value)) : append(row, static_cast<float>(value));
  return text ? append_text(row, static_cast<double>(value)) : append(row, static_cast<double>(value));
}

void write_header(AtomicFile& file, const GeometryView& g, const WriteOptions& options,
                  const std::vector<OutputColumn>& columns, const std::vector<std::string>& names) {
  const std::string real = g.precision == Precision::Float64 ? "double" : "float";
  std::string h = std::string("ply\nformat ") + (options.text ? "ascii" : "binary_little_endian") + " 1.0\n";
  for (const std::string& comment : options.comments) {
    h += "comment ";
    for (const char c : comment) h += c == '\n' || c == '\r' ? ' ' : c;
    h += '\n';
  }
  h += "element vertex " + std::to_string(g.positions.size()) + "\n";
  for (const char c : {'x', 'y', 'z'}) h += "property " + real + " " + c + "\n";
  for (std::size_t i = 0; i < columns.size(); ++i) h += "property " + std::string(columns[i].type) + " " + names[i] + "\n";
  if (g.kind == Geometry::Kind::Mesh)
    h += "element face " + std::to_string(g.triangles.size()) + "\nproperty list uchar int vertex_indices\n";
  file.write(h + "end_header\n");
}

}  // namespace

RawGeometry read_ply(const Source& source, ReadReport& report) {
  TextScanner in(source.bytes, source.path);
  const Header header = parse_header(in);
  if (header.encoding == Encoding::Ascii) return read_body(in, header, source, report);
  const std::endian order = header.encoding == Encoding::Little ? std::endian::little : std::endian::big;
  ByteCursor bytes(source.bytes, source.path, order, in.position());
  return read_body(bytes, header, source, report);
}

void write_ply(AtomicFile& file, const GeometryView& g, const WriteOptions& options) {
  std::vector<OutputColumn> columns;
  std::vector<std::string> names;
  for (const Attribute& a : g.attributes) {
    const std::vector<std::string> own = column_names(a);
    for (std::size_t c = 0; c < a.components; ++c) {
      columns.push_back({&a, c, type_name(a, g.precision)});
      names.push_back(own[c]);
    }
  }
  write_header(file, g, options, columns, names);

  const std::string_view real = g.precision == Precision::Float64 ? "double" : "float";
  std::string row;
  const auto end_row = [&] {
    if (options.text) row.back() = '\n';
    file.write(row);
    row.clear();
  };
  for (std::size_t i = 0; i < g.positions.size(); ++i) {
    for (int c = 0; c < 3; ++c) append_number(row, g.positions[i][c], real, options.text);
    for (const OutputColumn& column : columns)
      std::visit(
          [&](const auto& values) {
            append_number(row, values[i * column.attribute->components + column.component], column.type, options.text);
          },
          column.attribute->data);
    end_row();
  }
  for (const Triangle& t : g.triangles) {
    if (options.text)
      row += "3 ";
    else
      row += '\3';
    for (const std::int32_t v : t) append_number(row, v, "int", options.text);
    end_row();
  }
}

}  // namespace meniscus::io
