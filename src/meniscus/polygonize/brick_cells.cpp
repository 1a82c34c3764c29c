#include <meniscus/polygonize/brick_cells.h>

#include <algorithm>
#include <cmath>

namespace meniscus::polygonize {
namespace {

constexpr std::uint16_t kFullRow = 0x1FF;

/// The samples of a cell's corners, in the order of corner numbers.
using Corners = std::array<double, 8>;

Corners corners_of(const double* values, int i, int j, int k) {
  Corners c;
  const double* v = values + (i * kBrickPoints + j) * kBrickPoints + k;
  for (std::size_t n = 0; n < 8; ++n) c[n] = v[((n >> 2) * kBrickPoints + ((n >> 1) & 1)) * kBrickPoints + (n & 1)];
  return c;
}

/// Decides an ambiguous face by the sign of the bilinear interpolant at its saddle: true if the inside corners hang
/// together. Both cells at the face see the same four numbers in the same order.
bool inside_joined(const Corners& v, int face) {
  const auto at = [&](int n) { return v[static_cast<std::size_t>(face_corner(face, n))]; };
  const double even = at(0) * at(3);
  const double odd = at(1) * at(2);
  return at(0) < 0 ? even > odd : odd > even;
}

std::uint16_t classify(const CellCases& cases, std::uint8_t inside, const Corners& v) {
  const unsigned faces = cases.ambiguous_faces(inside);
  if (faces == 0) return cases.index(inside, 0);
  unsigned joined = 0;
  int n = 0;
  for (int f = 0; f < 6; ++f)
    if (((faces >> f) & 1) != 0) joined |= (inside_joined(v, f) ? 1U : 0U) << n++;
  return cases.index(inside, joined);
}

/// Where the surface crosses an edge, 0 at its lower end to 1.
double crossing(double a, double b) {
  const double t = a / (a - b);
  return t >= 0 && t <= 1 ? t : 0.5;  // infinite and NaN samples: the middle
}

/// Mean of the crossings on `edges` (bits), in cell coordinates [0, 1]³.
Vec3 mean_crossing(const Corners& v, unsigned edges) {
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (; edges != 0; edges &= edges - 1, ++count) {
    const int e = __builtin_ctz(edges);
    const int corner = edge_corner(e);
    sum += Vec3(corner >> 2, (corner >> 1) & 1, corner & 1);
    sum[e / 4] += crossing(v[static_cast<std::size_t>(corner)], v[static_cast<std::size_t>(edge_end(e))]);
  }
  return sum / count;
}

struct Trilinear {
  double value;
  Vec3 gradient;
};

Trilinear interpolate(const Corners& v, const Vec3& p) {
  const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
  // Along x first; then along y and z what is left.
  std::array<double, 4> s;
  std::array<double, 4> dx;
  for (std::size_t n = 0; n < 4; ++n) {
    s[n] = mix(v[n], v[n + 4], p.x());
    dx[n] = v[n + 4] - v[n];
  }
  const double low = mix(s[0], s[1], p.z());
  const double high = mix(s[2], s[3], p.z());
  return {
      mix(low, high, p.y()),
      {mix(mix(dx[0], dx[1], p.z()), mix(dx[2], dx[3], p.z()), p.y()), high - low, mix(s[1] - s[0], s[3] - s[2], p.y())}};
}

/// Two Newton steps along the gradient onto the interpolant's zero, kept in the cell.
Vec3 project_trilinear(const Corners& v, Vec3 p) {
  for (int step = 0; step < 2; ++step) {
    const Trilinear f = interpolate(v, p);
    const Vec3 next = p - f.value / f.gradient.squaredNorm() * f.gradient;
    if (!next.allFinite()) break;
    p = next.cwiseMax(0).cwiseMin(1);
  }
  return p;
}

void append_vertices(const Lattice& lattice, const Coord& cell, const CellCase& kind, const Corners& v, bool trilinear,
                     BrickCells& out) {
  // A cell cut into several loops has no single interpolant surface to stand on near each of them.
  const int count = kind.vertices();
  for (int n = 0; n < count; ++n) {
    Vec3 p = mean_crossing(v, cell_vertex(kind, n).edges);
    if (trilinear) {
      if (count == 1) p = project_trilinear(v, p);
      out.normals.push_back(unit_or_zero(interpolate(v, p).gradient));
    }
    out.positions.push_back(lattice.origin + lattice.voxel * (Vec3(cell[0], cell[1], cell[2]) + p));
  }
}

/// Cells along z in row (i, j) that have corners on both sides, as 8 bits.
unsigned mixed_cells(const SignRows& rows, int i, int j) {
  const unsigned a = rows.at(i, j);
  const unsigned b = rows.at(i, j + 1);
  const unsigned c = rows.at(i + 1, j);
  const unsigned d = rows.at(i + 1, j + 1);
  const unsigned any = a | b | c | d;
  const unsigned all = a & b & c & d;
  return (any | (any >> 1)) & ~(all & (all >> 1)) & 0xFF;
}

std::uint8_t corner_signs(const SignRows& rows, int i, int j, int k) {
  const auto pair = [&](int x, int y) { return static_cast<unsigned>(rows.at(i + x, j + y) >> k) & 3U; };
  return static_cast<std::uint8_t>(pair(0, 0) | (pair(0, 1) << 2) | (pair(1, 0) << 4) | (pair(1, 1) << 6));
}

}  // namespace

bool SignRows::read(const double* values) {
  unsigned any = 0;
  unsigned all = kFullRow;
  for (std::size_t r = 0; r < row.size(); ++r) {
    unsigned bits = 0;
    for (unsigned k = 0; k < kBrickPoints; ++k) bits |= (values[r * kBrickPoints + k] < 0 ? 1U : 0U) << k;
    row[r] = static_cast<std::uint16_t>(bits);
    any |= bits;
    all &= bits;
  }
  return any != 0 && all != kFullRow;
}

CellVertex cell_vertex(const CellCase& kind, int number) {
  CellVertex vertex;
  if (number < kind.loops) {
    for (std::size_t e = 0; e < 12; ++e)
      if (kind.loop_of_edge[e] == number) vertex.edges |= 1U << e;
    return vertex;
  }
  // Split faces by rising axis, two segments each.
  int pair = (number - kind.loops) / 2;
  int axis = 0;
  while (((kind.split >> axis) & 1) == 0 || pair-- > 0) ++axis;
  const int segment = (number - kind.loops) % 2;
  vertex.split_axis = axis;
  for (int e = 0; e < 4; ++e)
    if (((kind.upper_segment_of[static_cast<std::size_t>(axis)] >> e) & 1) == segment)
      vertex.edges |= 1U << face_edge(2 * axis + 1, e);
  return vertex;
}

void append_cells(const Lattice& lattice, const SignRows& rows, const double* values, bool trilinear, SurfaceBrick& brick,
                  BrickCells& out) {
  const CellCases& cases = CellCases::get();
  const std::size_t first_cell = out.cells.size();
  const std::size_t first_vertex = out.positions.size();
  brick.first_cell = static_cast<std::uint32_t>(first_cell);
  brick.first_vertex = static_cast<std::uint32_t>(first_vertex);
  for (int i = 0; i < kBrickCells; ++i) {
    brick.rank[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(out.cells.size() - first_cell);
    for (int j = 0; j < kBrickCells; ++j) {
      unsigned mixed = mixed_cells(rows, i, j);
      brick.mask[static_cast<std::size_t>(i)] |= std::uint64_t{mixed} << (8 * j);
      for (; mixed != 0; mixed &= mixed - 1) {
        const int k = __builtin_ctz(mixed);
        const Corners v = corners_of(values, i, j, k);
        const std::uint16_t kind = classify(cases, corner_signs(rows, i, j, k), v);
        out.cells.push_back({kind, static_cast<std::uint16_t>(out.positions.size() - first_vertex)});
        const Coord cell = {brick.index[0] * kBrickCells + i, brick.index[1] * kBrickCells + j,
                            brick.index[2] * kBrickCells + k};
        append_vertices(lattice, cell, cases[kind], v, trilinear, out);
      }
    }
  }
  brick.cell_count = static_cast<std::uint16_t>(out.cells.size() - first_cell);
  brick.vertex_count = static_cast<std::uint16_t>(out.positions.size() - first_vertex);
}

void append_reached(const SignRows& rows, const Coord& brick, std::vector<Coord>& reached) {
  // An edge in the brick's boundary is crossed where the signs change along it; its cells lie in the bricks that hold it.
  const auto mixed = [&](int i0, int i1, int j0, int j1, unsigned columns) {
    unsigned any = 0;
    unsigned all = columns;
    for (int i = i0; i <= i1; ++i)
      for (int j = j0; j <= j1; ++j) {
        any |= rows.at(i, j) & columns;
        all &= rows.at(i, j);
      }
    return any != 0 && all != columns;
  };
  constexpr int kLast = kBrickPoints - 1;
  const auto low = [](int d) { return d > 0 ? kLast : 0; };
  const auto high = [](int d) { return d < 0 ? 0 : kLast; };
  const auto columns = [](int d) { return d < 0 ? 1U : d > 0 ? 1U << kLast : unsigned{kFullRow}; };
  for (int dx = -1; dx <= 1; ++dx)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dz = -1; dz <= 1; ++dz) {
        const int shared = std::abs(dx) + std::abs(dy) + std::abs(dz);
        if (shared == 0 || shared == 3) continue;  // itself; a corner has no edge
        if (mixed(low(dx), high(dx), low(dy), high(dy), columns(dz)))
          reached.push_back({brick[0] + dx, brick[1] + dy, brick[2] + dz});
      }
}

}  // namespace meniscus::polygonize
