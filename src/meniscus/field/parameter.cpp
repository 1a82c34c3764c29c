#include <meniscus/base/error.h>
#include <meniscus/field/parameter.h>

#include <algorithm>
#include <utility>

namespace meniscus::field {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

}  // namespace

Number Number::frozen(double value) {
  Number n(value);
  n.frozen_ = true;
  return n;
}

Number Number::named(std::string name, double value, double min, double max) {
  Number n(value);
  n.name_ = std::move(name);
  n.min_ = min;
  n.max_ = max;
  return n;
}

Number Number::animated(std::shared_ptr<const TimeFunction> motion) {
  Number n(motion->at(0).value);
  n.motion_ = std::move(motion);
  return n;
}

Slots::Slots(std::span<const SlotInfo> infos, std::size_t items)
    : infos_(infos.begin(), infos.end()),
      items_(items),
      values_(infos.size(), std::vector<double>(items, 0.0)),
      rates_(infos.size(), std::vector<double>(items, 0.0)) {}

std::uint32_t Slots::parameter_index(const Number& number, const SlotInfo& info, std::string path) {
  if (!number.name().empty()) {
    for (const std::uint32_t i : shared_)
      if (parameters_[i].name == number.name()) {
        if (parameters_[i].value != number.value())
          throw InvalidInput("parameter '" + number.name() + "' is given two values");
        return i;
      }
    shared_.push_back(static_cast<std::uint32_t>(parameters_.size()));
  }
  Parameter p;
  p.shared = !number.name().empty();
  p.name = p.shared ? number.name() : std::move(path);
  p.quantity = info.quantity;
  p.value = number.value();
  p.min = std::max(number.min(), info.min);
  p.max = number.max();
  parameters_.push_back(std::move(p));
  return static_cast<std::uint32_t>(parameters_.size() - 1);
}

void Slots::bind(std::size_t item, std::size_t slot, const Number& number, std::string path) {
  values_[slot][item] = number.value();
  const auto i = static_cast<std::uint32_t>(item);
  const auto s = static_cast<std::uint32_t>(slot);
  if (number.motion()) {
    animated_.push_back({i, s, number.motion()});
    const auto sample = number.motion()->at(0);
    values_[slot][item] = sample.value;
    rates_[slot][item] = sample.rate;
    moving_ = true;
  } else if (!number.is_frozen()) {
    const std::uint32_t p = parameter_index(number, infos_[slot], std::move(path));
    readers_.push_back({i, s, p});
    if (unknown_.empty()) unknown_.assign(infos_.size(), std::vector<std::uint32_t>(items_, kNone));
    unknown_[slot][item] = p;
  }
}

void Slots::fix(std::size_t item, std::size_t slot, double value, double rate) {
  values_[slot][item] = value;
  rates_[slot][item] = rate;
  moving_ = moving_ || rate != 0;
}

void Slots::set_parameters(std::span<const double> values, std::span<const double> rates) {
  for (std::size_t i = 0; i < parameters_.size(); ++i) parameters_[i].value = values[i];
  for (const Reader& r : readers_) {
    values_[r.slot][r.item] = values[r.parameter];
    rates_[r.slot][r.item] = rates.empty() ? 0 : rates[r.parameter];
  }
  update_moving();
}

bool Slots::set_time(double t) {
  for (const Animated& a : animated_) {
    const auto sample = a.motion->at(t);
    values_[a.slot][a.item] = sample.value;
    rates_[a.slot][a.item] = sample.rate;
  }
  return !animated_.empty();
}

std::optional<std::uint32_t> Slots::unknown(std::size_t item, std::size_t slot) const {
  if (unknown_.empty() || unknown_[slot][item] == kNone) return std::nullopt;
  return unknown_[slot][item];
}

void Slots::update_moving() {
  moving_ = !animated_.empty();
  for (const auto& row : rates_) moving_ = moving_ || std::any_of(row.begin(), row.end(), [](double r) { return r != 0; });
}

}  // namespace meniscus::field
