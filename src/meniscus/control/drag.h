#pragma once

#include <meniscus/base/function_ref.h>
#include <meniscus/control/rows.h>
#include <meniscus/control/system.h>

#include <optional>
#include <string>
#include <vector>

namespace meniscus::control {

struct DragOptions {
  std::optional<double> length;     ///< scale of the shape, world units; see length_scale
  double spring = 10;               ///< 1/s: a control closes this share of its distance to the target per second
  double largest_step = 0.05;       ///< most that a control advances in a step, in lengths
  double largest_turn = 0.5;        ///< the same in local radii |∇F|/|H|: farther off, F_q says little
  double largest_change = 0.1;      ///< most that an unknown changes (by its metric) in a Newton step, in lengths
  double capture = 0.05;            ///< a new control this near the surface, in lengths, is moved onto it
  int newton_steps = 30;            ///< rounds in which a step projects back onto F(p, q) = 0, at most
  double tolerance = 1e-11;         ///< change below which a pose counts as settled, in lengths
  std::vector<std::string> freeze;  ///< unknowns that stay, by name or by the name of what they belong to
  /// Points spread evenly over the surface: the metric is then surface_scale instead of sensitivity_scale.
  std::vector<Vec3> samples;
};

/// A point that holds the surface: F(position, q) = 0.
struct Control {
  Vec3 position;          ///< where it is now
  Vec3 target;            ///< where it shall go; equal to position for a pin
  Vec3 grabbed;           ///< where it was when the present drag began
  bool sideways = false;  ///< asks the stuff under it to come along, not only the surface
};

/// What a step did.
struct StepReport {
  enum class Outcome {
    Moving,     ///< advanced; a target is still away
    Arrived,    ///< every control is at its target
    Unchanged,  ///< no unknown is in reach of any control: nothing was changed
    Failed,     ///< no pose near enough to the old one holds the controls: the old one was kept
  };
  Outcome outcome = Outcome::Arrived;
  Status status = Status::Solved;      ///< of the system at the new pose
  std::size_t parameters = 0;          ///< unknowns that are not frozen
  std::size_t rank = 0;                ///< independent controls; sideways rows do not count
  std::vector<double> residual;        ///< signed distance of each control from the surface, world units
  std::vector<std::size_t> conflicts;  ///< controls whose residual counts
  std::vector<std::size_t> slipped;    ///< sideways controls whose stuff lags behind
  double condition = 1;
  std::size_t at_bound = 0;  ///< unknowns held by their bounds
  int newton_steps = 0;
  bool settled = false;  ///< no shape that holds the controls and is nearer to that of the drag's beginning was found
  double away = 0;       ///< largest distance of a control from its target, world units
};
const char* name(StepReport::Outcome outcome);

/// Where a new control came to lie.
struct Placed {
  std::size_t id = 0;
  double moved = 0;  ///< world units from the point that was asked for
};

/// Control points on a surface and the drags that reshape it [WH94 §3].
///
/// Each step moves the controls by their springs and then finds, by Newton's method on (2.2), the unknowns nearest to those
/// of the drag's beginning that hold every control. The shape is a function of where the controls are, not of their way
/// there: dragged back, a control restores the shape. A change of the set of controls begins a new drag.
class ControlSession {
 public:
  /// Poses `surface`, which must outlive the session.
  explicit ControlSession(field::Field& surface, DragOptions options = {});

  /// A control that stays, or that can be aimed. Throws InvalidInput for a point that is not finite or too far off.
  Placed add(const Vec3& point, bool sideways = false);
  /// Throws InvalidInput for a target that is not finite or an unknown id; nothing is changed then.
  void aim(std::size_t id, const Vec3& target);
  void remove(std::size_t id);
  /// Begins a drag at the present shape.
  void rebase();

  const std::vector<Control>& controls() const { return controls_; }
  double length() const { return length_; }

  /// Called at the old pose with the unknowns' rates set, before the surface is posed anew: what follows the surface
  /// (floaters, colours) advances by dt there.
  using Follow = FunctionRef<void(const field::Field& surface, double dt)>;
  /// Advances by `dt` seconds. Throws InvalidInput unless dt is above zero.
  StepReport step(double dt) { return advance(dt, nullptr); }
  StepReport step(double dt, Follow follow) { return advance(dt, &follow); }
  /// Steps until the controls arrive, or a step fails or no longer comes nearer.
  StepReport run(double dt = 0.1) { return advance_all(dt, nullptr); }
  StepReport run(double dt, Follow follow) { return advance_all(dt, &follow); }

 private:
  struct Attempt;
  StepReport advance(double dt, const Follow* follow);
  StepReport advance_all(double dt, const Follow* follow);
  /// `part` <= 1 of the way back is gone.
  Attempt project(const std::vector<Vec3>& positions, std::vector<double> q, double part);
  std::vector<double> targets(const std::vector<Vec3>& positions, const std::vector<double>& q,
                              const std::vector<double>& distance) const;
  System system(const std::vector<Vec3>& positions, const std::vector<double>& q) const;
  void build_sideways_rows();
  std::vector<double> farthest() const;
  StepReport report(const Attempt& attempt, const std::vector<Vec3>& positions) const;
  std::vector<double> values() const;

  field::Field& surface_;
  DragOptions options_;
  double length_ = 1;
  bool stale_ = false;  // controls were added or removed since rebase
  std::vector<Control> controls_;
  std::vector<double> rest_;   // the unknowns when the drag began
  std::vector<double> scale_;  // the metric of the drag
  /// The way back to the drag's beginning, one share of it per step.
  struct Descent {
    std::vector<double> q, pull;
    double share = 0.5;
    Descent next(const std::vector<double>& at, const Solution& found, const std::vector<double>& scale) const;
  };
  Descent descent_;
  struct Sideways {
    std::size_t control;
    Vec3 direction;
  };
  std::vector<Sideways> sideways_;
  field::SparseRows sideways_rows_;  // how the stuff moves along each direction, per unit of unknown
};

}  // namespace meniscus::control
