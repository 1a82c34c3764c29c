#pragma once

#include <meniscus/field/interval.h>
#include <meniscus/field/jets.h>
#include <meniscus/field/tape.h>

#include <span>

namespace meniscus::field {

/// What a tape reads beside positions.
struct TapeState {
  std::span<const double> values;  ///< of the parameters
  std::span<const double> seeds;   ///< four per parameter: its derivatives by x, y, z, t (or whatever is asked for)
  double time = 0;
  bool variables = true;  ///< whether derivatives are by x, y, z, t; otherwise only `seeds` count
  bool moving = false;    ///< whether derivatives by the fourth variable are wanted; otherwise they are stored as zero
};

/// Evaluates a tape at many points with the best instructions of this processor.
void run_tape(const Tape& tape, const TapeState& state, const Positions& x, const JetView& out);

/// Bounds on a tape's value for coordinates in the given intervals. Everything, where it may not be defined at all.
Interval range_of_tape(const Tape& tape, const TapeState& state, const std::array<Interval, 3>& x);

}  // namespace meniscus::field
