#include <meniscus/base/box.h>
#include <meniscus/base/error.h>
#include <meniscus/io/atomic_file.h>
#include <meniscus/io/attribute_names.h>
#include <meniscus/io/usd.h>
#include <meniscus/io/xml_scanner.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace meniscus::io {
namespace {

std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return out + "\"";
}

/// USD identifiers are letters, digits and "_".
std::string identifier(std::string_view name) {
  std::string out = safe_name(name);
  for (char& c : out)
    if (c == '.' || c == ':' || c == '-') c = '_';
  return out.front() >= '0' && out.front() <= '9' ? std::string("_").append(out) : out;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string out;
  for (const std::string& line : lines) out += (out.empty() ? "" : "; ") + line;
  return out;
}

void write_header(AtomicFile& file, const WriteOptions& options, const std::string& prim, const std::string& more = {}) {
  file.write("#usda 1.0\n(\n");
  if (!options.comments.empty()) file.write("    " + quoted(joined(options.comments)) + "\n");
  file.write("    defaultPrim = \"" + prim + "\"\n" + more + "    metersPerUnit = 1\n    timeCodesPerSecond = ");
  file.number(options.frames_per_second);
  file.write("\n    upAxis = \"Y\"\n)\n\n");
}

/// "name = [a, b]" or "name = [(a, b, c), …]" with floats.
void write_reals(AtomicFile& file, const std::string& declaration, std::span<const double> values, std::size_t width,
                 double scale = 1) {
  file.write("    " + declaration + " = [");
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0) file.write(", ");
    if (width > 1 && i % width == 0) file.put('(');
    const float value = static_cast<float>(values[i] * scale);
    if (!std::isfinite(value)) throw InvalidInput("a number is too large for USD's single precision: " + declaration);
    file.number(value);
    if (width > 1 && i % width == width - 1) file.put(')');
  }
  file.put(']');
}

void write_integers(AtomicFile& file, const std::string& declaration, std::span<const std::int64_t> values) {
  file.write("    " + declaration + " = [");
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0) file.write(", ");
    file.number(values[i]);
  }
  file.put(']');
}

constexpr const char* kPerVertex = " (\n        interpolation = \"vertex\"\n    )\n";

/// A primvar of any width; USD has float, float2, float3 and float4, wider ones use elementSize.
void write_primvar(AtomicFile& file, const Attribute& a) {
  const std::string name = identifier(a.name);
  if (a.is_integer()) {
    write_integers(file, "int64[] primvars:" + name, std::get<1>(a.data));
  } else {
    const bool tuple = a.components > 1 && a.components <= 4;
    const std::string type = tuple ? "float" + std::to_string(a.components) : "float";
    write_reals(file, type + "[] primvars:" + name, std::get<0>(a.data), tuple ? a.components : 1);
  }
  file.write(" (\n");
  if (a.components > 4 || (a.is_integer() && a.components > 1))
    file.write("        elementSize = " + std::to_string(a.components) + "\n");
  file.write("        interpolation = \"vertex\"\n    )\n");
}

/// Writes an attribute under USD's own name if it has one.
void write_attribute(AtomicFile& file, const Attribute& a, bool points) {
  const auto is = [&](std::string_view name, std::size_t components, bool integer) {
    return a.name == name && a.components == components && a.is_integer() == integer;
  };
  if (is(attribute::kVelocity, 3, false)) {
    write_reals(file, "vector3f[] velocities", std::get<0>(a.data), 3);
    file.put('\n');
  } else if (is(attribute::kNormal, 3, false)) {
    write_reals(file, "normal3f[] normals", std::get<0>(a.data), 3);
    file.write(kPerVertex);
  } else if (is(attribute::kColor, 3, false)) {
    write_reals(file, "color3f[] primvars:displayColor", std::get<0>(a.data), 3);
    file.write(kPerVertex);
  } else if (points && is(attribute::kRadius, 1, false)) {
    write_reals(file, "float[] widths", std::get<0>(a.data), 1, 2);
    file.write(kPerVertex);
  } else if (points && is(attribute::kId, 1, true)) {
    write_integers(file, "int64[] ids", std::get<1>(a.data));
    file.put('\n');
  } else {
    write_primvar(file, a);
  }
}

