#include <meniscus/io/attribute_names.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace meniscus::io {
namespace {

struct Alias {
  std::string_view file;
  std::string_view canonical;
  std::size_t components;
};

constexpr std::array kAliases = {
    Alias{"velocity", attribute::kVelocity, 3},
    Alias{"vel", attribute::kVelocity, 3},
    Alias{"velocities", attribute::kVelocity, 3},
    Alias{"Velocity", attribute::kVelocity, 3},
    Alias{"Normals", attribute::kNormal, 3},
    Alias{"normal", attribute::kNormal, 3},
    Alias{"normals", attribute::kNormal, 3},
    Alias{"Normal", attribute::kNormal, 3},
    Alias{"Color", attribute::kColor, 3},
    Alias{"color", attribute::kColor, 3},
    Alias{"colour", attribute::kColor, 3},
    Alias{"displayColor", attribute::kColor, 3},
    Alias{"radius", attribute::kRadius, 1},
    Alias{"rad", attribute::kRadius, 1},
    Alias{"Radius", attribute::kRadius, 1},
    Alias{"ID", attribute::kId, 1},
    Alias{"Id", attribute::kId, 1},
    Alias{"particleId", attribute::kId, 1},
    Alias{"ids", attribute::kId, 1},
};

/// Columns that make a vector under a name of their own.
struct VectorColumns {
  std::array<std::string_view, 3> columns;
  std::string_view name;
};

constexpr std::array kVectorColumns = {
    VectorColumns{{"nx", "ny", "nz"}, attribute::kNormal},
    VectorColumns{{"vx", "vy", "vz"}, attribute::kVelocity},
    VectorColumns{{"red", "green", "blue"}, attribute::kColor},
    VectorColumns{{"r", "g", "b"}, attribute::kColor},
};

/// Integers of a double array, if all are whole and fit exactly.
std::optional<std::vector<std::int64_t>> whole_numbers(const std::vector<double>& values) {
  constexpr double kExact = 9007199254740992.0;  // 2^53
  std::vector<std::int64_t> out(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!(std::abs(values[i]) <= kExact) || values[i] != std::floor(values[i])) return std::nullopt;
    out[i] = static_cast<std::int64_t>(values[i]);
  }
  return out;
}

std::vector<double> to_doubles(const std::vector<std::int64_t>& values, double scale = 1) {
  std::vector<double> out(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) out[i] = static_cast<double>(values[i]) * scale;
  return out;
}

/// Canonical names are given out once; a second array keeps its own name, made different if that is taken too.
std::string free_name(const Attributes& attributes, std::string_view name, std::size_t components) {
  std::string wanted = canonical_name(name, components);
  if (attributes.has(wanted)) wanted = name;
  while (attributes.has(wanted)) wanted += '_';
  return wanted;
}

std::vector<double> column_values(Column& column) {
  return is_integer(column.type) ? to_doubles(column.integers) : std::move(column.values);
}

template <class T>
std::vector<T> interleave(const std::vector<std::vector<T>>& parts) {
  const std::size_t width = parts.size(), rows = parts.front().size();
  std::vector<T> out(width * rows);
  for (std::size_t c = 0; c < width; ++c)
    for (std::size_t i = 0; i < rows; ++i) out[i * width + c] = parts[c][i];
  return out;
}

/// Adds the columns [begin, end) as one attribute of that many components.
void add_vector(std::vector<Column>& columns, std::span<const std::size_t> which, std::string_view name,
                Attributes& attributes) {
  const NumberType type = columns[which.front()].type;
  const bool integers = std::all_of(which.begin(), which.end(), [&](std::size_t i) { return is_integer(columns[i].type); });
  if (integers) {
    std::vector<std::vector<std::int64_t>> parts;
    for (const std::size_t i : which) parts.push_back(std::move(columns[i].integers));
    add_attribute(attributes, name, which.size(), interleave(parts), type);
  } else {
    std::vector<std::vector<double>> parts;
    for (const std::size_t i : which) parts.push_back(column_values(columns[i]));
    add_attribute(attributes, name, which.size(), interleave(parts), is_integer(type) ? NumberType::Float64 : type);
  }
}

std::optional<std::size_t> find_column(const std::vector<Column>& columns, std::string_view name) {
  for (std::size_t i = 0; i < columns.size(); ++i)
    if (columns[i].name == name) return i;
  return std::nullopt;
}

/// How many columns from `first` on are NAME_x NAME_y NAME_z, or NAME_0 NAME_1 …; sets `name`.
std::size_t suffix_run(const std::vector<Column>& columns, std::size_t first, std::string& name) {
  const std::string& head = columns[first].name;
  const std::size_t bar = head.rfind('_');
  if (bar == head.npos || bar == 0) return 1;
  name = head.substr(0, bar);
  const std::string suffix = head.substr(bar + 1);
  if (suffix != "x" && suffix != "0") return 1;
  std::size_t n = 1;
  for (; first + n < columns.size(); ++n) {
    if (suffix == "x" && n == 3) break;
    const std::string wanted = suffix == "x" ? std::string(1, "xyz"[n]) : std::to_string(n);
    if (columns[first + n].name != name + "_" + wanted) break;
  }
  return suffix == "x" && n != 3 ? 1 : n;
}

}  // namespace

