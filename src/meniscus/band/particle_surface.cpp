#include <meniscus/band/kernels.h>
#include <meniscus/band/particle_surface.h>
#include <meniscus/band/redistance.h>
#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace meniscus::band {
namespace {

constexpr std::size_t kGroup = 64;          // points that share one list of candidates
constexpr double kThreshold = 27.0 / 64.0;  // (1 - 1/4)³: a lone blob's value at its radius

double largest(const std::vector<double>& v) { return v.empty() ? 1 : *std::max_element(v.begin(), v.end()); }

double squared_distance(const Box& box, const Vec3& p) {
  return ((box.min - p).cwiseMax(p - box.max).cwiseMax(0.0)).squaredNorm();
}

/// Cuts points into runs for one list of candidates each: they end where the next point is farther than `near` from the
/// first. Begins of the runs, and the end.
std::vector<std::size_t> groups(const field::Positions& x, double near) {
  std::vector<std::size_t> begin;
  for (std::size_t i = 0; i < x.size; ++i)
    if (i == 0 || i - begin.back() == kGroup || (x[i] - x[begin.back()]).squaredNorm() > near * near) begin.push_back(i);
  begin.push_back(x.size);
  return begin;
}

/// A skin of so many bricks does not fit.
[[noreturn]] void refuse(double voxel, double bricks, std::size_t max_bricks) {
  const auto gigabytes = [](double n) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.3g GB", n * kBytesPerBrick / 1e9);
    return std::string(text.data());
  };
  std::array<char, 32> size{};
  std::snprintf(size.data(), size.size(), "%.6g", voxel);
  throw ResourceLimit("a voxel of " + std::string(size.data()) + " needs about " + gigabytes(bricks) +
                      " of memory, more than the " + gigabytes(static_cast<double>(max_bricks)) + " allowed");
}

}  // namespace

/// Candidates of one group of points, relative to its middle, and room for the sums.
struct ParticleSurface::Lanes {
  Vec3 middle = Vec3::Zero();
  std::vector<float> x, y, z, radius, weight;
  std::vector<std::array<float, 6>> metric;
  std::vector<float> metric_rows;
};

ParticleSurface::ParticleSurface(const ParticleState& p, const ParticleSurfaceOptions& options, const RunControl& run)
    : options_(options), cells_({}, 1) {
  if (!(options.support > 1)) throw InvalidInput("a kernel's support must exceed the radius");
  const double factor = options.kernel == ParticleKernel::Averaged ? options.support : 2;
  const ParticleCells all(p.position, std::max(factor, 2.0) * largest(p.radius));
  std::vector<char> counts(p.size(), 0);
  parallel_for(all.order().size(), 256, run, [&](std::size_t n) {
    const std::uint32_t i = all.order()[n];
    int others = options.min_neighbours > 0 ? -1 : 0;
    const double within = 4 * p.radius[i] * p.radius[i];
    if (options.min_neighbours > 0)
      all.for_runs(Box::around(p.position[i], 0), [&](std::size_t begin, std::size_t end) {
        for (std::size_t m = begin; m < end; ++m)
          others += (p.position[all.order()[m]] - p.position[i]).squaredNorm() <= within;
      });
    counts[i] = others >= options.min_neighbours;
  });
  for (const std::uint32_t i : all.order()) {
    if (counts[i] == 0) continue;
    position_.push_back(p.position[i]);
    radius_.push_back(p.radius[i]);
    weight_.push_back(p.weight[i]);
    support_.push_back(factor * p.radius[i]);
  }
  strays_ = p.size() - position_.size();
  if (options.kernel == ParticleKernel::Anisotropic) stretch(run);
  cells_ = ParticleCells(position_, largest(support_));
}

void ParticleSurface::stretch(const RunControl& run) {
  const double reach = 2 * largest(support_);
  const ParticleCells cells(position_, reach);
  std::vector<Vec3> smooth = position_;
  metric_.resize(position_.size());
  parallel_for(position_.size(), 64, run, [&](std::size_t i) {
    const double range = 2 * support_[i];
    double sum = 0;
    int neighbours = 0;
    Vec3 mean = Vec3::Zero();
    Mat3 square = Mat3::Zero();
    cells.for_runs(Box::around(position_[i], 0), [&](std::size_t begin, std::size_t end) {
      for (std::size_t m = begin; m < end; ++m) {
        const Vec3 d = position_[cells.order()[m]] - position_[i];
        const double q = d.norm() / range;
        if (q >= 1) continue;
        const double w = 1 - q * q * q;
        sum += w;
        mean += w * d;
        square += w * d * d.transpose();
        ++neighbours;
      }
    });
    mean /= sum;
    const Mat3 covariance = square / sum - mean * mean.transpose();
    Vec3 axis = Vec3::Ones();
    Mat3 frame = Mat3::Identity();
    if (neighbours > 24) {
      const Eigen::SelfAdjointEigenSolver<Mat3> eigen(covariance);
      frame = eigen.eigenvectors();
      const Vec3 spread = eigen.eigenvalues().cwiseMax(1e-12 * range * range).cwiseSqrt();
      // Axes in proportion to the spread, at most 4 : 1, and of unchanged volume.
      axis = spread.cwiseMax(spread.maxCoeff() / 4);
      axis /= std::cbrt(axis.prod());
      smooth[i] = position_[i] + 0.9 * mean;
    }
    const double longest = axis.maxCoeff();
    if (longest > 1.5) axis *= 1.5 / longest;  // so that supports stay near the cells' edge
    const Mat3 g = frame * (axis * (support_[i])).cwiseAbs2().cwiseInverse().asDiagonal() * frame.transpose();
    const auto f = [](double v) { return static_cast<float>(v); };
    metric_[i] = {f(g(0, 0)), f(g(0, 1)), f(g(0, 2)), f(g(1, 1)), f(g(1, 2)), f(g(2, 2))};
  });
  position_.swap(smooth);
  for (double& s : support_) s *= 1.5;
}

