#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace meniscus::polygonize {

// Numbering inside a cell. Corner (x, y, z) is 4x + 2y + z. Edge 4d + 2p + q runs along axis d at positions p, q on the two
// other axes, taken in rising order. Face 2d + s is the one across axis d on side s; its corners are v00 v01 v10 v11 and
// its edges: along the first in-plane axis at 0 and at 1 of the second, along the second at 0 and at 1 of the first.

inline constexpr std::uint8_t kNoLoop = 0xFF;

/// How the surface passes through one cell: closed loops of face segments, one mesh vertex each.
struct CellCase {
  std::uint8_t inside = 0;  ///< bit c: corner c is inside
  std::uint8_t loops = 0;   ///< 0 to 4
  /// Bit d: both segments on the ambiguous face across axis d, upper side, belong to one loop. Each of the two then gets a
  /// vertex of its own (order: loops, then the pairs by axis), or the neighbour's loop could meet this one twice.
  std::uint8_t split = 0;
  std::array<std::uint8_t, 12> loop_of_edge{};     ///< kNoLoop where the surface does not cross
  std::array<std::uint8_t, 3> upper_segment_of{};  ///< per axis: bit e: edge e of the upper face ends segment 1, not 0

  /// Mesh vertices that the cell owns.
  int vertices() const { return loops + 2 * ((split & 1) + ((split >> 1) & 1) + ((split >> 2) & 1)); }
};

/// Every way in which corner signs and decisions on ambiguous faces can combine (some 900), generated once.
class CellCases {
 public:
  static const CellCases& get();

  /// Bit f: face f is ambiguous under these corner signs.
  std::uint8_t ambiguous_faces(std::uint8_t inside) const { return ambiguous_[inside]; }
  /// Number of a case. Bit n of `joined` belongs to the n-th ambiguous face: its inside corners hang together.
  std::uint16_t index(std::uint8_t inside, unsigned joined) const {
    return static_cast<std::uint16_t>(first_[inside] + joined);
  }
  const CellCase& operator[](std::uint16_t index) const { return cases_[index]; }

 private:
  CellCases();
  std::array<std::uint8_t, 256> ambiguous_{};
  std::array<std::uint16_t, 256> first_{};
  std::vector<CellCase> cases_;
};

constexpr int corner_bit(int axis) { return 4 >> axis; }
/// The two axes other than `axis`, rising.
constexpr std::array<int, 2> other_axes(int axis) { return {axis == 0 ? 1 : 0, axis == 2 ? 1 : 2}; }
/// Lower end of an edge.
constexpr int edge_corner(int edge) {
  const auto [u, v] = other_axes(edge / 4);
  return ((edge & 2) ? corner_bit(u) : 0) + ((edge & 1) ? corner_bit(v) : 0);
}
/// Upper end of an edge.
constexpr int edge_end(int edge) { return edge_corner(edge) + corner_bit(edge / 4); }
/// Corner number n = 2u + v of a face.
constexpr int face_corner(int face, int n) {
  const auto [u, v] = other_axes(face / 2);
  return ((face & 1) ? corner_bit(face / 2) : 0) + ((n & 2) ? corner_bit(u) : 0) + ((n & 1) ? corner_bit(v) : 0);
}
/// The edge of the cell that runs along `axis` through `corner`.
constexpr int edge_through(int axis, int corner) {
  const auto [u, v] = other_axes(axis);
  return 4 * axis + ((corner & corner_bit(u)) ? 2 : 0) + ((corner & corner_bit(v)) ? 1 : 0);
}
/// Edge number n of a face, as an edge of the cell.
constexpr int face_edge(int face, int n) {
  const auto [u, v] = other_axes(face / 2);
  const int corner = ((face & 1) ? corner_bit(face / 2) : 0) + ((n & 1) ? corner_bit(n < 2 ? v : u) : 0);
  return edge_through(n < 2 ? u : v, corner);
}

}  // namespace meniscus::polygonize
