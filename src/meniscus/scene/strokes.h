#pragma once

#include <meniscus/base/vec.h>

#include <string>
#include <vector>

namespace meniscus::scene {

/// A surface point and the way it is dragged.
struct Drag {
  std::vector<Vec3> path;     ///< from the surface point through all places it goes, at least two
  std::vector<double> times;  ///< when it is at each, seconds since the stroke began: 0 first, rising
  bool sideways = false;      ///< takes along the stuff it holds, not only the surface

  /// Where it is at `t`: straight on between places, resting after the last.
  Vec3 at(double t) const;
};

/// Drags that happen together and the points that hold meanwhile: one entry of a document's history.
struct Stroke {
  std::string label = "drag";
  std::vector<Drag> drags;
  std::vector<Vec3> pins;
  std::vector<std::string> freeze;  ///< unknowns that stay, by name or by the name of what they belong to

  double seconds() const;
  /// The times at which a drag reaches a place of its path, in order, without 0.
  std::vector<double> knots() const;
};

/// Times for a path of `places` that is walked in `seconds`, the same time from each place to the next.
std::vector<double> even_times(std::size_t places, double seconds);

/// Reads {"strokes": [{"label": "…", "seconds": 1, "drags": [{"path": [[x,y,z], …], "times": [0, …], "sideways": false}],
/// "pins": [[x,y,z], …], "freeze": [name, …]}, …]}. Paths without times take the stroke's seconds (1 if not given), evenly.
/// Throws IoError naming the file and place of what is wrong.
std::vector<Stroke> read_strokes(const std::string& path);

}  // namespace meniscus::scene
