#include <meniscus/base/error.h>
#include <meniscus/io/atomic_file.h>
#include <meniscus/io/bgeo.h>
#include <meniscus/io/byte_cursor.h>
#include <meniscus/io/file_bytes.h>
#include <meniscus/io/format.h>
#include <meniscus/io/geometry.h>
#include <meniscus/io/lammps.h>
#include <meniscus/io/msurf.h>
#include <meniscus/io/obj.h>
#include <meniscus/io/off.h>
#include <meniscus/io/ply.h>
#include <meniscus/io/stl.h>
#include <meniscus/io/table.h>
#include <meniscus/io/usd.h>
#include <meniscus/io/vtk_legacy.h>
#include <meniscus/io/vtk_xml.h>

#include <algorithm>
#include <array>

namespace meniscus::io {
namespace {

struct Format {
  std::string_view name;
  std::string_view extensions;  ///< blank-separated
  /// Whether a file without a telling extension looks like this one.
  bool (*recognise)(std::string_view bytes);
  RawGeometry (*read)(const Source& source, const ReadOptions& options, ReadReport& report);   ///< null: cannot be read
  void (*write)(AtomicFile& file, const GeometryView& geometry, const WriteOptions& options);  ///< null: cannot be written
  bool single_precision = false;                                                               ///< holds no doubles
};

bool starts_with_line(std::string_view bytes, std::string_view word) {
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  return bytes.starts_with(word);
}

/// An OBJ file has no mark; its first line that is no comment starts with one of its keywords.
bool looks_like_obj(std::string_view bytes) {
  for (std::size_t at = 0; at < std::min<std::size_t>(bytes.size(), 1 << 16);) {
    const std::string_view line = bytes.substr(at, bytes.find_first_of("\r\n", at) - at);
    if (line.starts_with("v ") || line.starts_with("o ") || line.starts_with("g ") || line.starts_with("mtllib "))
      return true;
    if (!line.empty() && !line.starts_with('#')) return false;
    at += line.size() + 1;
  }
  return false;
}

/// A first line of numbers, or of printable words with separators; asked last, for it is not particular.
bool looks_like_table(std::string_view bytes) {
  while (bytes.starts_with('#')) bytes.remove_prefix(std::min(bytes.find('\n'), bytes.size() - 1) + 1);
  bytes.remove_prefix(std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size()));
  const std::string_view line = bytes.substr(0, bytes.find_first_of("\r\n"));
  if (bytes.find_first_of("+-.0123456789") == 0) return true;
  if (bytes.starts_with('{') || bytes.starts_with('[')) return false;  // JSON
  const bool printable =
      std::all_of(line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) >= ' ' || c == '\t'; });
  return printable && line.find_first_of(",;\t ") != line.npos;
}

/// Binary STL has no mark either, but its length must fit its count.
bool looks_like_stl(std::string_view bytes) {
  if (bytes.starts_with("solid")) return true;
  constexpr std::size_t kHead = 84, kFacet = 50;
  return bytes.size() >= kHead &&
         bytes.size() == kHead + kFacet * std::uint64_t{load<std::uint32_t>(bytes.data() + 80, std::endian::little)};
}

constexpr std::array kFormats = {
    Format{"ply", "ply", [](std::string_view b) { return starts_with_line(b, "ply\n") || starts_with_line(b, "ply\r"); },
           [](const Source& s, const ReadOptions&, ReadReport& r) { return read_ply(s, r); }, write_ply},
    Format{"vtk", "vtk", [](std::string_view b) { return starts_with_line(b, "# vtk DataFile"); },
           [](const Source& s, const ReadOptions&, ReadReport& r) { return read_vtk_legacy(s, r); }, nullptr},
    Format{"bgeo", "bgeo", [](std::string_view b) { return b.starts_with("BgeoV"); },
           [](const Source& s, const ReadOptions&, ReadReport& r) { return read_bgeo(s, r); }, nullptr},
    Format{"lammps", "lammpstrj dump lammps", [](std::string_view b) { return starts_with_line(b, "ITEM: TIMESTEP"); },
           [](const Source& s, const ReadOptions& o, ReadReport& r) { return read_lammps(s, o.frame, r); }, nullptr},
    Format{"obj", "obj", looks_like_obj, [](const Source& s, const ReadOptions&, ReadReport& r) { return read_obj(s, r); },
           write_obj},
    Format{"vtp", "vtp vtu", [](std::string_view b) { return b.substr(0, 1000).find("<VTKFile") != b.npos; },
           [](const Source& s, const ReadOptions& o, ReadReport& r) { return read_vtk_xml(s, o.memory_limit, r); },
           write_vtp},
    Format{"off", "off", [](std::string_view b) { return b.substr(0, 5).find("OFF") != b.npos; },
           [](const Source& s, const ReadOptions&, ReadReport& r) { return read_off(s, r); }, nullptr},
    Format{"stl", "stl", looks_like_stl, [](const Source& s, const ReadOptions&, ReadReport& r) { return read_stl(s, r); },
           write_stl, true},
    Format{"msurf", "msurf", looks_like_msurf,
           [](const Source& s, const ReadOptions&, ReadReport&) { return read_msurf_points(s); }, nullptr},
    Format{"usda", "usda", [](std::string_view b) { return b.starts_with("#usda"); }, nullptr, write_usda, true},
    Format{"csv", "csv", looks_like_table,
           [](const Source& s, const ReadOptions&, ReadReport& r) { return read_table(s, r); }, write_csv},
    Format{"xyz", "xyz txt", looks_like_table,
           [](const Source& s, const ReadOptions&, ReadReport& r) { return read_table(s, r); }, write_xyz},
};

