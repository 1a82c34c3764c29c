#pragma once

#include <meniscus/io/geometry.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <unistd.h>

namespace meniscus::io {

/// A folder of its own for a test, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    static int serial = 0;
    path_ = std::filesystem::temp_directory_path() /
            ("meniscus-io-" + std::to_string(::getpid()) + "-" + std::to_string(serial++));
    std::filesystem::create_directories(path_);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }

  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  std::size_t entries() const {
    std::size_t n = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(path_)) ++n;
    return n;
  }

 private:
  std::filesystem::path path_;
};

inline std::string file_content(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

inline void put_file(const std::string& path, const std::string& content) {
  std::ofstream(path, std::ios::binary) << content;
}

/// The same bytes in the other order, for building big-endian files.
template <class T>
std::string big_endian(T value) {
  const char* bytes = reinterpret_cast<const char*>(&value);
  return {std::make_reverse_iterator(bytes + sizeof value), std::make_reverse_iterator(bytes)};
}
template <class T>
std::string little_endian(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

inline std::string data_file(const std::string& name) { return MENISCUS_SOURCE_DIR "/../shared/data/" + name; }

/// A tetrahedron with every canonical attribute and a few unknown ones; awkward digits on purpose.
inline mesh::Mesh sample_mesh() {
  mesh::Mesh m;
  m.positions = {Vec3(0.1, 0, 0), Vec3(1.0 / 3, 0, 1e-7), Vec3(0, 12345.678901234567, 0), Vec3(0, 0, -2.5e-3)};
  m.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  m.attributes.set(attribute::kNormal, 3, {1, 0, 0, 0, 1, 0, 0, 0, 1, -1, 0, 0});
  m.attributes.set(attribute::kVelocity, 3, {0.1, 0.2, 0.3, 1, 2, 3, -1, -2, -3, 1e-9, 0, 1e9});
  m.attributes.set(attribute::kColor, 3, {0, 0.25, 1, 0.5, 0.5, 0.5, 0.1, 0.7, 0.3, 1, 1, 1});
  m.attributes.set(attribute::kRadius, 1, {0.1, 0.2, 0.3, 0.4});
  m.attributes.set_integers(attribute::kId, 1, {7, 3, 2147483647, 0});
  m.attributes.set("density", 1, {1000.1, 999.9, 1e-30, 0.1});
  m.attributes.set("uv", 2, {0, 0, 0, 1, 1, 0, 0.3, 0.7});
  m.attributes.set_integers("piece", 1, {-1, 0, 1, 2});
  return m;
}

inline points::Cloud sample_cloud() {
  const mesh::Mesh m = sample_mesh();
  return {m.positions, m.attributes};
}

/// Rounds every floating-point number to float, as a file in single precision does.
inline mesh::Mesh in_single_precision(mesh::Mesh m) {
  const auto round = [](double& x) { x = static_cast<double>(static_cast<float>(x)); };
  for (Vec3& p : m.positions)
    for (int c = 0; c < 3; ++c) round(p[c]);
  std::vector<Attribute> list(m.attributes.begin(), m.attributes.end());
  for (Attribute& a : list)
    if (!a.is_integer()) {
      auto values = std::get<0>(a.data);
      for (double& x : values) round(x);
      m.attributes.set(a.name, a.components, values);
    }
  return m;
}

/// Empty when both hold the same attributes with the same bits; otherwise the first difference.
inline std::string difference(const Attributes& a, const Attributes& b) {
  for (const Attribute& x : a) {
    const Attribute* y = b.find(x.name);
    if (y == nullptr) return x.name + " is missing";
    if (y->components != x.components) return x.name + " has other components";
    if (y->data != x.data) return x.name + " has other values";
  }
  for (const Attribute& y : b)
    if (!a.has(y.name)) return y.name + " is new";
  return {};
}

}  // namespace meniscus::io
