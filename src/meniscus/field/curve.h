#pragma once

#include <meniscus/field/parameter.h>

#include <vector>

namespace meniscus::field {

/// How a curve runs from one key to the next.
enum class CurveInterpolation {
  Step,    ///< holds a key's value until the next key
  Linear,  ///< straight; the rate jumps at keys
  /// Smooth rate; never overshoots a key: flat at the ends and at extreme keys, otherwise slopes as in Fritsch & Carlson's
  /// monotone cubic (what animation packages call "auto clamped").
  Cubic
};

/// A number given at key times, held flat before the first and after the last key.
class Curve : public TimeFunction {
 public:
  /// `times` in seconds, strictly rising; as many `values`. Throws InvalidInput for no keys, unequal counts, times that do
  /// not rise, or numbers that are not finite.
  Curve(std::vector<double> times, std::vector<double> values, CurveInterpolation interpolation = CurveInterpolation::Cubic);

  /// At a key the rate is that of the span that begins there. NaN for a t that is NaN.
  Sample at(double t) const override;

 private:
  void set_slopes();

  std::vector<double> times_, values_, slopes_;  // slopes: Cubic only
  CurveInterpolation interpolation_;
};

}  // namespace meniscus::field
