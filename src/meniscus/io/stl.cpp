#include <meniscus/io/atomic_file.h>
#include <meniscus/io/byte_cursor.h>
#include <meniscus/io/stl.h>
#include <meniscus/io/text_scanner.h>

#include <Eigen/Geometry>

#include <bit>
#include <unordered_map>

namespace meniscus::io {
namespace {

constexpr std::size_t kHeader = 80;
constexpr std::size_t kFacet = 50;

struct PositionHash {
  std::size_t operator()(const Vec3& p) const {
    std::uint64_t h = 0;
    for (int c = 0; c < 3; ++c) {
      h ^= std::bit_cast<std::uint64_t>(p[c] + 0.0);  // -0 and 0 are equal, so they must hash alike
      h *= 0x9E3779B97F4A7C15ull;
      h ^= h >> 29;
    }
    return static_cast<std::size_t>(h);
  }
};

/// Numbers positions in the order of their first appearance.
class Welder {
 public:
  explicit Welder(mesh::Mesh& m) : mesh_(m) {}

  std::int32_t vertex(const Vec3& p) {
    const auto [at, fresh] = index_.try_emplace(p, static_cast<std::int32_t>(mesh_.positions.size()));
    if (fresh) mesh_.positions.push_back(p);
    return at->second;
  }

 private:
  mesh::Mesh& mesh_;
  std::unordered_map<Vec3, std::int32_t, PositionHash> index_;
};

bool is_binary(std::string_view bytes) {
  if (bytes.size() < kHeader + 4) return false;
  const auto count = load<std::uint32_t>(bytes.data() + kHeader, std::endian::little);
  return bytes.size() == kHeader + 4 + count * std::uint64_t{kFacet} ||
         !(bytes.starts_with("solid") || bytes.starts_with("\xEF\xBB\xBFsolid"));
}

void read_binary(const Source& source, mesh::Mesh& m) {
  ByteCursor in(source.bytes, source.path, std::endian::little);
  in.take(kHeader);
  const auto count = in.read<std::uint32_t>();
  in.require(count, kFacet, "facets");
  Welder welder(m);
  m.triangles.resize(count);
  for (Triangle& t : m.triangles) {
    in.take(12);  // normal
    for (std::int32_t& v : t) {
      const float x = in.read<float>(), y = in.read<float>(), z = in.read<float>();
      v = welder.vertex(Vec3(x, y, z));
    }
    in.take(2);
  }
}

void read_text(const Source& source, mesh::Mesh& m) {
  TextScanner in(source.bytes, source.path);
  if (in.word() != "solid") in.fail("neither an ascii STL ('solid …') nor a binary one of the right length");
  in.next_line();
  Welder welder(m);
  std::vector<std::int32_t> loop;
  bool ended = false;
  for (; in.skip_space(); in.next_line()) {
    const std::string_view key = in.word();
    if (key == "vertex") {
      const double x = in.number(), y = in.number();
      loop.push_back(welder.vertex(Vec3(x, y, in.number())));
    } else if (key == "endloop") {
      if (loop.size() != 3) in.fail("a facet has " + std::to_string(loop.size()) + " vertices instead of 3");
      m.triangles.push_back({loop[0], loop[1], loop[2]});
      loop.clear();
    } else if (key == "endsolid") {
      ended = true;
    } else if (key != "facet" && key != "outer" && key != "endfacet" && key != "solid") {
      in.fail("unknown line in an ascii STL");
    }
  }
  if (!ended || !loop.empty()) in.fail("the file ends early: no 'endsolid'");
}

Vec3 facet_normal(const GeometryView& g, const Triangle& t) {
  const auto p = [&](int i) { return g.positions[static_cast<std::size_t>(t[static_cast<std::size_t>(i)])]; };
  const Vec3 n = (p(1) - p(0)).cross(p(2) - p(0));
  const double length = n.norm();
  return length > 0 && length <= kLargestNumber ? Vec3(n / length) : Vec3(Vec3::Zero());
}

}  // namespace

RawGeometry read_stl(const Source& source, ReadReport&) {
  RawGeometry out;
  out.kind = Geometry::Kind::Mesh;
  if (is_binary(source.bytes))
    read_binary(source, out.mesh);
  else
    read_text(source, out.mesh);
  return out;
}

void write_stl(AtomicFile& file, const GeometryView& g, const WriteOptions& options) {
  if (g.kind != Geometry::Kind::Mesh)
    throw InvalidInput("STL holds triangles; points without faces need PLY, OBJ, XYZ or CSV");
  if (options.text)
    file.write("solid meniscus\n");
  else
    file.write(std::string(kHeader, '\0'));  // must not start with "solid"
  const auto binary = [&](auto value) { file.write({reinterpret_cast<const char*>(&value), sizeof value}); };
  const auto numbers = [&](const Vec3& p) {
    for (int c = 0; c < 3; ++c) {
      if (options.text) {
        file.put(' ');
        file.number(static_cast<float>(p[c]));
      } else {
        binary(static_cast<float>(p[c]));
      }
    }
  };
  if (!options.text) binary(static_cast<std::uint32_t>(g.triangles.size()));
  for (const Triangle& t : g.triangles) {
    if (options.text) file.write("facet normal");
    numbers(facet_normal(g, t));
    if (options.text) file.write("\nouter loop\n");
    for (const std::int32_t v : t) {
      if (options.text) file.write("vertex");
      numbers(g.positions[static_cast<std::size_t>(v)]);
      if (options.text) file.put('\n');
    }
    if (options.text)
      file.write("endloop\nendfacet\n");
    else
      binary(std::uint16_t{0});
  }
  if (options.text) file.write("endsolid meniscus\n");
}

}  // namespace meniscus::io
