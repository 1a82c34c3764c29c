#include <meniscus/io/number_array.h>
#include <meniscus/io/text_scanner.h>
#include <meniscus/io/vtk_cells.h>
#include <meniscus/io/vtk_legacy.h>

#include <algorithm>
#include <array>
#include <optional>

namespace meniscus::io {
namespace {

std::string upper(std::string_view word) {
  std::string out(word);
  for (char& c : out)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return out;
}

/// Names are written with %20 for a blank.
std::string decoded_name(std::string_view word) {
  std::string out;
  const auto hex = [](char c) {
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
  };
  for (std::size_t i = 0; i < word.size(); ++i) {
    if (word[i] == '%' && i + 2 < word.size() && hex(word[i + 1]) >= 0 && hex(word[i + 2]) >= 0) {
      out += static_cast<char>(16 * hex(word[i + 1]) + hex(word[i + 2]));
      i += 2;
    } else {
      out += word[i];
    }
  }
  return out;
}

class Reader {
 public:
  Reader(const Source& source, ReadReport& report) : in_(source.bytes, source.path), path_(source.path), report_(report) {}

  RawGeometry read() {
    read_header();
    while (in_.skip_space()) read_section(upper(in_.word()));
    if (!points_seen_) in_.fail("the file has no POINTS");
    add_cells();
    if (!out_.mesh.triangles.empty() || (out_.mesh.positions.empty() && polygons_seen_)) out_.kind = Geometry::Kind::Mesh;
    return std::move(out_);
  }

 private:
  enum class Owner { None, Points, Other };

  /// Cells of one section: the corners of cell i are connectivity[offsets[i] .. offsets[i + 1]).
  struct Cells {
    std::vector<std::int64_t> offsets, connectivity;
    std::size_t size() const { return offsets.empty() ? 0 : offsets.size() - 1; }
  };

  void read_header() {
    if (!in_.rest_of_line().starts_with("# vtk DataFile"))
      in_.fail("not a legacy VTK file: it does not start with '# vtk DataFile'");
    in_.next_line();
    in_.next_line();  // a title of any kind, even empty
    const std::string encoding = upper(in_.word());
    if (encoding != "ASCII" && encoding != "BINARY") in_.fail("expected ASCII or BINARY");
    binary_ = encoding == "BINARY";
    in_.next_line();
    if (!in_.skip_space() || upper(in_.word()) != "DATASET") in_.fail("expected DATASET");
    const std::string kind = upper(in_.word());
    if (kind != "POLYDATA" && kind != "UNSTRUCTURED_GRID")
      in_.fail("DATASET " + safe_name(kind.substr(0, 40)) + " is not supported (POLYDATA and UNSTRUCTURED_GRID are)");
    in_.next_line();
  }

  void read_section(const std::string& key) {
    if (key == "POINTS") return read_points();
    if (key == "CELLS") return read_cells(grid_);
    if (key == "POLYGONS") return read_polygons(VtkCell::Polygon);
    if (key == "TRIANGLE_STRIPS") return read_polygons(VtkCell::Strip);
    if (key == "VERTICES") return skip_cells(false);
    if (key == "LINES") return skip_cells(true);
    if (key == "CELL_TYPES") return read_cell_types();
    if (key == "POINT_DATA" || key == "CELL_DATA") return read_data_header(key);
    if (key == "SCALARS") return read_scalars();
    if (key == "VECTORS" || key == "NORMALS") return read_vectors(key, 3);
    if (key == "TENSORS") return read_vectors(key, 9);
    if (key == "COLOR_SCALARS") return read_colors();
    if (key == "TEXTURE_COORDINATES") return read_texture_coordinates();
    if (key == "LOOKUP_TABLE") return read_lookup_table();
    if (key == "FIELD") return read_field();
    if (key == "METADATA") return skip_metadata();
    if (key == "GLOBAL_IDS" || key == "PEDIGREE_IDS") return read_vectors(key, 1);
    in_.fail("unknown section '" + safe_name(key.substr(0, 40)) + "'");
  }

