#include <meniscus/base/error.h>
#include <meniscus/io/atomic_file.h>
#include <meniscus/io/text_scanner.h>
#include <meniscus/io/vtk_cells.h>
#include <meniscus/io/vtk_xml.h>
#include <meniscus/io/vtk_xml_array.h>
#include <meniscus/io/xml_scanner.h>

#include <algorithm>
#include <array>
#include <optional>

namespace meniscus::io {
namespace {

enum class Section { Other, PointData, Points, Verts, Lines, Strips, Polys, Cells };

Section section_of(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, Section>, 7> kSections = {{{"PointData", Section::PointData},
                                                                                     {"Points", Section::Points},
                                                                                     {"Verts", Section::Verts},
                                                                                     {"Lines", Section::Lines},
                                                                                     {"Strips", Section::Strips},
                                                                                     {"Polys", Section::Polys},
                                                                                     {"Cells", Section::Cells}}};
  for (const auto& [word, section] : kSections)
    if (word == name) return section;
  return Section::Other;
}

class Reader {
 public:
  Reader(const Source& source, std::uint64_t memory_limit, ReadReport& report)
      : in_(source.bytes, source.path), report_(report) {
    encoding_.path = source.path;
    encoding_.memory_limit = memory_limit;
    // Numbers take up to eight times the room they have in the file.
    budget_ = memory_limit > (1ull << 60) ? memory_limit : 8 * memory_limit;
  }

  RawGeometry read() {
    scan();
    if (!pieces_) in_.fail("not a VTK XML file with a <Piece>");
    read_points();
    for (const Section cells : {Section::Polys, Section::Strips, Section::Cells}) read_cells(cells);
    if (!arrays_of(Section::Lines).empty() && !decode_named(Section::Lines, "connectivity").integers.empty()) warn_cells();
    const bool surface = !out_.mesh.triangles.empty() || (out_.mesh.positions.empty() && !arrays_of(Section::Polys).empty());
    if (surface) out_.kind = Geometry::Kind::Mesh;
    return std::move(out_);
  }

 private:
  /// Notes every array and where the appended data start; nothing is decoded yet, for those stand at the end.
  void scan() {
    Section section = Section::Other;
    while (const auto tag = in_.next()) {
      if (tag->name == "VTKFile") read_head(*tag);
      if (tag->name == "Piece" && tag->opens) read_piece(*tag);
      if (tag->name == "DataArray" && tag->opens && section != Section::Other)
        arrays_.emplace_back(section, read_array(*tag));
      else if (tag->name != "DataArray" && tag->opens && !tag->closes)
        section = section_of(tag->name);
      else if (tag->name != "DataArray" && tag->closes)
        section = Section::Other;
      if (tag->name == "AppendedData" && tag->opens) {
        encoding_.appended_base64 = tag->find("encoding").value_or("base64") == "base64";
        std::string_view rest = in_.rest();
        const std::size_t mark = rest.find('_');
        if (mark == rest.npos) in_.fail("the appended data do not start with '_'");
        encoding_.appended = rest.substr(mark + 1);
        return;
      }
    }
  }

  void read_head(const XmlTag& tag) {
    if (!tag.opens) return;
    const auto type = tag.find("type").value_or("");
    if (type != "PolyData" && type != "UnstructuredGrid") in_.fail("only PolyData and UnstructuredGrid are supported");
    if (tag.find("byte_order").value_or("LittleEndian") == "BigEndian") encoding_.order = std::endian::big;
    if (tag.find("header_type").value_or("UInt32") == "UInt64") encoding_.header = NumberType::UInt64;
    const auto compressor = tag.find("compressor");
    if (compressor && *compressor != "vtkZLibDataCompressor")
      in_.fail("only the compressor vtkZLibDataCompressor is supported");
    encoding_.compressed = compressor.has_value();
  }

  std::uint64_t number(const XmlTag& tag, std::string_view attribute, std::uint64_t otherwise) const {
    const auto text = tag.find(attribute);
    if (!text) return otherwise;
    std::int64_t value = 0;
    if (!parse_integer(*text, value) || value < 0) in_.fail("the attribute " + std::string(attribute) + " is no count");
    return static_cast<std::uint64_t>(value);
  }

  void read_piece(const XmlTag& tag) {
    const std::uint64_t points = number(tag, "NumberOfPoints", 0);
    if (pieces_ && points > 0) in_.fail("files with several pieces are not supported; merge them first");
    pieces_ = true;
    points_ = points;
  }

