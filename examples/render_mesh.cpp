// Builds a torus and takes its picture.
#include <meniscus/render/png.h>
#include <meniscus/render/render.h>

#include <cmath>
#include <fstream>
#include <numbers>

namespace {

meniscus::mesh::Mesh torus(int around, int across) {
  meniscus::mesh::Mesh mesh;
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const double a = 2 * std::numbers::pi * i / around;
      const double b = 2 * std::numbers::pi * j / across;
      const double ring = 1 + 0.4 * std::cos(b);
      mesh.positions.emplace_back(ring * std::cos(a), 0.4 * std::sin(b), ring * std::sin(a));
      const auto at = [&](int m, int n) { return (m % around) * across + n % across; };
      mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  }
  return mesh;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace meniscus;
  render::Scene scene;
  scene.meshes.push_back({.mesh = torus(120, 60)});
  const render::Image image = render::render(scene, render::frame(scene));
  const auto png = render::encode_png(image, std::array{render::PngText{"Title", "a torus"}});
  std::ofstream(argc > 1 ? argv[1] : "torus.png", std::ios::binary)
      .write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
}