  NumberType parse_type(std::string_view word) {
    struct Name {
      std::string_view name;
      NumberType type;
    };
    static constexpr std::array kNames = {Name{"float", NumberType::Float32},
                                          Name{"double", NumberType::Float64},
                                          Name{"int", NumberType::Int32},
                                          Name{"unsigned_int", NumberType::UInt32},
                                          Name{"char", NumberType::Int8},
                                          Name{"signed_char", NumberType::Int8},
                                          Name{"unsigned_char", NumberType::UInt8},
                                          Name{"short", NumberType::Int16},
                                          Name{"unsigned_short", NumberType::UInt16},
                                          Name{"long", NumberType::Int64},
                                          Name{"unsigned_long", NumberType::UInt64},
                                          Name{"vtkidtype", NumberType::Int32},
                                          Name{"vtktypeint64", NumberType::Int64},
                                          Name{"vtktypeuint64", NumberType::UInt64},
                                          Name{"vtktypeint32", NumberType::Int32},
                                          Name{"vtktypeuint32", NumberType::UInt32},
                                          Name{"vtktypeint16", NumberType::Int16},
                                          Name{"vtktypeuint16", NumberType::UInt16},
                                          Name{"vtktypeint8", NumberType::Int8},
                                          Name{"vtktypeuint8", NumberType::UInt8},
                                          Name{"vtktypefloat32", NumberType::Float32},
                                          Name{"vtktypefloat64", NumberType::Float64}};
    for (const Name& n : kNames)
      if (upper(n.name) == upper(word)) return n.type;
    in_.fail("unsupported number type '" + safe_name(word.substr(0, 40)) + "'");
  }

  /// `count` items of `width` numbers each, which start on the next line.
  NumberArray read_numbers(std::uint64_t count, std::uint64_t width, NumberType type, std::string_view what) {
    in_.next_line();
    if (width == 0 || width > 1'000'000) in_.fail("an array has " + std::to_string(width) + " components");
    in_.require(count, width * (binary_ ? size_of(type) : 2), what);
    return read_numbers_here(count * width, type);
  }

  NumberArray read_numbers_here(std::uint64_t total, NumberType type) {
    if (binary_) return decode(in_.take(total * size_of(type)), type, std::endian::big);
    NumberArray out;
    out.type = type;
    if (is_integer(type))
      out.integers.resize(total);
    else
      out.reals.resize(total);
    for (std::uint64_t i = 0; i < total; ++i) {
      if (!in_.skip_space()) in_.fail("the file ends early");
      if (is_integer(type))
        out.integers[i] = in_.integer();
      else
        out.reals[i] = in_.number();
    }
    return out;
  }

  void read_points() {
    const std::uint64_t count = in_.count();
    const NumberType type = parse_type(in_.word());
    out_.mesh.positions = as_positions(read_numbers(count, 3, type, "points"));
    points_seen_ = true;
  }

  /// Version 5 has OFFSETS and CONNECTIVITY arrays; before, each cell is its length and its corners in one list.
  void read_cells(Cells& cells) {
    const std::uint64_t first = in_.count(), second = in_.count();
    in_.next_line();
    if (in_.next_is("OFFSETS")) return read_offsets(cells, first, second);
    in_.require(second, binary_ ? 4 : 2, "cell corners");
    const std::vector<std::int64_t> list = as_integers(read_numbers_here(second, NumberType::Int32));
    if (first > list.size()) in_.fail("declares more cells than corners");
    cells.offsets = {0};
    std::size_t at = 0;
    for (std::uint64_t i = 0; i < first; ++i) {
      if (at >= list.size() || list[at] < 0 || static_cast<std::uint64_t>(list[at]) > list.size() - at - 1)
        in_.fail("cell " + std::to_string(i) + " runs over the end of its list");
      const auto n = static_cast<std::size_t>(list[at++]);
      cells.connectivity.insert(cells.connectivity.end(), list.begin() + static_cast<std::ptrdiff_t>(at),
                                list.begin() + static_cast<std::ptrdiff_t>(at + n));
      at += n;
      cells.offsets.push_back(static_cast<std::int64_t>(cells.connectivity.size()));
    }
  }

  void read_offsets(Cells& cells, std::uint64_t offsets, std::uint64_t corners) {
    in_.word();  // OFFSETS
    const NumberType offset_type = parse_type(in_.word());
    cells.offsets = as_integers(read_numbers(offsets, 1, offset_type, "cell offsets"));
    if (!in_.skip_space() || in_.word() != "CONNECTIVITY") in_.fail("expected CONNECTIVITY");
    const NumberType corner_type = parse_type(in_.word());
    cells.connectivity = as_integers(read_numbers(corners, 1, corner_type, "cell corners"));
    const auto end = static_cast<std::int64_t>(cells.connectivity.size());
    if (!std::is_sorted(cells.offsets.begin(), cells.offsets.end()) ||
        (!cells.offsets.empty() && (cells.offsets.front() < 0 || cells.offsets.back() > end)))
      in_.fail("the cell offsets do not ascend from 0 to the number of corners");
  }

  void read_polygons(VtkCell type) {
    Cells cells;
    read_cells(cells);
    polygons_seen_ = true;
    for (std::size_t i = 0; i < cells.size(); ++i) add_cell(type, cells, i);
  }

  void skip_cells(bool lines) {
    Cells cells;
    read_cells(cells);
    if (lines && cells.size() > 0) warn_cells();
  }