  VtkXmlArray read_array(const XmlTag& tag) const {
    VtkXmlArray a;
    a.name = xml_unescaped(tag.find("Name").value_or("")).substr(0, 200);
    const auto type = vtk_xml_type(tag.find("type").value_or(""));
    if (!type) in_.fail("array '" + safe_name(a.name) + "' has an unknown type");
    a.type = *type;
    a.components = number(tag, "NumberOfComponents", 1);
    if (a.components == 0 || a.components > 1000)
      in_.fail("array '" + safe_name(a.name) + "' has a strange number of components");
    a.format = tag.find("format").value_or("ascii");
    a.offset = number(tag, "offset", 0);
    if (!tag.closes) a.content = in_.content();
    if (arrays_.size() == 1000) in_.fail("more than 1000 arrays");
    return a;
  }

  std::vector<const VtkXmlArray*> arrays_of(Section section) const {
    std::vector<const VtkXmlArray*> out;
    for (const auto& [s, array] : arrays_)
      if (s == section) out.push_back(&array);
    return out;
  }

  /// Decodes an array at the expense of the memory limit: many arrays may claim the same appended bytes.
  NumberArray take(const VtkXmlArray& array) {
    NumberArray out = decode(array, encoding_);
    const std::uint64_t bytes = sizeof(double) * out.size();
    if (bytes > budget_) throw ResourceLimit(encoding_.path + ": its arrays are larger than the memory limit for reading");
    budget_ -= bytes;
    return out;
  }

  void read_points() {
    const auto arrays = arrays_of(Section::Points);
    if (arrays.empty() && points_ > 0) in_.fail("the piece has no <Points>");
    if (!arrays.empty()) out_.mesh.positions = as_positions(take(*arrays.front()));
    if (out_.mesh.positions.size() != points_)
      in_.fail("declares " + std::to_string(points_) + " points, but holds " + std::to_string(out_.mesh.positions.size()));
    for (const VtkXmlArray* a : arrays_of(Section::PointData)) {
      NumberArray values = take(*a);
      if (values.size() != points_ * a->components)
        in_.fail("array '" + safe_name(a->name) + "' has " + std::to_string(values.size()) + " numbers for " +
                 std::to_string(points_) + " points of " + std::to_string(a->components));
      add_attribute(out_.mesh.attributes, a->name, a->components, std::move(values));
    }
  }

  NumberArray decode_named(Section section, std::string_view name) {
    for (const VtkXmlArray* a : arrays_of(section))
      if (a->name == name) return take(*a);
    return {.type = NumberType::Int64, .reals = {}, .integers = {}};
  }

  void read_cells(Section section) {
    const std::vector<std::int64_t> corners = as_integers(decode_named(section, "connectivity"));
    const std::vector<std::int64_t> ends = as_integers(decode_named(section, "offsets"));
    const std::vector<std::int64_t> types = as_integers(decode_named(section, "types"));
    if (section == Section::Cells && types.size() != ends.size()) in_.fail("the cells have no types");
    std::int64_t begin = 0;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      const std::int64_t end = ends[i];
      if (end < begin || end > static_cast<std::int64_t>(corners.size()))
        in_.fail("the offsets of the cells do not ascend to their end");
      const VtkCell type = section == Section::Cells    ? static_cast<VtkCell>(types[i])
                           : section == Section::Strips ? VtkCell::Strip
                                                        : VtkCell::Polygon;
      const std::span cell =
          std::span(corners).subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin));
      if (!add_vtk_cell(type, cell, out_.mesh.triangles)) warn_cells();
      begin = end;
    }
  }

  void warn_cells() {
    warn(report_, "ignored-cells", "cells that are neither surface nor vertices were skipped", encoding_.path);
  }

  XmlScanner in_;
  ReadReport& report_;
  VtkXmlEncoding encoding_;
  RawGeometry out_;
  std::vector<std::pair<Section, VtkXmlArray>> arrays_;
  std::uint64_t points_ = 0;
  std::uint64_t budget_ = 0;
  bool pieces_ = false;
};

/// Gathers arrays: in text they stand where they are declared, otherwise they are appended at the end.
class ArrayWriter {
 public:
  ArrayWriter(AtomicFile& file, bool text) : file_(file), text_(text) {}

