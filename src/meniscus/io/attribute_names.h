#pragma once

#include <meniscus/base/attributes.h>
#include <meniscus/base/vec.h>

#include <string>
#include <string_view>
#include <vector>

namespace meniscus::io {

/// How the numbers of an array were stored; decides whether colours are scaled and whether integers stay integers.
enum class NumberType { Int8, UInt8, Int16, UInt16, Int32, UInt32, Int64, UInt64, Float32, Float64 };

std::size_t size_of(NumberType type);
bool is_integer(NumberType type);

/// The canonical name for a file's array name and width ("velocity" with 3 -> "v"), or the name itself.
std::string canonical_name(std::string_view name, std::size_t components);

/// The word other programs use: "v" -> "velocity", "pscale" -> "radius", "N" -> "Normals", "Cd" -> "Color"; others
/// unchanged.
std::string exchange_name(std::string_view canonical);

/// Adds an array under its canonical name: 8- and 16-bit colours become [0, 1], identities become integers, integer arrays
/// stay integers (all else is double). A second array of the same canonical name keeps its own.
void add_attribute(Attributes& attributes, std::string_view name, std::size_t components, std::vector<double> values,
                   NumberType type);
void add_attribute(Attributes& attributes, std::string_view name, std::size_t components, std::vector<std::int64_t> values,
                   NumberType type);

/// A single column of a table ("nx", "red", "velocity_y", "density"), as PLY, CSV and LAMMPS files have them.
struct Column {
  std::string name;
  NumberType type = NumberType::Float64;
  std::vector<double> values;          ///< for floating-point types
  std::vector<std::int64_t> integers;  ///< for integer types
};

/// Gathers columns into vectors (x y z -> positions; nx ny nz, vx vy vz, red green blue, NAME_x NAME_y NAME_z, NAME_0 NAME_1
/// …) and adds them under canonical names. Returns false when there is no complete x, y, z.
bool add_columns(std::vector<Column> columns, std::vector<Vec3>& positions, Attributes& attributes);

/// Whether a table's column names include x, y and z.
bool has_position_columns(const std::vector<Column>& columns);

/// The inverse: names for the components of an attribute in a table ("v" -> "velocity_x" …, "N" -> "nx" …, "Cd" -> "red" …).
std::vector<std::string> column_names(const Attribute& attribute);

/// A name with everything but letters, digits and "_.:-" replaced by "_"; never empty.
std::string safe_name(std::string_view name);

}  // namespace meniscus::io
