#include <meniscus/polygonize/cell_cases.h>

namespace meniscus::polygonize {
namespace {

bool is_inside(std::uint8_t inside, int corner) { return ((inside >> corner) & 1) != 0; }

bool crossed(std::uint8_t inside, int edge) {
  return is_inside(inside, edge_corner(edge)) != is_inside(inside, edge_end(edge));
}

bool ambiguous(std::uint8_t inside, int face) {
  const bool v00 = is_inside(inside, face_corner(face, 0));
  return v00 != is_inside(inside, face_corner(face, 1)) && v00 != is_inside(inside, face_corner(face, 2)) &&
         v00 == is_inside(inside, face_corner(face, 3));
}

/// Number within the face of the face edge that runs along in-plane axis a (0 or 1) through face corner n = 2u + v.
int face_edge_at(int a, int n) { return a == 0 ? (n & 1) : 2 + (n >> 1); }

/// A piece of the surface's boundary on one face: it joins two crossed edges of that face.
struct Segment {
  int a, b;  // numbers within the face
};

struct FaceSegments {
  int count = 0;
  std::array<Segment, 2> segment{};
};

/// On an ambiguous face each segment cuts off a corner: outside ones if the inside ones are `joined`, inside ones if not.
FaceSegments segments_on(std::uint8_t inside, int face, bool joined) {
  FaceSegments result;
  if (ambiguous(inside, face)) {
    for (int n = 0; n < 4; ++n)
      if (is_inside(inside, face_corner(face, n)) != joined)
        result.segment[static_cast<std::size_t>(result.count++)] = {face_edge_at(0, n), face_edge_at(1, n)};
    return result;
  }
  std::array<int, 2> ends{};
  std::size_t found = 0;
  for (int e = 0; e < 4; ++e)
    if (crossed(inside, face_edge(face, e))) ends[found++] = e;
  if (found == 2) result.segment[static_cast<std::size_t>(result.count++)] = {ends[0], ends[1]};
  return result;
}

/// Every crossed edge ends one segment on each of its two faces, so the segments form closed loops: follow them.
void trace_loops(const std::array<FaceSegments, 6>& faces, CellCase& cell) {
  std::array<std::array<int, 2>, 12> next{};
  std::array<int, 12> degree{};
  for (int f = 0; f < 6; ++f)
    for (int s = 0; s < faces[static_cast<std::size_t>(f)].count; ++s) {
      const Segment& segment = faces[static_cast<std::size_t>(f)].segment[static_cast<std::size_t>(s)];
      const auto a = static_cast<std::size_t>(face_edge(f, segment.a));
      const auto b = static_cast<std::size_t>(face_edge(f, segment.b));
      next[a][static_cast<std::size_t>(degree[a]++)] = static_cast<int>(b);
      next[b][static_cast<std::size_t>(degree[b]++)] = static_cast<int>(a);
    }
  cell.loop_of_edge.fill(kNoLoop);
  for (std::size_t start = 0; start < 12; ++start) {
    if (degree[start] == 0 || cell.loop_of_edge[start] != kNoLoop) continue;
    std::size_t at = start;
    while (cell.loop_of_edge[at] == kNoLoop) {
      cell.loop_of_edge[at] = cell.loops;
      const auto first = static_cast<std::size_t>(next[at][0]);
      at = cell.loop_of_edge[first] == kNoLoop ? first : static_cast<std::size_t>(next[at][1]);
    }
    ++cell.loops;
  }
}

CellCase make_case(std::uint8_t inside, std::uint8_t ambiguous_faces, unsigned joined) {
  std::array<FaceSegments, 6> faces;
  unsigned decision = joined;
  for (int f = 0; f < 6; ++f) {
    const bool is_ambiguous = ((ambiguous_faces >> f) & 1) != 0;
    faces[static_cast<std::size_t>(f)] = segments_on(inside, f, is_ambiguous && (decision & 1) != 0);
    if (is_ambiguous) decision >>= 1;
  }

  CellCase cell;
  cell.inside = inside;
  trace_loops(faces, cell);
  for (int axis = 0; axis < 3; ++axis) {
    const int face = 2 * axis + 1;
    const FaceSegments& on = faces[static_cast<std::size_t>(face)];
    if (on.count < 2) continue;
    const auto loop = [&](const Segment& s) { return cell.loop_of_edge[static_cast<std::size_t>(face_edge(face, s.a))]; };
    if (loop(on.segment[0]) != loop(on.segment[1])) continue;
    cell.split = static_cast<std::uint8_t>(cell.split | (1 << axis));
    cell.upper_segment_of[static_cast<std::size_t>(axis)] =
        static_cast<std::uint8_t>((1 << on.segment[1].a) | (1 << on.segment[1].b));
  }
  return cell;
}

}  // namespace

const CellCases& CellCases::get() {
  static const CellCases cases;
  return cases;
}

CellCases::CellCases() {
  for (unsigned inside = 0; inside < 256; ++inside) {
    const auto signs = static_cast<std::uint8_t>(inside);
    for (int f = 0; f < 6; ++f)
      if (ambiguous(signs, f)) ambiguous_[inside] = static_cast<std::uint8_t>(ambiguous_[inside] | (1 << f));
    first_[inside] = static_cast<std::uint16_t>(cases_.size());
    const unsigned combinations = 1U << __builtin_popcount(ambiguous_[inside]);
    for (unsigned joined = 0; joined < combinations; ++joined)
      cases_.push_back(make_case(signs, ambiguous_[inside], joined));
  }
}

}  // namespace meniscus::polygonize
