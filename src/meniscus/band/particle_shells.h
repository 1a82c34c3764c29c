#pragma once

#include <meniscus/band/evolver.h>
#include <meniscus/band/particle_surface.h>

#include <vector>

namespace meniscus::band {

/// Signed distance of every particle from the skin, at most four voxels either way; negative where it is covered.
std::vector<double> depth_of_particles(const Band& skin, const ParticleSurface& particles, const RunControl& run = {});

/// How free of the skin every particle is, 0 to 1: 0 when the skin covers its centre or it touches, from sphere to sphere, a
/// particle that is covered; 1 when the group it belongs to is a particle radius or more away from those.
std::vector<double> freedom_of_particles(const ParticleSurface& particles, std::span<const double> depth,
                                         const RunControl& run = {});

/// The particles, by number and in order, that begin a piece of their own: wholly free of the skin (freedom 1), in a group
/// of a volume of at least `least`, world units cubed.
std::vector<std::uint32_t> particles_of_new_pieces(const ParticleSurface& particles, std::span<const double> depth,
                                                   double least, const RunControl& run = {});

/// Keeps droplets that are too small for the skin's tension: groups of particles that the skin has left altogether stand on
/// their own again, as the surface of their particles. They grow and fade with their freedom and their weight, so that
/// nothing jumps when a droplet leaves the body or comes to it.
void keep_droplets(Evolver& skin, const ParticleSurface& particles, const RunControl& run = {});

/// The lower bound of a skin: afterwards spheres of `inner` radii about all particles lie within it. `inner` in (0, 1].
void keep_covered(Evolver& skin, const ParticleSurface& particles, double inner, const RunControl& run = {});

/// The upper bound of a skin: afterwards it lies within spheres of `outer` radii about the particles. `outer` > 0.
void confine(Evolver& skin, const ParticleSurface& particles, double outer, const RunControl& run = {});

}  // namespace meniscus::band
