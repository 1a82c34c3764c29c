#pragma once

#include <meniscus/io/geometry.h>

#include <span>

namespace meniscus::io {

/// The inflated bytes of a file and the name to blame in errors; what every reader takes.
struct Source {
  std::string path;
  std::string_view bytes;
};

/// What a reader hands back before the common checks (`finish`): everything as a mesh, with the kind beside it.
struct RawGeometry {
  mesh::Mesh mesh;
  Geometry::Kind kind = Geometry::Kind::Cloud;
};

/// What a writer sees of a mesh or a cloud.
struct GeometryView {
  std::span<const Vec3> positions;
  std::span<const Triangle> triangles;
  const Attributes& attributes;
  Geometry::Kind kind;
  Precision precision;
};

/// Adds a warning unless one of that code is already there.
void warn(ReadReport& report, std::string code, std::string message, const std::string& where);

/// Common checks after reading: consistent attributes, indices in range, finite numbers (policy: geometry.h).
Geometry finish(RawGeometry raw, const std::string& path, ReadReport& report);

/// Checks before writing; throws InvalidInput for ragged attributes, indices out of range, numbers that are not finite in
/// the precision asked for.
void check_writable(const GeometryView& geometry);

/// Largest size of a number in a position, velocity or radius that is taken seriously: its square still fits a float.
inline constexpr double kLargestNumber = 1e18;

}  // namespace meniscus::io
