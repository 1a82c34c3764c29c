#pragma once

#include <meniscus/base/function_ref.h>
#include <meniscus/base/run_control.h>
#include <meniscus/pointset/conform.h>
#include <meniscus/pointset/delta.h>
#include <meniscus/pointset/local_fit.h>
#include <meniscus/pointset/point_set_field.h>
#include <meniscus/pointset/stroke.h>

#include <cstddef>
#include <optional>
#include <vector>

namespace meniscus::pointset {

struct SculptorOptions {
  FitOptions fit;                 ///< how changed points are fitted anew
  std::optional<double> spacing;  ///< wanted distance between points, world units; the cloud's typical one when not given
  bool resample = true;           ///< insert points where they are drawn apart, remove them where they crowd
  std::size_t most_points = 10'000'000;  ///< no stroke makes more
};

/// What a stroke did.
struct StrokeReport {
  std::size_t voxels = 0;  ///< of a force's region; 0 for other tools
  std::size_t points = 0;  ///< in the set afterwards
  std::size_t moved = 0;   ///< points that differ from before
  std::size_t inserted = 0, removed = 0;
  std::size_t lost = 0;         ///< of the removed: their surface vanished
  std::size_t stages = 0;       ///< the stroke was cut into so many, each moving no farther than points see
  bool full = false;            ///< SculptorOptions::most_points was reached: gaps are left
  double seconds_dynamics = 0;  ///< steps of the voxels
  double seconds_points = 0;    ///< everything else
};

/// A point-set surface in the hands of a sculptor: strokes change it, one undo each.
///
/// A stroke changes the values of the field; it is cut into stages in which the surface moves less than half a domain. After
/// each stage points go to the new surface (conform), vanished ones are removed, those whose domains saw something move are
/// fitted anew, and points are inserted or removed to keep their spacing. The topology may change. Points far from the tool
/// keep every bit. Deterministic for any number of threads, independent of scale.
class Sculptor {
 public:
  /// Throws InvalidInput for an empty set or options without meaning.
  explicit Sculptor(PointSet set, const SculptorOptions& options = {});

  /// What is seen while a stroke goes on: after every step of a force and every stage of other tools.
  using OnStep = FunctionRef<void(const PointSet&)>;

  /// Does a stroke. On any exception the set is as before. Throws what check(stroke) throws, InvalidInput when the stroke
  /// would leave no point, Cancelled.
  StrokeReport apply(const Stroke& stroke, const RunControl& run = {});
  StrokeReport apply(const Stroke& stroke, OnStep on_step, const RunControl& run = {});
  /// Takes the last stroke back, or does it again; every bit is restored. False when there is none.
  bool undo();
  bool redo();
  std::size_t strokes_done() const { return done_; }

  const PointSetField& field() const { return field_; }
  const PointSet& set() const { return field_.set(); }
  double spacing() const { return spacing_; }

 private:
  struct Done {
    Delta delta;
    double spacing_before, spacing_after;
  };
  struct Work;

  void make(const Stroke& stroke, Work& work);
  void force(const Stroke& stroke, const ToolShape& shape, Work& work);
  void brush(const Stroke& stroke, const ToolShape& shape, Work& work);
  void smooth(const Stroke& stroke, const ToolShape& shape, Work& work);
  void emboss(const Stroke& stroke, const ToolShape& shape, Work& work);
  void refine(const ToolShape& shape, Work& work);
  void stage(const ValueChange& change, Work& work);
  void settle(std::vector<char> changed, std::vector<char> gone, Work& work);
  bool fill_gaps(std::vector<char>& changed, Work& work);
  void refit_around(std::vector<char>& changed, Work& work);
  double least_reach(const ToolShape& shape) const;

  PointSetField field_;
  SculptorOptions options_;
  double spacing_;
  std::vector<Done> history_;
  std::size_t done_ = 0;
};

}  // namespace meniscus::pointset
