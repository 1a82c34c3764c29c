#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/interval.h>
#include <meniscus/field/jets.h>
#include <meniscus/field/parameter.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace meniscus::field {

/// Rows F_q of many points, compressed: row i holds entries [begin[i], begin[i+1]). Within a row the indices (into
/// Field::parameters()) rise and none occurs twice; parameters without influence at the point are left out.
struct SparseRows {
  std::vector<std::size_t> begin{0};
  std::vector<std::uint32_t> index;
  std::vector<double> value;

  std::size_t size() const { return begin.size() - 1; }
  void clear();
  /// Closes the row under construction: sorts it by index and adds up entries of equal index.
  void end_row();
};

/// Velocities, structure of arrays, world units per second.
struct VelocityView {
  double* x = nullptr;
  double* y = nullptr;
  double* z = nullptr;
  VelocityView part(std::size_t first) const { return {x + first, y + first, z + first}; }
};

/// A scalar field F(x, q, t): negative inside, positive outside; the surface is F = 0 and its outward normal ∇F/|∇F|.
///
/// A field is *posed* at a time and a parameter vector (set_time, set_parameters). Between poses everything is const,
/// deterministic and safe to call from many threads. Time derivatives include what the unknowns do at the rates given to
/// set_parameters: F_t here is F_t + F_q·q̇ of the papers.
class Field {
 public:
  Field() = default;
  Field(const Field&) = default;
  Field& operator=(const Field&) = default;
  virtual ~Field() = default;

  /// A copy in the same pose that shares nothing that changes.
  virtual std::unique_ptr<Field> clone() const = 0;

  /// F and the derivatives that `out.order` asks for at every point of `x`; `out.size` must equal `x.size`.
  /// A point's result never depends on the other points of the batch, to the last bit. At a point with a coordinate that is
  /// not finite all results are NaN. Where a derivative does not exist (centre of a sphere, seam of a union) it is finite:
  /// zero, or that of one side.
  void evaluate(const Positions& x, const JetView& out) const;

  /// How the stuff at x moves, world units per second: a primitive's own motion, the moving parts' weighted mean in a blend,
  /// the deciding branch in a set operation. Zero where nothing says otherwise. [SS11 §5, THEORY §4]
  void material_velocity(const Positions& x, const VelocityView& out) const;

  /// Appends the row F_q of every point to `rows`. [WH94 §3]
  void parameter_rows(const Positions& x, SparseRows& rows) const;

  /// Bounds on F over a box, infinite parts allowed: never wrong, not always tight.
  virtual Interval range(const Box& box) const = 0;

  /// A box that holds the surface and all that is inside it; may be infinite; empty when nothing can be inside.
  Box bounds() const { return bounds_below(0); }
  /// A box that holds every point with F <= level.
  virtual Box bounds_below(double level) const = 0;

  /// The unknowns q with their values, in the order of set_parameters.
  const std::vector<Parameter>& parameters() const { return parameters_; }
  /// Poses the field at parameters `values` that change at `rates` per second (none = at rest).
  /// Throws InvalidInput for a wrong count or a value that is not finite; the pose is then as before.
  void set_parameters(std::span<const double> values, std::span<const double> rates = {});

  /// Poses the field at time `t`, seconds. Throws InvalidInput if t is not finite.
  void set_time(double t);
  double time() const { return time_; }
  /// Whether F can change with time in its present set-up (animated numbers or rates).
  virtual bool moving() const = 0;

 protected:
  virtual void do_evaluate(const Positions& x, const JetView& out) const = 0;
  virtual void do_material_velocity(const Positions& x, const VelocityView& out) const;
  virtual void do_parameter_rows(const Positions& x, SparseRows& rows) const;
  virtual void do_set_parameters(std::span<const double> values, std::span<const double> rates);
  virtual void do_set_time(double t);

  std::vector<Parameter> parameters_;

 private:
  double time_ = 0;
};

/// Points of a field are evaluated in blocks of this many by the parallel helpers below and by composite fields.
inline constexpr std::size_t kBlock = 256;

/// Evaluates in parallel, blocks of kBlock points.
void evaluate(const Field& field, const Positions& x, const JetView& out, const RunControl& run);
/// The same for an array of points.
JetBatch evaluate(const Field& field, const std::vector<Vec3>& points, Order order, const RunControl& run = {});
/// F at one point: for tests and messages, never for loops.
double value_at(const Field& field, const Vec3& point);

}  // namespace meniscus::field
