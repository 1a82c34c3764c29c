#pragma once

#include <meniscus/band/band.h>

#include <optional>
#include <vector>

namespace meniscus::band {

/// A connected part of the inside, as far as the band shows it (a closed cavity counts as a part with negative volume).
struct Component {
  double volume = 0;           ///< signed, world units cubed
  double area = 0;             ///< world units squared
  std::optional<double> goal;  ///< the volume it must hold, when somebody asks
};

/// Which component each inside node of the band belongs to. Numbers rise in the order of the bricks.
struct Labels {
  std::vector<std::int32_t> node;  ///< per node of the band; -1 outside and beyond the band
  std::size_t count = 0;
};

/// Finds the components by union-find over inside nodes (faces connect).
Labels label_components(const Band& band);

/// Volume and area of each component from the piecewise linear surface (six tetrahedra a cell), the error of which is
/// second order in the voxel.
std::vector<Component> measure_components(const Band& band, const Labels& labels, const RunControl& run = {});

/// Hands the goals of the components before to the components now. `before` are the labels that the nodes had (on the
/// present bricks). One to one: unchanged. Parts that have merged hold the sum; parts that have split share what is missing
/// by area. A part out of nowhere has no goal; a part that vanished takes its goal with it.
void inherit_goals(const Labels& before, const std::vector<Component>& old, const Labels& now,
                   std::vector<Component>& fresh);

}  // namespace meniscus::band