  template <class T>
  void add(std::string_view name, std::size_t components, NumberType type, const std::vector<T>& values) {
    std::string tag = "<DataArray type=\"" + std::string(vtk_xml_name(type)) + "\" Name=\"" + xml_escaped(name) +
                      "\" NumberOfComponents=\"" + std::to_string(components) + "\" format=\"";
    if (text_) {
      file_.write(tag + "ascii\">\n");
      for (std::size_t i = 0; i < values.size(); ++i) {
        if constexpr (std::is_integral_v<T>)
          file_.number(static_cast<std::int64_t>(values[i]));
        else
          file_.number(values[i]);
        file_.put((i + 1) % components == 0 ? '\n' : ' ');
      }
      file_.write("</DataArray>\n");
      return;
    }
    file_.write(tag + "appended\" offset=\"" + std::to_string(appended_.size()) + "\"/>\n");
    const std::uint64_t bytes = values.size() * sizeof(T);
    appended_.append(reinterpret_cast<const char*>(&bytes), sizeof bytes);
    appended_.append(reinterpret_cast<const char*>(values.data()), bytes);
  }

  void add_real(std::string_view name, std::size_t components, std::span<const double> values, Precision precision) {
    if (precision == Precision::Float64)
      add(name, components, NumberType::Float64, std::vector<double>(values.begin(), values.end()));
    else
      add(name, components, NumberType::Float32, std::vector<float>(values.begin(), values.end()));
  }

  void finish() {
    if (text_) return;
    file_.write("<AppendedData encoding=\"raw\">\n_");
    file_.write(appended_);
    file_.write("\n</AppendedData>\n");
  }

 private:
  AtomicFile& file_;
  bool text_;
  std::string appended_;
};

void write_attributes(AtomicFile& file, ArrayWriter& arrays, const GeometryView& g) {
  file.write("<PointData>\n");
  for (const Attribute& a : g.attributes) {
    const std::string name = exchange_name(a.name);
    if (a.is_integer())
      arrays.add(name, a.components, NumberType::Int64, std::get<1>(a.data));
    else
      arrays.add_real(name, a.components, std::get<0>(a.data), g.precision);
  }
  file.write("</PointData>\n");
}

void write_cells(AtomicFile& file, ArrayWriter& arrays, const char* section, std::vector<std::int64_t> corners,
                 std::size_t per_cell) {
  std::vector<std::int64_t> ends(corners.size() / per_cell);
  for (std::size_t i = 0; i < ends.size(); ++i) ends[i] = static_cast<std::int64_t>((i + 1) * per_cell);
  file.write(std::string("<") + section + ">\n");
  arrays.add("connectivity", 1, NumberType::Int64, corners);
  arrays.add("offsets", 1, NumberType::Int64, ends);
  file.write(std::string("</") + section + ">\n");
}

}  // namespace

RawGeometry read_vtk_xml(const Source& source, std::uint64_t memory_limit, ReadReport& report) {
  return Reader(source, memory_limit, report).read();
}

void write_vtp(AtomicFile& file, const GeometryView& g, const WriteOptions& options) {
  const bool mesh = g.kind == Geometry::Kind::Mesh;
  file.write("<?xml version=\"1.0\"?>\n");
  for (const std::string& comment : options.comments) {
    file.write("<!-- ");
    char last = ' ';
    for (const char c : xml_escaped(comment)) {
      if (c == '-' && last == '-') file.put(' ');  // "--" may not stand in a comment
      file.put(last = c);
    }
    file.write(" -->\n");
  }
  file.write("<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n");
  file.write("<Piece NumberOfPoints=\"" + std::to_string(g.positions.size()) + "\" NumberOfVerts=\"" +
             std::to_string(mesh ? 0 : g.positions.size()) + "\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"" +
             std::to_string(g.triangles.size()) + "\">\n");
  ArrayWriter arrays(file, options.text);
  write_attributes(file, arrays, g);
  file.write("<Points>\n");
  arrays.add_real("Points", 3, {g.positions.empty() ? nullptr : g.positions[0].data(), 3 * g.positions.size()}, g.precision);
  file.write("</Points>\n");
  if (mesh) {
    std::vector<std::int64_t> corners;
    corners.reserve(3 * g.triangles.size());
    for (const Triangle& t : g.triangles) corners.insert(corners.end(), t.begin(), t.end());
    write_cells(file, arrays, "Polys", std::move(corners), 3);
  } else {
    std::vector<std::int64_t> corners(g.positions.size());
    for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = static_cast<std::int64_t>(i);
    write_cells(file, arrays, "Verts", std::move(corners), 1);
  }
  file.write("</Piece>\n</PolyData>\n");
  arrays.finish();
  file.write("</VTKFile>\n");
}

}  // namespace meniscus::io
