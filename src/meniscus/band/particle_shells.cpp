#include <meniscus/band/particle_shells.h>
#include <meniscus/base/disjoint_sets.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace meniscus::band {
namespace {

/// Particles of `from` as spheres of their own.
struct Spheres {
  ParticleState state;
  void add(const ParticleSurface& from, std::size_t i, double radius) {
    state.position.push_back(from.positions()[i]);
    state.radius.push_back(radius);
    state.velocity.push_back(Vec3::Zero());
    state.weight.push_back(1);
  }
  /// Blobs: means of averaged particles make specks between loose ones.
  ParticleSurface surface(const RunControl& run) const { return {state, {.kernel = ParticleKernel::Blobs}, run}; }
};

/// Bricks of the band within `reach` of the particles.
std::vector<std::size_t> bricks_near(const Band& band, const ParticleState& particles, double reach) {
  std::vector<std::size_t> out;
  const double side = 8 * band.voxel();
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Box box = Box::around(particles.position[i] - band.origin(), particles.radius[i] + reach);
    const Vec3 low = (box.min / side).array().floor(), high = (box.max / side).array().floor();
    const auto whole = [](double v) { return static_cast<std::int32_t>(std::clamp(v, -1e9, 1e9)); };
    for (std::int32_t x = whole(low.x()); x <= whole(high.x()); ++x)
      for (std::int32_t y = whole(low.y()); y <= whole(high.y()); ++y)
        for (std::int32_t z = whole(low.z()); z <= whole(high.z()); ++z)
          if (const std::int32_t b = band.find({x, y, z}); b >= 0) out.push_back(static_cast<std::size_t>(b));
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

/// Gives every sample of the bricks what `rule` makes of it and of its distance from the spheres.
template <class Rule>
void reshape(Band& band, const std::vector<std::size_t>& bricks, const ParticleSurface& spheres, double scale,
             const RunControl& run, const Rule& rule) {
  const double reach = static_cast<double>(band.background());
  const RunControl alone({.threads = 1, .seed = 0, .on_progress = {}});  // bricks are worked on side by side as it is
  parallel_for(bricks.size(), 4, run, [&](std::size_t n) {
    field::PositionBatch x(Band::kBrickNodes);
    for (int i = 0; i < 512; ++i) x.set(static_cast<std::size_t>(i), band.position(bricks[n], i >> 6, i >> 3 & 7, i & 7));
    std::vector<double> d(Band::kBrickNodes);
    spheres.sphere_distance(x.view(), scale, reach, d, alone);
    const auto part = band.values().subspan(bricks[n] * Band::kBrickNodes, Band::kBrickNodes);
    for (std::size_t i = 0; i < d.size(); ++i) part[i] = rule(part[i], static_cast<float>(std::max(d[i], -reach)));
  });
}

/// Calls work(j, gap between their spheres) for every particle j whose centre's cell lies within reach of i.
template <class Work>
void for_near(const ParticleSurface& particles, std::uint32_t i, const Work& work) {
  const std::vector<Vec3>& x = particles.positions();
  const std::vector<double>& r = particles.radii();
  particles.cells().for_runs(Box::around(x[i], r[i]), [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m)
      if (const std::uint32_t j = particles.cells().order()[m]; j != i) work(j, (x[i] - x[j]).norm() - r[i] - r[j]);
  });
}

/// Particles that the skin does not cover; those that touch, sphere to sphere, are of one group.
struct OpenGroups {
  std::vector<std::uint32_t> members;
  DisjointSets groups;
  std::vector<double> gap;  ///< of a group, at its root: to the nearest covered particle, radii, at most 1

  OpenGroups(const ParticleSurface& particles, std::span<const double> depth, const RunControl& run)
      : groups(depth.size()), gap(depth.size(), 1) {
    for (std::size_t i = 0; i < depth.size(); ++i)
      if (depth[i] > 0) members.push_back(static_cast<std::uint32_t>(i));
    std::vector<std::vector<std::uint32_t>> touching(members.size());
    parallel_for(members.size(), 16, run, [&](std::size_t n) {
      const std::uint32_t i = members[n];
      for_near(particles, i, [&](std::uint32_t j, double between) {
        if (depth[j] <= 0)
          gap[i] = std::min(gap[i], std::max(between / particles.radii()[i], 0.0));
        else if (between <= 0)
          touching[n].push_back(j);
      });
    });
    for (std::size_t n = 0; n < members.size(); ++n)
      for (const std::uint32_t j : touching[n]) groups.join(members[n], j);
    for (const std::uint32_t i : members) gap[groups.root(i)] = std::min(gap[groups.root(i)], gap[i]);
  }