void write_topology(AtomicFile& file, std::span<const Triangle> triangles) {
  file.write("    int[] faceVertexCounts = [");
  for (std::size_t i = 0; i < triangles.size(); ++i) file.write(i > 0 ? ", 3" : "3");
  file.write("]\n    int[] faceVertexIndices = [");
  for (std::size_t i = 0; i < 3 * triangles.size(); ++i) {
    if (i > 0) file.write(", ");
    file.number(std::int64_t{triangles[i / 3][i % 3]});
  }
  file.write("]\n    uniform token subdivisionScheme = \"none\"\n");
}

void write_extent(AtomicFile& file, std::span<const Vec3> positions) {
  if (positions.empty()) return;
  Box box;
  for (const Vec3& p : positions) box.extend(p);
  const double corners[6] = {box.min.x(), box.min.y(), box.min.z(), box.max.x(), box.max.y(), box.max.z()};
  write_reals(file, "float3[] extent", corners, 3);
  file.put('\n');
}

/// "./" tells USD to look beside the document, not along its search path.
std::string anchored(const std::string& file) { return file.starts_with('/') || file.starts_with('.') ? file : "./" + file; }

std::string frame_name(std::size_t index) { return "frame_" + std::to_string(index); }

std::string decimal(double value) {
  char text[40];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value);
  return {text, end};
}

}  // namespace

void write_usda(AtomicFile& file, const GeometryView& g, const WriteOptions& options) {
  const bool mesh = g.kind == Geometry::Kind::Mesh;
  write_header(file, options, "surface");
  file.write(mesh ? "def Mesh \"surface\"\n{\n" : "def Points \"surface\"\n{\n");
  write_extent(file, g.positions);
  if (mesh) write_topology(file, g.triangles);
  write_reals(file, "point3f[] points", {g.positions.empty() ? nullptr : g.positions[0].data(), 3 * g.positions.size()}, 3);
  file.put('\n');
  for (const Attribute& a : g.attributes) write_attribute(file, a, !mesh);
  file.write("}\n");
}

void write_usd_sequence(const std::string& path, const std::vector<SequenceFile>& frames, const WriteOptions& options) {
  AtomicFile file(path, options);
  std::string range;
  if (!frames.empty())
    range = "    endTimeCode = " + decimal(frames.back().time) +
            "\n    framesPerSecond = " + decimal(options.frames_per_second) +
            "\n    startTimeCode = " + decimal(frames.front().time) + "\n";
  write_header(file, options, "sequence", range);
  file.write("def Xform \"sequence\"\n{\n");
  for (std::size_t i = 0; i < frames.size(); ++i) {
    file.write("    def \"" + frame_name(i) + "\" (\n        prepend references = @" + anchored(frames[i].file) +
               "@\n    )\n    {\n");
    file.write("        token visibility.timeSamples = {\n");
    if (i > 0) file.write("            " + decimal(frames[i - 1].time) + ": \"invisible\",\n");
    file.write("            " + decimal(frames[i].time) + ": \"inherited\",\n");
    if (i + 1 < frames.size()) file.write("            " + decimal(frames[i + 1].time) + ": \"invisible\",\n");
    file.write("        }\n    }\n");
  }
  file.write("}\n");
  file.commit();
}

void write_pvd(const std::string& path, const std::vector<SequenceFile>& frames, const WriteOptions& options) {
  AtomicFile file(path, options);
  file.write(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n");
  for (const SequenceFile& f : frames)
    file.write("<DataSet timestep=\"" + decimal(f.time) + "\" part=\"0\" file=\"" + xml_escaped(f.file) + "\"/>\n");
  file.write("</Collection>\n</VTKFile>\n");
  file.commit();
}

}  // namespace meniscus::io
