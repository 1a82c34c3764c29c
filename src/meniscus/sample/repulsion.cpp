#include <meniscus/sample/repulsion.h>

#include <cmath>

namespace meniscus::sample {

Repulsion repulsion(const SurfacePoints& p, std::span<const double> sigma, double alpha, std::size_t i,
                    std::span<const std::uint32_t> neighbours) {
  const double xi = p.x[i], yi = p.y[i], zi = p.z[i], si2 = sigma[i] * sigma[i];
  const double reach2 = kRepulsionReach * kRepulsionReach;
  double px = 0, py = 0, pz = 0, energy = 0, moment = 0;
  for (const std::uint32_t j : neighbours) {
    const double dx = xi - p.x[j], dy = yi - p.y[j], dz = zi - p.z[j];
    const double r2 = dx * dx + dy * dy + dz * dz, sj2 = sigma[j] * sigma[j];
    if (r2 >= reach2 * (si2 > sj2 ? si2 : sj2)) continue;
    const double weight = alpha * same_sheet(p, i, j);
    const double own = weight * std::exp(-0.5 * r2 / si2);
    const double other = sj2 == si2 ? own : weight * std::exp(-0.5 * r2 / sj2);
    const double push = own + si2 / sj2 * other;
    px += push * dx;
    py += push * dy;
    pz += push * dz;
    energy += own;
    moment += r2 * own;
  }
  return {{px, py, pz}, energy, moment / (si2 * sigma[i])};
}

}  // namespace meniscus::sample