void ParticleSurface::gather(const Box& box, Lanes& lanes) const {
  lanes.middle = box.center();
  for (auto* v : {&lanes.x, &lanes.y, &lanes.z, &lanes.radius, &lanes.weight, &lanes.metric_rows}) v->clear();
  lanes.metric.clear();
  const bool round = options_.kernel == ParticleKernel::Averaged;
  cells_.for_runs(box, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const std::uint32_t i = cells_.order()[n];
      const double s = support_[i];
      if (squared_distance(box, position_[i]) >= s * s) continue;
      const Vec3 d = position_[i] - lanes.middle;
      lanes.x.push_back(static_cast<float>(d.x()));
      lanes.y.push_back(static_cast<float>(d.y()));
      lanes.z.push_back(static_cast<float>(d.z()));
      lanes.radius.push_back(static_cast<float>(radius_[i]));
      lanes.weight.push_back(static_cast<float>(weight_[i]));
      const float g = static_cast<float>(1 / (s * s));
      if (round)
        lanes.metric_rows.push_back(g);
      else
        lanes.metric.push_back(metric_.empty() ? std::array<float, 6>{g, 0, 0, g, 0, g} : metric_[i]);
    }
  });
  if (round) return;
  const std::size_t n = lanes.x.size();
  lanes.metric_rows.resize(6 * n);
  for (std::size_t r = 0; r < 6; ++r)
    for (std::size_t i = 0; i < n; ++i) lanes.metric_rows[r * n + i] = lanes.metric[i][r];
}

void ParticleSurface::distance_of_group(const field::Positions& x, double reach, Lanes& lanes, double* out) const {
  Box box;
  for (std::size_t i = 0; i < x.size; ++i) box.extend(x[i]);
  gather(box, lanes);
  const ParticleLanes view{lanes.x.data(),      lanes.y.data(),           lanes.z.data(), lanes.radius.data(),
                           lanes.weight.data(), lanes.metric_rows.data(), lanes.x.size()};
  const Kernels& kernel = kernels();
  for (std::size_t begin = 0; begin < x.size; begin += 8) {
    float p[3][8], sum[5][8];
    const std::size_t n = std::min<std::size_t>(8, x.size - begin);
    for (std::size_t l = 0; l < 8; ++l) {
      const Vec3 d = x[begin + std::min(l, n - 1)] - lanes.middle;
      for (int a = 0; a < 3; ++a) p[a][l] = static_cast<float>(d[a]);
    }
    if (options_.kernel == ParticleKernel::Averaged)
      kernel.averaged(view, p[0], p[1], p[2], sum[0]);
    else
      kernel.density(view, p[0], p[1], p[2], sum[0]);
    for (std::size_t l = 0; l < n; ++l) {
      double d = reach;
      if (options_.kernel == ParticleKernel::Averaged) {
        const double w = static_cast<double>(sum[0][l]);
        if (w > 1e-12) {
          const Vec3 mean = Vec3(sum[1][l], sum[2][l], sum[3][l]) / w;
          d = (Vec3(p[0][l], p[1][l], p[2][l]) - mean).norm() - static_cast<double>(sum[4][l]) / w;
        }
      } else {
        const double f = kThreshold - static_cast<double>(sum[0][l]);
        const double slope = Vec3(sum[1][l], sum[2][l], sum[3][l]).norm();
        d = std::abs(f) < reach * slope ? f / slope : std::copysign(reach, f);
      }
      out[begin + l] = std::clamp(d, -reach, reach);
    }
  }
}

std::vector<char> ParticleSurface::covers(const field::Positions& x, double scale, const RunControl& run) const {
  std::vector<char> out(x.size, 0);
  const double reach = scale * largest(radius_);
  const std::vector<std::size_t> begin = groups(x, 0.5 * cells_.cell());
  parallel_for(begin.size() - 1, 16, run, [&](std::size_t g) {
    Box box;
    for (std::size_t i = begin[g]; i < begin[g + 1]; ++i) box.extend(x[i]);
    std::size_t open = begin[g + 1] - begin[g];
    const auto check = [&](std::size_t first, std::size_t last) {
      for (std::size_t n = first; n < last && open > 0; ++n) {
        const std::uint32_t p = cells_.order()[n];
        const double r2 = scale * scale * radius_[p] * radius_[p];
        if (squared_distance(box, position_[p]) > r2) continue;
        for (std::size_t i = begin[g]; i < begin[g + 1]; ++i)
          if (out[i] == 0 && (x[i] - position_[p]).squaredNorm() <= r2) {
            out[i] = 1;
            --open;
          }
      }
    };
    cells_.for_runs(box, 0, check);  // mostly what is near covers all
    if (open > 0) cells_.for_runs(box, reach, check);
  });
  return out;
}

