#pragma once

#include <meniscus/control/drag.h>
#include <meniscus/control/tools.h>
#include <meniscus/sample/floaters.h>
#include <meniscus/scene/history.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace meniscus::scene {

/// What a step of an editing session did.
struct EditStep {
  control::StepReport control;
  sample::FloaterStep floaters;  ///< nothing while none are shown
};

/// A scene's surface under the hand: control points pull on it, floaters show it, the document keeps what came of it. The
/// loop of [WH94 §6], for an interface that calls `step` once per picture.
class EditSession {
 public:
  /// Builds the document's surface. Throws what build_field throws.
  explicit EditSession(Document document, RunControl run = {});

  const Document& document() const { return document_; }
  const History& history() const { return history_; }
  field::Field& surface() { return *surface_; }

  /// `count` points spread evenly over the present surface; fewer if it does not take them. Throws InvalidInput if the
  /// surface has no finite bounds.
  points::Cloud spread_points(std::size_t count) const;
  /// Spreads about `count` >= 1 floaters; from now on they follow the surface, splitting and dying as it grows and shrinks.
  /// Throws InvalidInput if the surface has no finite bounds.
  void show_floaters(std::size_t count);
  /// Nothing before show_floaters or if no surface was found then.
  const sample::Floaters* floaters() const { return floaters_ ? &*floaters_ : nullptr; }

  /// Begins a stroke at the present shape, without controls; what an unfinished stroke did is kept for this one.
  control::ControlSession& begin_stroke(control::DragOptions options = {});
  /// The stroke's controls. Throws InvalidInput when no stroke has begun.
  control::ControlSession& controls();
  /// Controls, unknowns and floaters advance together by `dt` seconds: the controls by their springs, the unknowns so that
  /// the surface holds them, the floaters by the unknowns' rates and their own repulsion.
  EditStep step(double dt);
  /// Steps until the controls have arrived and the shape has settled, or nothing comes nearer.
  EditStep run(double dt = 0.1);
  /// Changes the unknowns as little as possible until the surface has this area or volume, measured by evenly spread points
  /// (to about 0.1 %). A stroke of its own: end_stroke writes it. Throws InvalidInput for a target that is not above zero or
  /// a surface without finite bounds.
  control::GoalReport reach(control::Measure goal, double target, const std::vector<std::string>& freeze = {});
  /// Writes what the stroke changed into the document, as one entry of the history, and ends it.
  void end_stroke(const std::string& label);

  /// Takes the last stroke back, or makes it again; an unfinished one is given up. Says whether there was one.
  bool undo();
  bool redo();

 private:
  EditStep advance(double dt, bool to_the_end);
  void follow(const field::Field& surface, double dt, sample::FloaterStep& report);
  void pose_as_written();
  Box box() const;

  Document document_;
  RunControl run_;
  History history_;
  std::unique_ptr<field::Field> surface_;
  std::optional<control::ControlSession> controls_;
  std::optional<sample::Floaters> floaters_;
};

}  // namespace meniscus::scene
