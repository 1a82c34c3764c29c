#include <meniscus/band/particle_attributes.h>
#include <meniscus/band/particle_cells.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <utility>

namespace meniscus::band {
namespace {

/// The particles about a point.
struct Near {
  std::vector<std::pair<std::size_t, double>> weights;  // row of the cloud, weight
  double total = 0;
  std::size_t heaviest = 0;
};

Near near_of(const Vec3& at, const ParticleFrame& particles, const ParticleCells& cells, double reach) {
  Near near;
  double most = 0;
  cells.for_runs(Box::around(at, 0), [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m) {
      const std::uint32_t p = cells.order()[m];
      const double q = 1 - (particles.state.position[p] - at).squaredNorm() / (reach * reach);
      if (q <= 0) continue;
      const double w = q * q * q;
      near.total += w;
      near.weights.emplace_back(particles.source[p], w);
      if (w <= most) continue;
      most = w;
      near.heaviest = particles.source[p];
    }
  });
  return near;
}

}  // namespace

Attributes carried_attributes(const Attributes& attributes, const ParticleFrame& particles, double reach,
                              std::span<const Vec3> at, const std::vector<std::string>& leave_out, const RunControl& run) {
  Attributes out;
  std::vector<const Attribute*> wanted;
  for (const Attribute& a : attributes)
    if (std::find(leave_out.begin(), leave_out.end(), a.name) == leave_out.end()) wanted.push_back(&a);
  if (wanted.empty()) return out;
  const ParticleCells cells(particles.state.position, reach);
  std::vector<std::vector<double>> means;
  std::vector<std::vector<std::int64_t>> picks;
  for (const Attribute* a : wanted) {
    means.emplace_back(a->is_integer() ? 0 : at.size() * a->components);
    picks.emplace_back(a->is_integer() ? at.size() * a->components : 0);
  }
  parallel_for(at.size(), 128, run, [&](std::size_t i) {
    const Near near = near_of(at[i], particles, cells, reach);
    if (near.weights.empty()) return;
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      const std::size_t n = wanted[k]->components;
      for (std::size_t c = 0; c < n; ++c) {
        if (wanted[k]->is_integer()) {
          picks[k][i * n + c] = std::get<1>(wanted[k]->data)[near.heaviest * n + c];
        } else {
          double sum = 0;
          for (const auto& [row, w] : near.weights) sum += w * std::get<0>(wanted[k]->data)[row * n + c];
          means[k][i * n + c] = sum / near.total;
        }
      }
    }
  });
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    if (wanted[k]->is_integer())
      out.set_integers(wanted[k]->name, wanted[k]->components, std::move(picks[k]));
    else
      out.set(wanted[k]->name, wanted[k]->components, std::move(means[k]));
  }
  return out;
}

}  // namespace meniscus::band
