#include <meniscus/band/far_distance.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace meniscus::band {

FarDistance::FarDistance(const field::Field& field, double voxel, const Box& box, const RunControl& run)
    : fine_(band_of(field, voxel, box, 1u << 20, run)),
      cell_(std::max(voxel, box.size().maxCoeff() / 80)),
      origin_(box.min) {
  for (int a = 0; a < 3; ++a) n_[a] = static_cast<int>(std::ceil(box.size()[a] / cell_)) + 1;
  const field::PositionBatch x = nodes();
  field::JetBatch jets(x.x.size(), field::Order::Value);
  field::evaluate(field, x.view(), jets.view(), run);
  d_.resize(x.x.size());
  // Nodes that the fine band knows, and nodes beside a change of sign, are the source; the rest follows by sweeping.
  constexpr double kFar = std::numeric_limits<double>::infinity();
  parallel_for(d_.size(), 1024, run, [&](std::size_t i) {
    bool known = false;
    const double near = fine_.sample(x.view()[i], &known);
    d_[i] =
        known && std::abs(near) < 0.99 * static_cast<double>(fine_.background()) ? near : std::copysign(kFar, jets.value(i));
  });
  sweep();
}

field::PositionBatch FarDistance::nodes() const {
  field::PositionBatch x(static_cast<std::size_t>(n_[0]) * static_cast<std::size_t>(n_[1]) *
                         static_cast<std::size_t>(n_[2]));
  for (int i = 0; i < n_[0]; ++i)
    for (int j = 0; j < n_[1]; ++j)
      for (int k = 0; k < n_[2]; ++k) x.set(number(i, j, k), origin_ + cell_ * Vec3(i, j, k));
  return x;
}

/// First-order fast sweeping on |d|; the sources keep their values because nothing is smaller.
void FarDistance::sweep() {
  std::vector<double> u(d_.size());
  for (std::size_t i = 0; i < u.size(); ++i) u[i] = std::abs(d_[i]);
  const auto nearest = [&](int i, int j, int k, int axis) {
    int p[3] = {i, j, k};
    double best = std::numeric_limits<double>::infinity();
    for (const int step : {-1, 1}) {
      p[axis] += step;
      if (p[axis] >= 0 && p[axis] < n_[axis]) {
        const std::size_t m = number(p[0], p[1], p[2]);
        // Across the surface a coarse neighbour's distance counts as zero: the surface lies between.
        best = std::min(best, std::signbit(d_[m]) == std::signbit(d_[number(i, j, k)]) ? u[m] : 0.0);
      }
      p[axis] -= step;
    }
    return best;
  };
  for (int round = 0; round < 2; ++round)
    for (int corner = 0; corner < 8; ++corner)
      for (int a = 0; a < n_[0]; ++a)
        for (int b = 0; b < n_[1]; ++b)
          for (int c = 0; c < n_[2]; ++c) {
            const int i = corner & 1 ? n_[0] - 1 - a : a, j = corner & 2 ? n_[1] - 1 - b : b,
                      k = corner & 4 ? n_[2] - 1 - c : c;
            double s[3] = {nearest(i, j, k, 0), nearest(i, j, k, 1), nearest(i, j, k, 2)};
            std::sort(s, s + 3);
            double v = s[0] + cell_;
            if (v > s[1])
              v = 0.5 * (s[0] + s[1] + std::sqrt(std::max(2 * cell_ * cell_ - (s[0] - s[1]) * (s[0] - s[1]), 0.0)));
            if (v > s[2]) {
              const double sum = s[0] + s[1] + s[2];
              const double squares = s[0] * s[0] + s[1] * s[1] + s[2] * s[2];
              v = (sum + std::sqrt(std::max(sum * sum - 3 * (squares - cell_ * cell_), 0.0))) / 3;
            }
            double& here = u[number(i, j, k)];
            if (v < here) here = v;
          }
  const double most = cell_ * (n_[0] + n_[1] + n_[2]);
  for (std::size_t i = 0; i < u.size(); ++i) d_[i] = std::copysign(std::min(u[i], most), d_[i]);
}

double FarDistance::at(const Vec3& x) const {
  bool known = false;
  const double near = fine_.sample(x, &known);
  const double limit = static_cast<double>(fine_.background());
  if (known && std::abs(near) < 0.75 * limit) return near;
  double f[3];
  int low[3];
  for (int a = 0; a < 3; ++a) {
    const double c = std::clamp((x[a] - origin_[a]) / cell_, 0.0, n_[a] - 1.0);
    low[a] = std::min(static_cast<int>(c), std::max(n_[a] - 2, 0));
    f[a] = c - low[a];
  }
  double sum = 0;
  for (int q = 0; q < 8; ++q) {
    const int a = q >> 2, b = q >> 1 & 1, c = q & 1;
    const double w = (a ? f[0] : 1 - f[0]) * (b ? f[1] : 1 - f[1]) * (c ? f[2] : 1 - f[2]);
    if (w > 0) sum += w * d_[number(low[0] + a, low[1] + b, low[2] + c)];
  }
  // The coarse grid may not contradict the band about the side, nor about being far.
  if (!known) return sum;
  return std::copysign(std::max(std::abs(sum), std::abs(near)), near);
}

std::vector<FarDistance::Deep> FarDistance::untouched(const std::vector<double>& other) const {
  std::vector<char> seen(d_.size(), 0);
  std::vector<Deep> out;
  std::vector<std::array<int, 3>> stack;
  for (int i = 0; i < n_[0]; ++i)
    for (int j = 0; j < n_[1]; ++j)
      for (int k = 0; k < n_[2]; ++k) {
        if (seen[number(i, j, k)] != 0 || !(d_[number(i, j, k)] < 0)) continue;
        bool touched = false;
        Deep deep{Vec3::Zero(), 0};
        stack.assign(1, {i, j, k});
        seen[number(i, j, k)] = 1;
        while (!stack.empty()) {
          const std::array<int, 3> p = stack.back();
          stack.pop_back();
          const std::size_t at = number(p[0], p[1], p[2]);
          touched |= other[at] < 0;
          if (-d_[at] > deep.depth) deep = {origin_ + cell_ * Vec3(p[0], p[1], p[2]), -d_[at]};
          for (std::size_t a = 0; a < 3; ++a)
            for (const int step : {-1, 1}) {
              std::array<int, 3> q = p;
              q[a] += step;
              if (q[a] < 0 || q[a] >= n_[a]) continue;
              const std::size_t m = number(q[0], q[1], q[2]);
              if (seen[m] == 0 && d_[m] < 0) {
                seen[m] = 1;
                stack.push_back(q);
              }
            }
        }
        if (!touched) out.push_back(deep);
      }
  return out;
}

}  // namespace meniscus::band
