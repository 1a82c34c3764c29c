#include <meniscus/pointset/sculpt_grid.h>

#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace meniscus::pointset {
namespace {

constexpr std::size_t kMostVoxels = std::size_t{1} << 27;

/// Σ a b, in eight fixed lanes so that the order of additions does not depend on the machine.
double dot(const float* a, const float* b, std::size_t n) {
  double lanes[8] = {};
  std::size_t i = 0;
  for (; i + 8 <= n; i += 8)
    for (std::size_t l = 0; l < 8; ++l) lanes[l] += static_cast<double>(a[i + l]) * static_cast<double>(b[i + l]);
  for (; i < n; ++i) lanes[i % 8] += static_cast<double>(a[i]) * static_cast<double>(b[i]);
  return ((lanes[0] + lanes[4]) + (lanes[1] + lanes[5])) + ((lanes[2] + lanes[6]) + (lanes[3] + lanes[7]));
}

double sum_of(const std::vector<double>& parts) {
  double total = 0;
  for (const double p : parts) total += p;
  return total;
}

}  // namespace

void check(const Material& m) {
  if (!(m.mass > 0) || !(m.damping >= 0) || !(m.stiffness >= 0) || !std::isfinite(m.mass + m.damping + m.stiffness))
    throw InvalidInput("a material needs a mass above 0 and a damping and a stiffness of 0 or more, all finite");
}

SculptGrid::SculptGrid(const Box& region, int voxels, const Material& material) {
  check(material);
  if (region.empty() || !region.finite() || !(region.size().maxCoeff() > 0))
    throw InvalidInput("a sculpting region must be a box with an extent");
  if (voxels < 4 || voxels > 512) throw InvalidInput("a sculpting region has 4 to 512 voxels along its longest side");
  voxel_ = region.size().maxCoeff() / (voxels - 1);
  for (int a = 0; a < 3; ++a)
    count_[static_cast<std::size_t>(a)] = std::max(4, static_cast<int>(std::ceil(region.size()[a] / voxel_ - 1e-9)) + 1);
  per_voxel_ = 1 / voxel_;
  const Vec3 extent(count_[0] - 1, count_[1] - 1, count_[2] - 1);
  origin_ = region.center() - 0.5 * voxel_ * extent;
  slab_ = static_cast<std::size_t>(count_[1]) * static_cast<std::size_t>(count_[2]);
  const std::size_t n = slab_ * static_cast<std::size_t>(count_[0]);
  if (n > kMostVoxels) throw ResourceLimit("a sculpting region of " + std::to_string(n) + " voxels is too large");
  for (auto* v : {&base_, &value_, &deviation_, &rate_, &load_, &residual_, &direction_, &image_, &solution_, &diagonal_,
                  &springs_[0], &springs_[1], &springs_[2]})
    v->assign(n, 0.0F);
  mass_.assign(n, static_cast<float>(material.mass));
  damping_.assign(n, static_cast<float>(material.damping));
  stiffness_.assign(n, static_cast<float>(material.stiffness));
  free_.assign(n, 0.0F);
  for (int i = 1; i + 1 < count_[0]; ++i)
    for (int j = 1; j + 1 < count_[1]; ++j)
      std::fill_n(free_.begin() + (static_cast<std::ptrdiff_t>(i) * count_[1] + j) * count_[2] + 1, count_[2] - 2, 1.0F);
}

