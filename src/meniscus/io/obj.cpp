#include <meniscus/io/atomic_file.h>
#include <meniscus/io/obj.h>
#include <meniscus/io/text_scanner.h>
#include <meniscus/io/triangulate.h>

#include <charconv>

namespace meniscus::io {
namespace {

constexpr std::int64_t kNone = -1;

/// Files in the wild leave colours out for some vertices; then there is no attribute.
struct VertexColors {
  std::vector<double> values;
  bool complete = true;
};

struct Corner {
  std::int64_t vertex = kNone;
  std::int64_t normal = kNone;
};

/// One index of a corner: 1-based, or counted back from the last element read when negative. 0-based on return.
std::int64_t parse_index(const char*& at, const char* end, std::size_t count, const TextScanner& in) {
  std::int64_t index = 0;
  const auto [stop, error] = std::from_chars(at, end, index);
  if (error != std::errc{}) in.fail("a face needs numbers like 1, 1/2, 1//3 or 1/2/3");
  at = stop;
  if (index == 0) in.fail("indices of faces start at 1");
  const std::int64_t n = static_cast<std::int64_t>(count);
  if (index < -n) in.fail("index " + std::to_string(index) + " counts back beyond the first of " + std::to_string(n));
  return index < 0 ? n + index : index - 1;
}

Corner parse_corner(std::string_view word, std::size_t vertices, std::size_t normals, const TextScanner& in) {
  const char* at = word.data();
  const char* const end = at + word.size();
  Corner corner;
  corner.vertex = parse_index(at, end, vertices, in);
  if (at != end && *at == '/') {
    ++at;
    std::int64_t texture = 0;  // any number; its list is not kept
    const auto [stop, error] = std::from_chars(at, end, texture);
    at = stop;
    if (at != end && *at == '/') {
      ++at;
      if (at != end) corner.normal = parse_index(at, end, normals, in);
    }
  }
  if (at != end) in.fail("a face needs numbers like 1, 1/2, 1//3 or 1/2/3");
  return corner;
}

class Reader {
 public:
  Reader(const Source& source, ReadReport& report) : in_(source.bytes, source.path), path_(source.path), report_(report) {}

  RawGeometry read() {
    while (in_.skip_space()) {
      read_line();
      skip_rest();
    }
    add_normals();
    if (colors_.complete && !colors_.values.empty())
      out_.mesh.attributes.set(attribute::kColor, 3, std::move(colors_.values));
    check_normals();
    const bool empty = out_.mesh.positions.empty();
    if (empty && !known_) in_.fail("no line of an OBJ file ('v', 'f', …) was found");
    out_.kind = faces_ || empty ? Geometry::Kind::Mesh : Geometry::Kind::Cloud;
    return std::move(out_);
  }

 private:
  void read_line() {
    const std::string_view key = in_.word();
    if (key == "v") {
      read_vertex();
    } else if (key == "vn") {
      const double x = in_.number(), y = in_.number();
      normals_.emplace_back(x, y, in_.number());
    } else if (key == "f") {
      read_face();
    } else if (key == "l" || key == "p") {
      warn(report_, "ignored-elements", "lines and points ('l', 'p') were skipped", path_);
    } else if (!(key.starts_with('#') || key == "vt" || key == "g" || key == "o" || key == "s" || key == "usemtl" ||
                 key == "mtllib")) {
      return;
    }
    known_ = true;
  }

  void read_vertex() {
    double n[8];
    std::size_t count = 0;
    for (; count < 8 && !in_.at_line_end(); ++count) n[count] = in_.number();
    if (count < 3) in_.fail("a vertex needs three numbers");
    out_.mesh.positions.emplace_back(n[0], n[1], n[2]);
    // x y z r g b, or x y z w r g b; a lone fourth number is a weight.
    if (count >= 6)
      colors_.values.insert(colors_.values.end(), n + count - 3, n + count);
    else
      colors_.complete = false;
  }

  void read_face() {
    corners_.clear();
    vertices_.clear();
    while (!in_.at_line_end()) {
      const std::string_view word = in_.word();
      if (word == "\\") {
        in_.next_line();
        continue;
      }
      corners_.push_back(parse_corner(word, out_.mesh.positions.size(), normals_.size(), in_));
      vertices_.push_back(corners_.back().vertex);
    }
    if (corners_.size() < 3) in_.fail("a face needs three corners");
    add_polygon(vertices_, out_.mesh.triangles);
    faces_ = true;
    for (const Corner& c : corners_) note_normal(c);
  }

