#include <meniscus/io/atomic_file.h>
#include <meniscus/io/byte_cursor.h>
#include <meniscus/io/file_bytes.h>
#include <meniscus/io/msurf.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace meniscus::io {
namespace {

constexpr std::string_view kMagic = "msurf\r\n\x1a";
constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kLeaf = 0;  // node kinds; operations are 1 + their number
constexpr std::uint32_t kMostAttributes = 1000, kLongestName = 1000, kMostComponents = 1000;
constexpr double kUnit = 1e-6;  // of a normal's length

using Arrays = std::array<std::vector<double> pointset::PointSet::*, 11>;
constexpr Arrays kArrays = {&pointset::PointSet::x,     &pointset::PointSet::y,           &pointset::PointSet::z,
                            &pointset::PointSet::nx,    &pointset::PointSet::ny,          &pointset::PointSet::nz,
                            &pointset::PointSet::bx,    &pointset::PointSet::by,          &pointset::PointSet::bz,
                            &pointset::PointSet::reach, &pointset::PointSet::coefficients};

// ---- Reading ----

template <class T>
std::vector<T> read_array(ByteCursor& in, std::uint64_t count, std::string_view what) {
  in.require(count, sizeof(T), what);
  std::vector<T> values(count);
  for (T& v : values) v = in.read<T>();
  return values;
}

void require_finite(const std::vector<double>& values, const ByteCursor& in) {
  for (const double v : values)
    if (!(std::abs(v) <= kLargestNumber)) in.fail("a number is not finite or beyond 1e18");
}

void read_attributes(ByteCursor& in, std::uint64_t points, Attributes& out) {
  const auto count = in.read<std::uint32_t>();
  if (count > kMostAttributes) in.fail("declares " + std::to_string(count) + " attributes");
  for (std::uint32_t k = 0; k < count; ++k) {
    const auto length = in.read<std::uint32_t>();
    if (length == 0 || length > kLongestName) in.fail("an attribute's name has " + std::to_string(length) + " bytes");
    const std::string name(in.take(length));
    const auto components = in.read<std::uint32_t>(), integer = in.read<std::uint32_t>();
    if (components == 0 || components > kMostComponents)
      in.fail("attribute '" + name + "' has no sensible number of components");
    if (integer > 1) in.fail("attribute '" + name + "' is neither real nor integer");
    if (out.has(name)) in.fail("attribute '" + name + "' is there twice");
    if (integer == 1) {
      out.set_integers(name, components, read_array<std::int64_t>(in, points * components, "integers"));
    } else {
      auto values = read_array<double>(in, points * components, "numbers");
      require_finite(values, in);
      out.set(name, components, std::move(values));
    }
  }
}

pointset::PointSet read_set(ByteCursor& in) {
  pointset::PointSet set;
  const auto grid = in.read<std::uint32_t>();
  if (grid < 3 || grid > static_cast<std::uint32_t>(pointset::kMostGrid))
    in.fail("a local grid has " + std::to_string(grid) + " control points along an axis");
  set.grid = static_cast<int>(grid);
  const auto points = in.read<std::uint64_t>();
  const std::uint64_t numbers = kArrays.size() - 1 + set.coefficients_per_point();
  in.require(points, numbers * sizeof(double), "points");
  for (const auto array : kArrays) {
    const std::uint64_t each = array == &pointset::PointSet::coefficients ? set.coefficients_per_point() : 1;
    set.*array = read_array<double>(in, points * each, "numbers");
    require_finite(set.*array, in);
  }
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (!(set.reach[i] > 0)) in.fail("point " + std::to_string(i) + " has a domain of no size");
    if (!(std::abs(set.normal(i).norm() - 1) < kUnit))
      in.fail("the normal of point " + std::to_string(i) + " is no unit vector");
  }
  read_attributes(in, points, set.attributes);
  return set;
}

pointset::Solid read_solid(ByteCursor& in, int depth) {
  if (depth > pointset::kMostNesting) in.fail("nested more than " + std::to_string(pointset::kMostNesting) + " deep");
  pointset::Solid solid;
  const auto kind = in.read<std::uint32_t>();
  if (kind == kLeaf) {
    solid.set = read_set(in);
    return solid;
  }
  if (kind > 3) in.fail("a node of unknown kind " + std::to_string(kind));
  solid.operation = static_cast<pointset::Operation>(kind - 1);
  for (int i = 0; i < 2; ++i) solid.inputs.push_back(read_solid(in, depth + 1));
  return solid;
}