Vec3 SculptGrid::position(std::size_t number) const {
  const auto n2 = static_cast<std::size_t>(count_[2]);
  const auto i = number / slab_, j = number % slab_ / n2, k = number % n2;
  return origin_ + voxel_ * Vec3(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
}

Box SculptGrid::bounds() const { return {origin_, position(size() - 1)}; }

void SculptGrid::set_base(std::span<const double> values) {
  if (values.size() != size()) throw InvalidInput("a sculpting region needs one value a voxel");
  std::transform(values.begin(), values.end(), base_.begin(), [](double v) { return static_cast<float>(v); });
  for (std::size_t i = 0; i < size(); ++i) value_[i] = base_[i] + deviation_[i];
}

void SculptGrid::settle() {
  base_ = value_;
  std::fill(deviation_.begin(), deviation_.end(), 0.0F);
}

void SculptGrid::set_material(std::size_t number, const Material& material) {
  check(material);
  mass_[number] = static_cast<float>(material.mass);
  damping_[number] = static_cast<float>(material.damping);
  stiffness_[number] = static_cast<float>(material.stiffness);
  prepared_ = 0;
}

void SculptGrid::scale(double factor) {
  for (auto* v : {&load_, &deviation_, &rate_})
    for (float& x : *v) x = static_cast<float>(x * factor);
  for (std::size_t i = 0; i < size(); ++i) value_[i] = base_[i] + deviation_[i];
}

void SculptGrid::reset() {
  std::fill(deviation_.begin(), deviation_.end(), 0.0F);
  std::fill(rate_.begin(), rate_.end(), 0.0F);
  value_ = base_;
}

// The matrix of a step, M + h D + h² K: its diagonal without the springs' part, and h² times the springs.
void SculptGrid::prepare(double seconds) {
  if (prepared_ == seconds) return;
  prepared_ = seconds;
  const double spring = seconds * seconds / (voxel_ * voxel_);
  const std::size_t next[3] = {slab_, static_cast<std::size_t>(count_[2]), 1};
  for (std::size_t i = 0; i < size(); ++i) {
    diagonal_[i] = static_cast<float>(mass_[i] + seconds * damping_[i]);
    for (int a = 0; a < 3; ++a)
      springs_[a][i] =
          i + next[a] < size() ? static_cast<float>(0.5 * spring * (stiffness_[i] + stiffness_[i + next[a]])) : 0;
  }
}

// out = matrix · x in one slab, for x that is zero where voxels are held. Returns x · out there.
double SculptGrid::apply(std::size_t slab, const float* x, float* out) const {
  const auto n2 = static_cast<std::size_t>(count_[2]);
  double product = 0;
  for (std::size_t j = 1; j + 1 < static_cast<std::size_t>(count_[1]); ++j) {
    const std::size_t row = slab * slab_ + j * n2;
    const float *c = x + row, *back = c - slab_, *front = c + slab_, *below = c - n2, *above = c + n2;
    const float *sx = springs_[0].data() + row, *sx0 = sx - slab_, *sy = springs_[1].data() + row, *sy0 = sy - n2;
    const float *sz = springs_[2].data() + row, *d = diagonal_.data() + row, *free = free_.data() + row;
    float* o = out + row;
    for (std::size_t k = 1; k + 1 < n2; ++k) {
      const float pull = sx0[k] * (c[k] - back[k]) + sx[k] * (c[k] - front[k]) + sy0[k] * (c[k] - below[k]) +
                         sy[k] * (c[k] - above[k]) + sz[k - 1] * (c[k] - c[k - 1]) + sz[k] * (c[k] - c[k + 1]);
      o[k] = free[k] * (d[k] * c[k] + pull);
    }
    product += dot(c + 1, o + 1, n2 - 2);
  }
  return product;
}

int SculptGrid::step(double seconds, const RunControl& run, double tolerance, int most) {
  if (!(seconds > 0) || !std::isfinite(seconds)) throw InvalidInput("a time step must be positive and finite");
  prepare(seconds);
  const auto slabs = static_cast<std::size_t>(count_[0]);
  std::vector<double> part(slabs, 0.0);
  const auto over_slabs = [&](const auto& work) {
    parallel_for(slabs - 2, 1, run, [&](std::size_t s) { part[s + 1] = work(s + 1, (s + 1) * slab_); });
    return sum_of(part);
  };
  // Right side: momentum, load, and the springs as stretched: b = M v + h f − h K u. K u comes from the matrix itself.
  const auto h = static_cast<float>(seconds);
  double norm2 = over_slabs([&](std::size_t s, std::size_t first) {
    apply(s, deviation_.data(), image_.data());
    for (std::size_t i = first; i < first + slab_; ++i) {
      const float stretched = (image_[i] - diagonal_[i] * deviation_[i]) / h;
      residual_[i] = free_[i] * (mass_[i] * rate_[i] + h * load_[i] - stretched);
      direction_[i] = residual_[i];
      solution_[i] = 0;
    }
    return dot(residual_.data() + first, residual_.data() + first, slab_);
  });
  const double goal = norm2 * tolerance * tolerance;
  int iterations = 0;
  for (; iterations < most && norm2 > goal; ++iterations) {
    const double curvature =
        over_slabs([&](std::size_t s, std::size_t) { return apply(s, direction_.data(), image_.data()); });
    if (!(curvature > 0)) break;
    const auto alpha = static_cast<float>(norm2 / curvature);
    const double next2 = over_slabs([&](std::size_t, std::size_t first) {
      for (std::size_t i = first; i < first + slab_; ++i) {
        solution_[i] += alpha * direction_[i];
        residual_[i] -= alpha * image_[i];
      }
      return dot(residual_.data() + first, residual_.data() + first, slab_);
    });
    const auto beta = static_cast<float>(next2 / norm2);
    norm2 = next2;
    over_slabs([&](std::size_t, std::size_t first) {
      for (std::size_t i = first; i < first + slab_; ++i) direction_[i] = residual_[i] + beta * direction_[i];
      return 0.0;
    });
  }
  over_slabs([&](std::size_t, std::size_t first) {
    for (std::size_t i = first; i < first + slab_; ++i) {
      rate_[i] = solution_[i];
      deviation_[i] += h * solution_[i];
      value_[i] = base_[i] + deviation_[i];
    }
    return 0.0;
  });
  return iterations;
}

double SculptGrid::energy() const {
  const std::size_t next[3] = {slab_, static_cast<std::size_t>(count_[2]), 1};
  double total = 0;
  for (std::size_t i = 0; i < size(); ++i) {
    total += 0.5 * mass_[i] * static_cast<double>(rate_[i]) * static_cast<double>(rate_[i]);
    for (const std::size_t n : next) {
      if (i + n >= size()) continue;
      const double stretch = (static_cast<double>(deviation_[i + n]) - static_cast<double>(deviation_[i])) / voxel_;
      total += 0.25 * (stiffness_[i] + stiffness_[i + n]) * stretch * stretch;
    }
  }
  return total;
}

SculptGrid::Cell SculptGrid::cell(const Vec3& place) const {
  Cell cell{0, {}};
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Eigen::Index>(a);
    const double most = count_[a] - 1;
    const double x = std::clamp((place[axis] - origin_[axis]) * per_voxel_, 0.0, most);
    const int low = std::min(static_cast<int>(x), count_[a] - 2);
    cell.corner = cell.corner * static_cast<std::size_t>(count_[a]) + static_cast<std::size_t>(low);
    cell.share[a] = static_cast<float>(x - low);
  }
  return cell;
}

}  // namespace meniscus::pointset