  void read_cell_types() {
    const std::uint64_t count = in_.count();
    types_ = as_integers(read_numbers(count, 1, NumberType::Int32, "cell types"));
  }

  void add_cell(VtkCell type, const Cells& cells, std::size_t i) {
    const auto begin = static_cast<std::size_t>(cells.offsets[i]), end = static_cast<std::size_t>(cells.offsets[i + 1]);
    if (!add_vtk_cell(type, std::span(cells.connectivity).subspan(begin, end - begin), out_.mesh.triangles)) warn_cells();
  }

  void add_cells() {
    if (grid_.size() == 0) return;
    if (types_.size() != grid_.size())
      in_.fail(std::to_string(grid_.size()) + " cells, but " + std::to_string(types_.size()) + " cell types");
    for (std::size_t i = 0; i < grid_.size(); ++i) add_cell(static_cast<VtkCell>(types_[i]), grid_, i);
  }

  void warn_cells() { warn(report_, "ignored-cells", "cells that are neither surface nor vertices were skipped", path_); }

  void read_data_header(const std::string& key) {
    owner_ = key == "POINT_DATA" ? Owner::Points : Owner::Other;
    count_ = in_.count();
    if (owner_ == Owner::Points && points_seen_ && count_ != out_.mesh.positions.size())
      in_.fail("POINT_DATA for " + std::to_string(count_) + " of " + std::to_string(out_.mesh.positions.size()) + " points");
    if (owner_ == Owner::Other) warn(report_, "ignored-cell-data", "data of cells were skipped", path_);
    in_.next_line();
  }

  void keep(std::string_view name, std::size_t components, NumberArray array) {
    if (owner_ == Owner::Points) add_attribute(out_.mesh.attributes, name, components, std::move(array));
  }

  void read_scalars() {
    const std::string name = decoded_name(in_.word());
    const NumberType type = parse_type(in_.word());
    const std::uint64_t components = in_.at_line_end() ? 1 : in_.count();
    in_.next_line();
    if (!in_.skip_space() || upper(in_.word()) != "LOOKUP_TABLE") in_.fail("expected LOOKUP_TABLE after SCALARS");
    keep(name, components, read_numbers(count_, components, type, "scalars"));
  }

  void read_vectors(const std::string& key, std::size_t components) {
    const std::string name = decoded_name(in_.word());
    const NumberType type = parse_type(in_.word());
    keep(key == "NORMALS" ? "Normals" : name, components, read_numbers(count_, components, type, "vectors"));
  }

  void read_colors() {
    const std::string name = decoded_name(in_.word());
    const std::uint64_t components = in_.count();
    // Bytes in binary files, numbers from 0 to 1 in ascii ones.
    keep(components == 3 ? "Color" : name, components,
         read_numbers(count_, components, binary_ ? NumberType::UInt8 : NumberType::Float32, "colours"));
  }

  void read_texture_coordinates() {
    const std::string name = decoded_name(in_.word());
    const std::uint64_t components = in_.count();
    const NumberType type = parse_type(in_.word());
    keep(name, components, read_numbers(count_, components, type, "texture coordinates"));
  }

  void read_lookup_table() {
    in_.word();
    const std::uint64_t count = in_.count();
    read_numbers(count, 4, binary_ ? NumberType::UInt8 : NumberType::Float32, "colours");
  }

  /// Arrays of any length; those with one tuple a point are attributes.
  void read_field() {
    in_.word();
    const std::uint64_t arrays = in_.count();
    in_.next_line();
    in_.require(arrays, 4, "arrays");
    for (std::uint64_t i = 0; i < arrays; ++i) {
      if (!in_.skip_space()) in_.fail("the file ends early");
      const std::string name = decoded_name(in_.word());
      if (name == "METADATA") {
        skip_metadata();
        --i;
        continue;
      }
      const std::uint64_t components = in_.count(), tuples = in_.count();
      const NumberType type = parse_type(in_.word());
      NumberArray array = read_numbers(tuples, components, type, "field values");
      if (tuples == count_ && owner_ == Owner::Points) keep(name, components, std::move(array));
    }
  }

  /// Ends with an empty line.
  void skip_metadata() {
    in_.next_line();
    while (!in_.at_end() && !in_.at_line_end()) in_.next_line();
  }

  TextScanner in_;
  std::string path_;
  ReadReport& report_;
  RawGeometry out_;
  Cells grid_;
  std::vector<std::int64_t> types_;
  std::uint64_t count_ = 0;
  Owner owner_ = Owner::None;
  bool binary_ = false;
  bool points_seen_ = false;
  bool polygons_seen_ = false;
};

}  // namespace

RawGeometry read_vtk_legacy(const Source& source, ReadReport& report) { return Reader(source, report).read(); }

}  // namespace meniscus::io