bool has_word(std::string_view words, std::string_view word) {
  for (std::size_t at = 0; at <= words.size();) {
    const std::size_t end = std::min(words.find(' ', at), words.size());
    if (words.substr(at, end - at) == word) return true;
    at = end + 1;
  }
  return false;
}

const Format* find_by_name(std::string_view name) {
  for (const Format& f : kFormats)
    if (f.name == name || has_word(f.extensions, name)) return &f;
  return nullptr;
}

std::string known_extensions(bool writing) {
  std::string out;
  for (const Format& f : kFormats)
    if (!writing || f.write != nullptr) out += (out.empty() ? "" : " ") + std::string(f.extensions);
  return out;
}

const Format& format_for_reading(const std::string& path, std::string_view bytes, const ReadOptions& options) {
  if (options.format) {
    if (const Format* f = find_by_name(*options.format)) return *f;
    throw InvalidInput("unknown format '" + *options.format + "'; known: " + known_extensions(false));
  }
  if (const Format* f = find_by_name(format_of_path(path))) return *f;
  if (bytes.starts_with(" BDV")) throw IoError(path, "a VDB file holds grids, not points or faces");
  for (const Format& f : kFormats)
    if (f.recognise(bytes)) return f;
  throw IoError(path, "of no known format; extensions known: " + known_extensions(false));
}

const Format& format_for_writing(const std::string& path) {
  const std::string extension = path == "-" ? "ply" : format_of_path(path);
  const Format* f = path.ends_with(".gz") || extension == "vtu" ? nullptr : find_by_name(extension);
  if (f != nullptr && f->write != nullptr) return *f;
  throw InvalidInput(path + ": cannot write '." + extension + "'; extensions known: " + known_extensions(true));
}

Geometry read_inflated(const std::string& path, std::string_view bytes, const ReadOptions& options, ReadReport* report) {
  ReadReport own;
  ReadReport& r = report != nullptr ? *report : own;
  const Format& format = format_for_reading(path, bytes, options);
  r.format = format.name;
  if (format.read == nullptr) throw IoError(path, "files of this format can be written, not read");
  return finish(format.read({path, bytes}, options, r), path, r);
}

void write(const std::string& path, GeometryView geometry, const WriteOptions& options) {
  const Format& format = format_for_writing(path);
  if (format.single_precision) geometry.precision = Precision::Float32;
  check_writable(geometry);
  AtomicFile file(path, options);
  format.write(file, geometry, options);
  file.commit();
}

}  // namespace

std::string format_of_path(std::string_view path) {
  if (path.ends_with(".gz")) path.remove_suffix(3);
  const std::size_t dot = path.rfind('.');
  const std::size_t slash = path.rfind('/');
  if (dot == path.npos || (slash != path.npos && dot < slash)) return {};
  std::string out(path.substr(dot + 1));
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

std::string format_of_input(const std::string& path) {
  if (path != "-") return format_of_path(path);
  const std::string bytes = load_file(path, ReadOptions{}.memory_limit);
  if (bytes.starts_with(" BDV")) return "vdb";
  if (looks_like_msurf(bytes)) return "msurf";
  const std::size_t first = bytes.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  return first != bytes.npos && (bytes[first] == '{' || bytes[first] == '/') ? "json" : "";
}

Geometry read_geometry_bytes(const std::string& path, std::string_view bytes, const ReadOptions& options,
                             ReadReport* report) {
  if (is_gzip(bytes)) return read_inflated(path, inflate_gzip(bytes, path, options.memory_limit), options, report);
  return read_inflated(path, bytes, options, report);
}

Geometry read_geometry(const std::string& path, const ReadOptions& options, ReadReport* report) {
  return read_inflated(path, load_file(path, options.memory_limit), options, report);
}

mesh::Mesh read_mesh(const std::string& path, const ReadOptions& options, ReadReport* report) {
  Geometry g = read_geometry(path, options, report);
  if (g.kind == Geometry::Kind::Cloud && !g.cloud.empty())
    throw IoError(path, "holds points without faces; a mesh is needed");
  return g.kind == Geometry::Kind::Mesh ? std::move(g.mesh) : mesh::Mesh{};
}

points::Cloud read_cloud(const std::string& path, const ReadOptions& options, ReadReport* report) {
  Geometry g = read_geometry(path, options, report);
  if (g.kind == Geometry::Kind::Cloud) return std::move(g.cloud);
  return {std::move(g.mesh.positions), std::move(g.mesh.attributes)};
}

std::size_t count_frames(const std::string& path, const ReadOptions& options) {
  const std::string bytes = load_file(path, options.memory_limit);
  if (format_for_reading(path, bytes, options).name != "lammps") return 1;
  return lammps_frames(bytes).size();
}

void write_mesh(const std::string& path, const mesh::Mesh& mesh, const WriteOptions& options) {
  write(path,
        {mesh.positions, mesh.triangles, mesh.attributes, Geometry::Kind::Mesh,
         options.precision.value_or(Precision::Float32)},
        options);
}

void write_cloud(const std::string& path, const points::Cloud& cloud, const WriteOptions& options) {
  write(path, {cloud.positions, {}, cloud.attributes, Geometry::Kind::Cloud, options.precision.value_or(Precision::Float64)},
        options);
}

void write_geometry(const std::string& path, const Geometry& geometry, const WriteOptions& options) {
  if (geometry.kind == Geometry::Kind::Mesh)
    write_mesh(path, geometry.mesh, options);
  else
    write_cloud(path, geometry.cloud, options);
}

}  // namespace meniscus::io
