#pragma once

// Bodies of the kernels, compiled once per processor family (see float8.h).
#include <meniscus/band/distance.kernel.h>
#include <meniscus/band/halo.kernel.h>
#include <meniscus/band/particles.kernel.h>
#include <meniscus/band/step.kernel.h>
#include <meniscus/band/surface.kernel.h>

namespace {

constexpr meniscus::band::Kernels kSet = {gather_body,       gather_star_body, centre_body,  outline_body, nearer_body,
                                          step_body,         extend_body,      eikonal_body, rescale_body, cut_cells_body,
                                          surface_part_body, averaged_body,    density_body};

}  // namespace
