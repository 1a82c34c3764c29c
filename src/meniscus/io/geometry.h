#pragma once

#include <meniscus/mesh/mesh.h>
#include <meniscus/points/cloud.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace meniscus::io {

class FileCalls;

/// What a file holds: a triangle mesh, or points without faces.
struct Geometry {
  enum class Kind { Cloud, Mesh };
  Kind kind = Kind::Cloud;
  points::Cloud cloud;  ///< filled when kind is Cloud
  mesh::Mesh mesh;      ///< filled when kind is Mesh
};

/// Something a reader noticed and went on.
struct Warning {
  std::string code;     ///< stable and short: "dropped-points", "ignored-cells", …
  std::string message;  ///< one sentence
  std::string where;    ///< path
};

/// What happened while reading, for reports.
struct ReadReport {
  std::string format;             ///< "ply", "vtk", …
  std::size_t dropped = 0;        ///< points left out because a number was not finite or beyond 1e18
  std::vector<Warning> warnings;  ///< at most one a code
};

struct ReadOptions {
  std::size_t frame = 0;                    ///< which time step of a file that holds several; others ignore it
  std::uint64_t memory_limit = 8ull << 30;  ///< bytes of file, after inflating; beyond: ResourceLimit
  std::optional<std::string> format;        ///< "ply", "vtk", …; when not given: by extension, then by content
};

/// Width of the floating-point numbers in a written file.
enum class Precision { Float32, Float64 };

struct WriteOptions {
  bool overwrite = false;              ///< replace an existing file; otherwise that is an IoError of kind Write
  bool text = false;                   ///< the readable variant of a format that also has a binary one
  std::optional<Precision> precision;  ///< when not given: double for clouds, float for meshes. OBJ and CSV keep all digits.
  std::vector<std::string> comments;   ///< lines for the header where the format has room (the command line, say)
  double frames_per_second = 24;       ///< for `.usda`, whose time codes are frames
  FileCalls* calls = nullptr;          ///< the operating system, or a test's stand-in for it
};

/// Reads a mesh or a cloud: PLY, OBJ, STL, OFF, XYZ, CSV, legacy VTK, VTP, VTU, classic BGEO, LAMMPS dump, the
/// points of MSURF; gzip is seen through. `path` "-" is standard input. The format follows from the extension, or the
/// content when that says nothing.
///
/// Names of attributes become the canonical ones (base/attributes.h); unknown ones ride along. Faces become triangles (a fan
/// about the first corner). Points of a cloud with a number that is not finite, or beyond 1e18 in size, are dropped and
/// counted; in a mesh such a vertex is an error if a face uses it and dropped otherwise; other attributes of a mesh with
/// such numbers are left out with a warning. Throws IoError with line or byte for a file that is not what it claims to be,
/// ResourceLimit beyond the memory limit. Cost: linear; the file and its numbers as doubles are in memory at once.
Geometry read_geometry(const std::string& path, const ReadOptions& options = {}, ReadReport* report = nullptr);

/// The same for bytes already in memory (plain or gzip); `path` names them in errors and tells the format.
Geometry read_geometry_bytes(const std::string& path, std::string_view bytes, const ReadOptions& options = {},
                             ReadReport* report = nullptr);

/// A file that must hold faces; IoError if it holds points alone.
mesh::Mesh read_mesh(const std::string& path, const ReadOptions& options = {}, ReadReport* report = nullptr);

/// The points of a file, or the vertices of its mesh.
points::Cloud read_cloud(const std::string& path, const ReadOptions& options = {}, ReadReport* report = nullptr);

/// Number of time steps in the file: 1, except for LAMMPS dumps.
std::size_t count_frames(const std::string& path, const ReadOptions& options = {});

/// Writes PLY, OBJ, STL, VTP, USDA, XYZ or CSV by extension; "-" is standard output (PLY). The file appears whole or not at
/// all: see atomic_file.h. XYZ, CSV and STL hold less than the mesh does (vertices, or triangles alone). Throws InvalidInput
/// for an inconsistent mesh or a number that is not finite (nothing is written then), IoError of kind Write when the file
/// exists or the system refuses.
void write_mesh(const std::string& path, const mesh::Mesh& mesh, const WriteOptions& options = {});

/// The same for points; STL has no place for them (InvalidInput).
void write_cloud(const std::string& path, const points::Cloud& cloud, const WriteOptions& options = {});

/// Mesh or cloud, whatever it holds.
void write_geometry(const std::string& path, const Geometry& geometry, const WriteOptions& options = {});

/// Lower-case extension without the dot and without a final ".gz": "a/B.PLY.gz" -> "ply".
std::string format_of_path(std::string_view path);

/// The same for an input that may be standard input ("-"): of that "json", "vdb" or "msurf" by its content, otherwise "",
/// which read_geometry understands.
std::string format_of_input(const std::string& path);

}  // namespace meniscus::io
