#include <meniscus/io/vdb.h>
#include <meniscus/scene/write_band.h>

#include <cmath>

namespace meniscus::scene {

void write_band(const std::string& path, const band::Band& band, const VelocityAt* velocity, const io::WriteOptions& write) {
  if (velocity == nullptr) return io::write_vdb(path, band.grid(), write);
  std::vector<Vec3> at;
  std::vector<std::size_t> node;
  for (std::size_t n = 0; n < band.values().size(); ++n)
    if (std::abs(band.values()[n]) < band.background()) {
      const int i = static_cast<int>(n % band::Band::kBrickNodes);
      at.push_back(band.position(n / band::Band::kBrickNodes, i >> 6, i >> 3 & 7, i & 7));
      node.push_back(n);
    }
  const std::vector<Vec3> v = (*velocity)(at);
  std::vector<Vec3> samples(band.values().size(), Vec3::Zero());
  for (std::size_t i = 0; i < v.size(); ++i) samples[node[i]] = v[i];
  io::write_vdb(path, band.grid(), samples, write);
}

}  // namespace meniscus::scene