  double freedom(std::uint32_t member) {
    const double g = gap[groups.root(member)];
    return g * g * (3 - 2 * g);
  }
};

}  // namespace

std::vector<double> depth_of_particles(const Band& skin, const ParticleSurface& particles, const RunControl& run) {
  const field::Grid grid = skin.grid();
  std::vector<double> out(particles.positions().size());
  parallel_for(out.size(), 256, run, [&](std::size_t i) {
    const Vec3& p = particles.positions()[i];
    const Vec3 c = ((p - skin.origin()) / skin.voxel()).array().round();
    const auto at = [&](int a) { return static_cast<std::int32_t>(std::clamp(c[a], -1e9, 1e9)); };
    const float nearest = grid.value({at(0), at(1), at(2)});
    out[i] = std::abs(nearest) < skin.background() ? skin.sample(p) : static_cast<double>(nearest);
  });
  return out;
}

std::vector<double> freedom_of_particles(const ParticleSurface& particles, std::span<const double> depth,
                                         const RunControl& run) {
  OpenGroups open(particles, depth, run);
  std::vector<double> out(depth.size(), 0);
  for (const std::uint32_t i : open.members) out[i] = open.freedom(i);
  return out;
}

std::vector<std::uint32_t> particles_of_new_pieces(const ParticleSurface& particles, std::span<const double> depth,
                                                   double least, const RunControl& run) {
  OpenGroups open(particles, depth, run);
  std::vector<double> volume(depth.size(), 0);
  for (const std::uint32_t i : open.members)
    volume[open.groups.root(i)] += 4 * std::numbers::pi / 3 * particles.weights()[i] * std::pow(particles.radii()[i], 3);
  std::vector<std::uint32_t> out;
  for (const std::uint32_t i : open.members)
    if (open.freedom(i) == 1 && volume[open.groups.root(i)] >= least) out.push_back(i);
  return out;
}

void keep_droplets(Evolver& skin, const ParticleSurface& particles, const RunControl& run) {
  const std::vector<double> depth = depth_of_particles(skin.band(), particles, run);
  const std::vector<double> freedom = freedom_of_particles(particles, depth, run);
  Spheres loose;
  for (std::size_t i = 0; i < freedom.size(); ++i) {
    const double radius = particles.radii()[i] * std::cbrt(freedom[i] * particles.weights()[i]);
    if (radius > 0.5 * skin.band().voxel()) loose.add(particles, i, radius);  // a smaller one would flicker between samples
  }
  if (loose.state.size() == 0) return;
  const Band droplets = loose.surface(run).band(skin.band().voxel(), std::size_t{1} << 20, run);
  skin.edit([&](Band& b) { b.unite(droplets); }, run);
}

void keep_covered(Evolver& skin, const ParticleSurface& particles, double inner, const RunControl& run) {
  const std::vector<double> depth = depth_of_particles(skin.band(), particles, run);
  Spheres bare;
  for (std::size_t i = 0; i < depth.size(); ++i)
    if (depth[i] > -inner * particles.radii()[i]) bare.add(particles, i, inner * particles.radii()[i]);
  if (bare.state.size() == 0) return;
  skin.edit(
      [&](Band& b) {
        const ParticleSurface spheres = bare.surface(run);
        if (b.empty()) b = spheres.band(b.voxel(), std::size_t{1} << 20, run);
        reshape(b, bricks_near(b, bare.state, 2 * b.voxel()), spheres, 1, run,
                [](float own, float sphere) { return std::min(own, sphere); });
      },
      run);
}

void confine(Evolver& skin, const ParticleSurface& particles, double outer, const RunControl& run) {
  Crossings crossings;
  find_crossings(skin.band(), false, crossings, run);
  const std::vector<char> covered = particles.covers(crossings.x.view(), outer, run);
  ParticleState out;  // where the skin has left its bound
  for (std::size_t i = 0; i < covered.size(); ++i)
    if (covered[i] == 0) {
      out.position.push_back(crossings.x.view()[i]);
      out.radius.push_back(0);
    }
  if (out.size() == 0) return;
  skin.edit(
      [&](Band& b) {
        reshape(b, bricks_near(b, out, 2 * b.voxel()), particles, outer, run,
                [](float own, float sphere) { return std::max(own, sphere); });
      },
      run);
}

}  // namespace meniscus::band
