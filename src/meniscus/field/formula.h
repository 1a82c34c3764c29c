#pragma once

#include <meniscus/base/error.h>
#include <meniscus/field/tape.h>

#include <span>
#include <string>
#include <string_view>

namespace meniscus::field {

/// A formula that cannot be understood; what() names the column and, for a misspelt name, a likely one.
class FormulaError : public InvalidInput {
 public:
  FormulaError(std::size_t column, const std::string& reason);
  /// Where, counted in bytes from 1.
  std::size_t column() const { return column_; }

 private:
  std::size_t column_;
};

/// Which variables a formula may use.
enum class Variables {
  PositionAndTime,  ///< x, y, z, t
  Time              ///< t
};

/// Parses a formula into a tape. Common sub-expressions are computed once, constants are folded.
///
/// Numbers (2, .5, 1e-3), pi, e; variables; named `parameters`; + - * / ^ (right-associative, before the unary minus:
/// -x^2 = -(x^2)), parentheses; sin cos tan asin acos atan atan2(y,x) sinh cosh tanh exp log log2 log10 sqrt abs sign floor
/// ceil mod(a,b) pow(a,b) min(…) max(…) length(…) clamp(x,lo,hi) mix(a,b,t) smoothstep(lo,hi,x). Angles in radians. Throws
/// FormulaError; also for more than a million characters or nesting beyond 200. InvalidInput for a parameter whose name is
/// no identifier, is taken, or is given twice.
Tape parse_formula(std::string_view text, std::span<const std::string> parameters,
                   Variables variables = Variables::PositionAndTime);

}  // namespace meniscus::field
