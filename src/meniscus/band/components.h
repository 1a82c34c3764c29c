#pragma once

#include <meniscus/band/band.h>
#include <meniscus/band/kernels.h>

#include <optional>
#include <vector>

namespace meniscus::band {

/// A connected part of the inside, as far as the band shows it (a closed cavity counts as a part with negative volume).
struct Component {
  double volume = 0;           ///< signed, world units cubed
  double area = 0;             ///< world units squared
  std::optional<double> goal;  ///< the volume it must hold, when somebody asks
};

/// Which component the inside nodes of the band belong to. Numbers rise in the order of the bricks.
struct Labels {
  /// Nodes of one brick that hang together within it.
  struct Piece {
    NodeBits nodes;
    std::int32_t label;
  };
  std::vector<Piece> pieces;       ///< in the order of the bricks
  std::vector<std::size_t> begin;  ///< pieces of brick b: [begin[b], begin[b + 1])
  std::size_t count = 0;           ///< of components

  /// Of node n of a brick; -1 outside and beyond the band.
  std::int32_t of(std::size_t brick, std::size_t n) const {
    for (std::size_t p = begin[brick]; p < begin[brick + 1]; ++p)
      if ((pieces[p].nodes[n / 64] >> n % 64 & 1) != 0) return pieces[p].label;
    return -1;
  }
  /// After Band::adapt(): pieces follow their bricks; woken ones have none.
  void remap(const std::vector<std::int32_t>& map);
};

/// Finds the components. Inside nodes that share a cell hang together, so that a cell's surface belongs to one component.
Labels label_components(const Band& band, const RunControl& run = {});

/// Volume and area of each component from the piecewise linear surface (six tetrahedra a cell), the error of which is
/// second order in the voxel.
std::vector<Component> measure_components(const Band& band, const Labels& labels, const RunControl& run = {});

/// Hands the goals of the components before to the components now. `before` are the labels that the nodes had (on the
/// present bricks). One to one: unchanged. Parts that have merged hold the sum; parts that have split share what is missing
/// by area. A part out of nowhere has no goal; a part that vanished takes its goal with it.
void inherit_goals(const Labels& before, const std::vector<Component>& old, const Labels& now,
                   std::vector<Component>& fresh);

}  // namespace meniscus::band