std::size_t size_of(NumberType type) {
  switch (type) {
    case NumberType::Int8:
    case NumberType::UInt8: return 1;
    case NumberType::Int16:
    case NumberType::UInt16: return 2;
    case NumberType::Int32:
    case NumberType::UInt32:
    case NumberType::Float32: return 4;
    case NumberType::Int64:
    case NumberType::UInt64:
    case NumberType::Float64: break;
  }
  return 8;
}

bool is_integer(NumberType type) { return type != NumberType::Float32 && type != NumberType::Float64; }

std::string canonical_name(std::string_view name, std::size_t components) {
  for (const Alias& alias : kAliases)
    if (alias.file == name && alias.components == components) return std::string(alias.canonical);
  return std::string(name);
}

std::string exchange_name(std::string_view canonical) {
  if (canonical == attribute::kVelocity) return "velocity";
  if (canonical == attribute::kNormal) return "Normals";
  if (canonical == attribute::kColor) return "Color";
  if (canonical == attribute::kRadius) return "radius";
  return std::string(canonical);
}

void add_attribute(Attributes& attributes, std::string_view name, std::size_t components, std::vector<double> values,
                   NumberType) {
  const std::string own = free_name(attributes, name, components);
  if (own == attribute::kId) {
    if (auto whole = whole_numbers(values)) {
      attributes.set_integers(own, components, std::move(*whole));
      return;
    }
  }
  attributes.set(own, components, std::move(values));
}

void add_attribute(Attributes& attributes, std::string_view name, std::size_t components, std::vector<std::int64_t> values,
                   NumberType type) {
  const std::string own = free_name(attributes, name, components);
  const bool real = own == attribute::kNormal || own == attribute::kVelocity || own == attribute::kRadius;
  if (own == attribute::kColor) {
    const double scale = type == NumberType::UInt8 ? 1 / 255.0 : type == NumberType::UInt16 ? 1 / 65535.0 : 1;
    attributes.set(own, components, to_doubles(values, scale));
  } else if (real) {
    attributes.set(own, components, to_doubles(values));
  } else {
    attributes.set_integers(own, components, std::move(values));
  }
}

bool has_position_columns(const std::vector<Column>& columns) {
  return find_column(columns, "x") && find_column(columns, "y") && find_column(columns, "z");
}

bool add_columns(std::vector<Column> columns, std::vector<Vec3>& positions, Attributes& attributes) {
  if (!has_position_columns(columns)) return false;
  std::vector<bool> used(columns.size(), false);
  std::array<std::vector<double>, 3> xyz;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::size_t i = *find_column(columns, std::string_view("xyz").substr(c, 1));
    xyz[c] = column_values(columns[i]);
    used[i] = true;
  }
  positions.resize(xyz[0].size());
  for (std::size_t i = 0; i < positions.size(); ++i) positions[i] = Vec3(xyz[0][i], xyz[1][i], xyz[2][i]);

  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (used[i]) continue;
    std::vector<std::size_t> which = {i};
    std::string name = columns[i].name;
    for (const VectorColumns& v : kVectorColumns) {
      if (v.columns[0] != columns[i].name) continue;
      const auto second = find_column(columns, v.columns[1]), third = find_column(columns, v.columns[2]);
      if (!second || !third || used[*second] || used[*third]) continue;
      which = {i, *second, *third};
      name = v.name;
    }
    if (which.size() == 1) {
      std::string stem;
      const std::size_t n = suffix_run(columns, i, stem);
      if (n > 1) {
        name = stem;
        for (std::size_t k = 1; k < n; ++k) which.push_back(i + k);
      }
    }
    for (const std::size_t k : which) used[k] = true;
    add_vector(columns, which, name, attributes);
  }
  return true;
}

std::vector<std::string> column_names(const Attribute& attribute) {
  if (attribute.components == 3 && attribute.name == attribute::kNormal) return {"nx", "ny", "nz"};
  if (attribute.components == 3 && attribute.name == attribute::kColor) return {"red", "green", "blue"};
  const std::string stem = safe_name(exchange_name(attribute.name));
  if (attribute.components == 1) return {stem};
  std::vector<std::string> names;
  for (std::size_t c = 0; c < attribute.components; ++c)
    names.push_back(stem + "_" + (attribute.components == 3 ? std::string(1, "xyz"[c]) : std::to_string(c)));
  return names;
}

std::string safe_name(std::string_view name) {
  std::string out;
  for (const char c : name) {
    const bool keep = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.' ||
                      c == ':' || c == '-';
    out += keep ? c : '_';
  }
  return out.empty() ? "_" : out;
}

}  // namespace meniscus::io
