#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace meniscus::field {

/// A number that changes with time: a curve or an expression of t.
class TimeFunction {
 public:
  struct Sample {
    double value;
    double rate;  ///< exact d/dt, per second
  };
  virtual ~TimeFunction() = default;
  /// Value and rate at `t` seconds.
  virtual Sample at(double t) const = 0;
};

/// What kind of quantity a parameter is; metrics and units follow from it.
enum class Quantity { Coordinate, Length, Weight, Angle, Ratio, Number };

/// An unknown of a field: one entry of q in F(x, q, t).
struct Parameter {
  std::string name;  ///< path of the place ("items[2].radius"), or the shared name when several places read it
  Quantity quantity = Quantity::Number;
  double value = 0;
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool shared = false;  ///< named: equal names anywhere in a field are one unknown
};

/// A number in a field's description: a literal (an unknown of its own unless frozen), a named unknown shared by every
/// place that reads it, or a function of time (never an unknown).
class Number {
 public:
  Number(double value) : value_(value) {}  // NOLINT(google-explicit-constructor): literals are numbers
  /// A literal that control must not change.
  static Number frozen(double value);
  /// The named unknown; `range` bounds it.
  static Number named(std::string name, double value, double min = -std::numeric_limits<double>::infinity(),
                      double max = std::numeric_limits<double>::infinity());
  static Number animated(std::shared_ptr<const TimeFunction> motion);

  double value() const { return value_; }
  bool is_frozen() const { return frozen_; }
  const std::string& name() const { return name_; }
  double min() const { return min_; }
  double max() const { return max_; }
  const std::shared_ptr<const TimeFunction>& motion() const { return motion_; }

 private:
  double value_ = 0;
  bool frozen_ = false;
  std::string name_;
  double min_ = -std::numeric_limits<double>::infinity();
  double max_ = std::numeric_limits<double>::infinity();
  std::shared_ptr<const TimeFunction> motion_;
};

using Number3 = std::array<Number, 3>;

/// What a slot of a primitive is called and measures.
struct SlotInfo {
  std::string_view name;
  Quantity quantity;
  double min = -std::numeric_limits<double>::infinity();  ///< natural bound, such as 0 for a radius
};

/// The numbers of a leaf: `items` primitives with `infos.size()` slots each, kept as one array per slot so that kernels can
/// load them by packets. Knows which slots are unknowns and which are animated.
class Slots {
 public:
  Slots(std::span<const SlotInfo> infos, std::size_t items);

  /// Sets slot `slot` of `item`. `path` names it when it is an unknown of its own.
  /// Throws InvalidInput when a shared name comes with two different values.
  void bind(std::size_t item, std::size_t slot, const Number& number, std::string path);
  /// Sets a number that is no unknown, with a rate of change per second: for particles.
  void fix(std::size_t item, std::size_t slot, double value, double rate);

  const std::vector<Parameter>& parameters() const { return parameters_; }
  /// Writes the unknowns (and their rates per second; none = 0) into the slots that read them.
  void set_parameters(std::span<const double> values, std::span<const double> rates);
  /// Moves animated slots to time t. Returns whether any slot changed.
  bool set_time(double t);

  std::size_t items() const { return items_; }
  std::size_t slots() const { return values_.size(); }
  const double* values(std::size_t slot) const { return values_[slot].data(); }
  const double* rates(std::size_t slot) const { return rates_[slot].data(); }
  double value(std::size_t item, std::size_t slot) const { return values_[slot][item]; }
  double rate(std::size_t item, std::size_t slot) const { return rates_[slot][item]; }
  /// Whether any slot has a rate other than zero.
  bool moving() const { return moving_; }
  /// Index into parameters() of the unknown that a slot reads; nothing when it reads none.
  std::optional<std::uint32_t> unknown(std::size_t item, std::size_t slot) const;

 private:
  struct Reader {
    std::uint32_t item;
    std::uint32_t slot;
    std::uint32_t parameter;
  };
  struct Animated {
    std::uint32_t item;
    std::uint32_t slot;
    std::shared_ptr<const TimeFunction> motion;
  };
  std::uint32_t parameter_index(const Number& number, const SlotInfo& info, std::string path);
  void update_moving();

  std::vector<SlotInfo> infos_;
  std::size_t items_;
  std::vector<std::vector<double>> values_;          // [slot][item]
  std::vector<std::vector<double>> rates_;           // [slot][item]
  std::vector<std::vector<std::uint32_t>> unknown_;  // [slot][item], kNone; empty until the first unknown
  std::vector<Parameter> parameters_;
  std::vector<std::uint32_t> shared_;  // the named ones among parameters_
  std::vector<Reader> readers_;
  std::vector<Animated> animated_;
  bool moving_ = false;
};

}  // namespace meniscus::field