// ---- Writing ----

template <class T>
void put(AtomicFile& file, T value) {
  if constexpr (std::endian::native != std::endian::little) value = swap_bytes(value);
  file.write({reinterpret_cast<const char*>(&value), sizeof value});
}

template <class T>
void put_all(AtomicFile& file, const std::vector<T>& values) {
  for (const T v : values) put(file, v);
}

void write_attributes(AtomicFile& file, const Attributes& attributes) {
  put(file, static_cast<std::uint32_t>(std::distance(attributes.begin(), attributes.end())));
  for (const Attribute& a : attributes) {
    put(file, static_cast<std::uint32_t>(a.name.size()));
    file.write(a.name);
    put(file, static_cast<std::uint32_t>(a.components));
    put(file, static_cast<std::uint32_t>(a.is_integer() ? 1 : 0));
    std::visit([&](const auto& values) { put_all(file, values); }, a.data);
  }
}

void write_solid(AtomicFile& file, const pointset::Solid& solid) {
  if (solid.operation) {
    put(file, static_cast<std::uint32_t>(*solid.operation) + 1);
    for (const pointset::Solid& s : solid.inputs) write_solid(file, s);
    return;
  }
  put(file, kLeaf);
  put(file, static_cast<std::uint32_t>(solid.set.grid));
  put(file, static_cast<std::uint64_t>(solid.set.size()));
  for (const auto array : kArrays) put_all(file, solid.set.*array);
  write_attributes(file, solid.set.attributes);
}

void check(const pointset::Solid& solid, int depth) {
  if (depth > pointset::kMostNesting) throw InvalidInput("msurf: the solid is nested too deep");
  if (solid.operation) {
    if (solid.inputs.size() != 2) throw InvalidInput("msurf: an operation takes two inputs");
    for (const pointset::Solid& s : solid.inputs) check(s, depth + 1);
    return;
  }
  const pointset::PointSet& set = solid.set;
  for (const auto array : kArrays) {
    const std::size_t each = array == &pointset::PointSet::coefficients ? set.coefficients_per_point() : 1;
    if ((set.*array).size() != set.size() * each) throw InvalidInput("msurf: the point set's arrays differ in length");
    for (const double v : set.*array)
      if (!(std::abs(v) <= kLargestNumber)) throw InvalidInput("msurf: a number is not finite or beyond 1e18");
  }
  for (const Attribute& a : set.attributes)
    if (a.size() != set.size()) throw InvalidInput("msurf: attribute '" + a.name + "' has the wrong length");
}

}  // namespace

bool looks_like_msurf(std::string_view bytes) { return bytes.starts_with(kMagic); }

pointset::Solid read_msurf_bytes(const Source& source) {
  ByteCursor in(source.bytes, source.path, std::endian::little);
  if (!looks_like_msurf(source.bytes)) in.fail("not a point-set surface: it does not start with the mark of .msurf");
  in.take(kMagic.size());
  const auto version = in.read<std::uint32_t>();
  if (version != kVersion)
    in.fail("version " + std::to_string(version) + " of .msurf is not known; this program reads version " +
            std::to_string(kVersion));
  pointset::Solid solid = read_solid(in, 0);
  if (in.remaining() > 0) in.fail(std::to_string(in.remaining()) + " bytes too many");
  return solid;
}

pointset::Solid read_msurf(const std::string& path, const ReadOptions& options) {
  const std::string bytes = load_file(path, options.memory_limit);
  return read_msurf_bytes({path, bytes});
}

void write_msurf(const std::string& path, const pointset::Solid& solid, const WriteOptions& options) {
  check(solid, 0);
  AtomicFile file(path, options);
  file.write(kMagic);
  put(file, kVersion);
  write_solid(file, solid);
  file.commit();
}

RawGeometry read_msurf_points(const Source& source) {
  points::Cloud cloud = pointset::points_of(read_msurf_bytes(source));
  RawGeometry raw;
  raw.mesh.positions = std::move(cloud.positions);
  raw.mesh.attributes = std::move(cloud.attributes);
  return raw;
}

}  // namespace meniscus::io
