#pragma once

#include <meniscus/field/field.h>
#include <meniscus/pointset/point_set.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace meniscus::pointset {

enum class Operation { Union, Intersection, Difference };

/// A point-set surface, or a Boolean of two: each part keeps its own field, so edges stay sharp however deep the nesting.
struct Solid {
  PointSet set;                        ///< of a leaf; may be empty: nothing inside
  std::optional<Operation> operation;  ///< none: a leaf
  std::vector<Solid> inputs;           ///< two where there is an operation, none in a leaf
};

/// Deepest nesting that is taken.
inline constexpr int kMostNesting = 64;

/// The field of a solid: least and greatest of its parts' fields, seams and all. Throws InvalidInput beyond kMostNesting.
std::unique_ptr<field::Field> field_of(const Solid& solid);

/// Points of a surface with unit normals in "N", beside the field that is zero there.
struct SurfacePoints {
  points::Cloud cloud;
  const field::Field* field = nullptr;
};

struct BooleanReport {
  std::size_t kept_a = 0;
  std::size_t kept_b = 0;
  std::size_t edge_points = 0;  ///< new, on the curve where the surfaces meet
};

/// The points on the surface of A ∪ B, A ∩ B or A − B, by classification alone [GHQ03; THEORY §6]: those of A, then those of
/// B (reversed in a difference), then new points along the curve in which the surfaces meet, about a spacing apart, each
/// with both fields below 1e-9 spacings.
///
/// Attributes: "part" is 0 for points of A, 1 for B, 2 on the edge; "N" is the normal, on the edge the mean of both, which
/// stand in "N_a" and "N_b" (elsewhere both are N); others ride along where A and B both have them.
/// Where the surfaces coincide (within 0.01 spacings), A's points stand for both if the sides agree, and otherwise the
/// surface is there only in a difference. Disjoint solids, identical ones and empty results are all answers.
/// Deterministic for any number of threads. Cost: one value of the other field a point, and O(n log n).
points::Cloud boolean(const SurfacePoints& a, const SurfacePoints& b, Operation operation, BooleanReport* report = nullptr,
                      const RunControl& run = {});

/// The points of a solid: a leaf's own, a node's by boolean(). `report` is that of the outermost operation.
points::Cloud points_of(const Solid& solid, BooleanReport* report = nullptr, const RunControl& run = {});

}  // namespace meniscus::pointset