void ParticleSurface::distance(const field::Positions& x, double reach, std::span<double> out, const RunControl& run) const {
  const std::vector<std::size_t> begin = groups(x, cells_.cell());
  parallel_blocks(begin.size() - 1, 16, run, [&](std::size_t first, std::size_t last) {
    Lanes lanes;
    for (std::size_t g = first; g < last; ++g)
      distance_of_group(x.part(begin[g], begin[g + 1] - begin[g]), reach, lanes, out.data() + begin[g]);
  });
}

void ParticleSurface::sphere_distance(const field::Positions& x, double scale, double reach, std::span<double> out,
                                      const RunControl& run) const {
  parallel_blocks(x.size, kGroup, run, [&](std::size_t begin, std::size_t end) {
    Box box;
    for (std::size_t i = begin; i < end; ++i) {
      box.extend(x[i]);
      out[i] = reach;
    }
    cells_.for_runs(box, [&](std::size_t first, std::size_t last) {
      for (std::size_t n = first; n < last; ++n) {
        const std::uint32_t p = cells_.order()[n];
        for (std::size_t i = begin; i < end; ++i)
          out[i] = std::min(out[i], (x[i] - position_[p]).norm() - scale * radius_[p]);
      }
    });
  });
}

Band ParticleSurface::band(double voxel, std::size_t max_bricks, const RunControl& run) const {
  const double side = 8 * voxel;
  std::vector<Coord> bricks;
  const auto brick_at = [&](double v) { return static_cast<std::int32_t>(std::clamp(std::floor(v / side), -1e9, 1e9)); };
  for (const Box& cell : cells_.boxes()) {
    const Box box = cell.padded(cells_.cell());
    const Vec3 count = box.size() / side + Vec3::Constant(2);
    if (static_cast<double>(bricks.size()) + count.prod() > 30.0 * static_cast<double>(max_bricks))
      refuse(voxel, static_cast<double>(cells_.boxes().size()) * (cells_.boxes()[0].size() / side).prod(), max_bricks);
    for (std::int32_t i = brick_at(box.min.x()); i <= brick_at(box.max.x()); ++i)
      for (std::int32_t j = brick_at(box.min.y()); j <= brick_at(box.max.y()); ++j)
        for (std::int32_t k = brick_at(box.min.z()); k <= brick_at(box.max.z()); ++k) bricks.push_back({i, j, k});
    if (bricks.size() > 4 * max_bricks) {
      std::sort(bricks.begin(), bricks.end());
      bricks.erase(std::unique(bricks.begin(), bricks.end()), bricks.end());
    }
  }
  std::sort(bricks.begin(), bricks.end());
  bricks.erase(std::unique(bricks.begin(), bricks.end()), bricks.end());
  if (bricks.size() > max_bricks) refuse(voxel, static_cast<double>(bricks.size()), max_bricks);

  std::vector<float> values(bricks.size() * Band::kBrickNodes);
  const double reach = Band::kHalfWidth * voxel;
  parallel_blocks(bricks.size(), 4, run, [&](std::size_t first, std::size_t last) {
    Lanes lanes;
    field::PositionBatch x(kGroup);
    std::array<double, kGroup> d{};
    for (std::size_t b = first; b < last; ++b)
      for (int eighth = 0; eighth < 8; ++eighth) {
        const auto node = [&](std::size_t n) {
          return std::array<int, 3>{(eighth >> 2) * 4 + static_cast<int>(n >> 4),
                                    (eighth >> 1 & 1) * 4 + static_cast<int>(n >> 2 & 3),
                                    (eighth & 1) * 4 + static_cast<int>(n & 3)};
        };
        for (std::size_t n = 0; n < kGroup; ++n) {
          const auto [i, j, k] = node(n);
          x.set(n, voxel * Vec3(8.0 * bricks[b][0] + i, 8.0 * bricks[b][1] + j, 8.0 * bricks[b][2] + k));
        }
        distance_of_group(x.view(), reach, lanes, d.data());
        for (std::size_t n = 0; n < kGroup; ++n) {
          const auto [i, j, k] = node(n);
          values[b * Band::kBrickNodes + static_cast<std::size_t>((i * 8 + j) * 8 + k)] = static_cast<float>(d[n]);
        }
      }
  });
  Band band(voxel, Vec3::Zero(), bricks, values);
  band.keep_surface(run);
  redistance(band, run);
  band.adapt(run);
  redistance(band, run);
  return band;
}

}  // namespace meniscus::band