  void note_normal(const Corner& c) {
    if (!normals_consistent_) return;
    // A vertex may come after the face that uses it; such rare files keep no normals.
    if (c.normal == kNone || c.normal >= static_cast<std::int64_t>(normals_.size()) ||
        c.vertex >= static_cast<std::int64_t>(out_.mesh.positions.size())) {
      normals_consistent_ = false;
      return;
    }
    const auto v = static_cast<std::size_t>(c.vertex), n = static_cast<std::size_t>(c.normal);
    if (normal_of_.size() <= v) normal_of_.resize(out_.mesh.positions.size(), kNone);
    if (normal_of_[v] == kNone)
      normal_of_[v] = c.normal;
    else if (normal_of_[v] != c.normal && normals_[static_cast<std::size_t>(normal_of_[v])] != normals_[n])
      normals_consistent_ = false;
  }

  void add_normals() {
    const std::size_t count = out_.mesh.positions.size();
    if (!faces_) {
      // A cloud: one normal a vertex, in order.
      if (normals_.size() != count || count == 0) return;
      normal_of_.resize(count);
      for (std::size_t i = 0; i < count; ++i) normal_of_[i] = static_cast<std::int64_t>(i);
    } else if (!normals_consistent_ || normal_of_.empty()) {
      return;
    }
    normal_of_.resize(count, kNone);
    std::vector<double> values(3 * count, 0.0);
    for (std::size_t i = 0; i < count; ++i)
      if (normal_of_[i] != kNone)
        for (int c = 0; c < 3; ++c)
          values[3 * i + static_cast<std::size_t>(c)] = normals_[static_cast<std::size_t>(normal_of_[i])][c];
    out_.mesh.attributes.set(attribute::kNormal, 3, std::move(values));
  }

  void check_normals() {
    if (faces_ && !normals_.empty() && !out_.mesh.attributes.has(attribute::kNormal))
      warn(report_, "ignored-normals", "vertices have several normals (sharp edges); they were left out", path_);
  }

  /// A backslash at the end of a line continues it.
  void skip_rest() {
    while (in_.rest_of_line().ends_with('\\') && !in_.at_end()) in_.next_line();
  }

  TextScanner in_;
  std::string path_;
  ReadReport& report_;
  RawGeometry out_;
  VertexColors colors_;
  std::vector<Vec3> normals_;
  std::vector<std::int64_t> normal_of_;
  std::vector<Corner> corners_;
  std::vector<std::int64_t> vertices_;
  bool normals_consistent_ = true;
  bool faces_ = false;
  bool known_ = false;
};

}  // namespace

RawGeometry read_obj(const Source& source, ReadReport& report) { return Reader(source, report).read(); }

void write_obj(AtomicFile& file, const GeometryView& g, const WriteOptions& options) {
  for (const std::string& comment : options.comments) {
    file.write("# ");
    for (const char c : comment) file.put(c == '\n' || c == '\r' ? ' ' : c);
    file.put('\n');
  }
  const bool single = g.precision == Precision::Float32;
  const auto numbers = [&](const double* values) {
    for (int c = 0; c < 3; ++c) {
      file.put(' ');
      single ? file.number(static_cast<float>(values[c])) : file.number(values[c]);
    }
  };
  const auto normals = g.attributes.values(attribute::kNormal, 3);
  const auto colors = g.attributes.values(attribute::kColor, 3);
  for (std::size_t i = 0; i < g.positions.size(); ++i) {
    file.put('v');
    numbers(g.positions[i].data());
    if (!colors.empty()) numbers(&colors[3 * i]);
    file.put('\n');
  }
  for (std::size_t i = 0; i < normals.size(); i += 3) {
    file.write("vn");
    numbers(&normals[i]);
    file.put('\n');
  }
  for (const Triangle& t : g.triangles) {
    file.put('f');
    for (const std::int32_t v : t) {
      file.put(' ');
      file.number(std::int64_t{v} + 1);
      if (normals.empty()) continue;
      file.write("//");
      file.number(std::int64_t{v} + 1);
    }
    file.put('\n');
  }
}

}  // namespace meniscus::io
