#include <meniscus/field/grid_field.h>

#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace meniscus::field {

namespace {

constexpr double kFarthestVoxel = 2e9;      // beyond it indices leave int32; no brick is there
constexpr std::size_t kBlockOfBricks = 16;  // bricks per parallel block

// ---- one point
// ------------------------------------------------------------------------------------------------------------

/// The up to 8 bricks that a stencil touches, kept from point to point: neighbours in a batch mostly need the same.
class Window {
 public:
  explicit Window(const Grid& grid) : grid_(grid) {}

  void move_to(const Coord& low) {
    if (valid_ && low == low_) return;
    low_ = low;
    valid_ = true;
    known_.fill(false);
  }
  const Grid::View& at(int i, int j, int k) {
    const auto n = static_cast<std::size_t>(4 * i + 2 * j + k);
    if (!known_[n]) {
      views_[n] = grid_.view({low_[0] + i, low_[1] + j, low_[2] + k});
      known_[n] = true;
    }
    return views_[n];
  }

 private:
  const Grid& grid_;
  Coord low_{};
  bool valid_ = false;
  std::array<bool, 8> known_{};
  std::array<Grid::View, 8> views_;
};

/// The samples under a stencil of N taps per axis, k fastest. Returns whether any of them lies in a brick.
template <int N>
bool gather(Window& window, const Coord& first, double* c) {
  window.move_to(Grid::brick_of(first));
  const int o[3] = {first[0] & 7, first[1] & 7, first[2] & 7};
  const int lower = std::min(N, Grid::kBrick - o[2]);  // taps in the lower brick of z
  bool any = false;
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < N; ++j) {
      const int x = o[0] + i, y = o[1] + j;
      double* row = c + (i * N + j) * N;
      const Grid::View& low = window.at(x >> 3, y >> 3, 0);
      for (int k = 0; k < lower; ++k) row[k] = low.value(x & 7, y & 7, o[2] + k);
      any = any || low.samples;
      if (lower == N) continue;
      const Grid::View& high = window.at(x >> 3, y >> 3, 1);
      for (int k = lower; k < N; ++k) row[k] = high.value(x & 7, y & 7, o[2] + k - Grid::kBrick);
      any = any || high.samples;
    }
  return any;
}

/// B-spline weights of degree N-1 and their derivatives at fraction t of a voxel.
template <int N>
struct Weights;

template <>
struct Weights<2> {
  Weights(double t, double per_voxel) : w{{1 - t, t}, {-per_voxel, per_voxel}, {0, 0}} {}
  double w[3][2];
};

template <>
struct Weights<4> {
  Weights(double t, double per_voxel) {
    const double s = 1 - t, p = per_voxel, q = p * p;
    const double cube = t * t * t / 6, anti = s * s * s / 6;
    const double w1 = (2.0 / 3.0) - t * t + 3 * cube;
    const double value[4] = {anti, w1, 1 - anti - w1 - cube, cube};
    const double first[4] = {-0.5 * s * s * p, (1.5 * t * t - 2 * t) * p, (0.5 + t - 1.5 * t * t) * p, 0.5 * t * t * p};
    const double second[4] = {s * q, (3 * t - 2) * q, (1 - 3 * t) * q, t * q};
    std::copy_n(value, 4, w[0]);
    std::copy_n(first, 4, w[1]);
    std::copy_n(second, 4, w[2]);
  }
  double w[3][4];
};

/// Σ_i w_i c[i][·] for an array of N rows of M numbers.
template <int N, int M>
void contract(const double* w, const double* c, double* result) {
  for (int m = 0; m < M; ++m) result[m] = w[0] * c[m];
  for (int i = 1; i < N; ++i)
    for (int m = 0; m < M; ++m) result[m] += w[i] * c[i * M + m];
}

/// Contracts axis by axis; `out[a][b][c]` for derivative orders a + b + c <= D in x, y, z.
template <int N, int D>
void tensor(const double* c, const Weights<N>& x, const Weights<N>& y, const Weights<N>& z, double (&out)[3][3][3]) {
  for (int a = 0; a <= D; ++a) {
    double plane[N * N];
    contract<N, N * N>(x.w[a], c, plane);
    for (int b = 0; a + b <= D; ++b) {
      double line[N];
      contract<N, N>(y.w[b], plane, line);
      for (int d = 0; a + b + d <= D; ++d) contract<N, 1>(z.w[d], line, &out[a][b][d]);
    }
  }
}

template <int D>
void store(const double (&t)[3][3][3], const JetView& out, std::size_t i) {
  out.row(kF)[i] = t[0][0][0];
  if constexpr (D >= 1) {
    out.row(kFx)[i] = t[1][0][0];
    out.row(kFy)[i] = t[0][1][0];
    out.row(kFz)[i] = t[0][0][1];
  }
  if constexpr (D >= 2) {
    out.row(kFxx)[i] = t[2][0][0];
    out.row(kFxy)[i] = t[1][1][0];
    out.row(kFxz)[i] = t[1][0][1];
    out.row(kFyy)[i] = t[0][2][0];
    out.row(kFyz)[i] = t[0][1][1];
    out.row(kFzz)[i] = t[0][0][2];
  }
}

/// Splits a voxel coordinate into the first tap of a stencil of N and the fraction within the voxel.
template <int N>
std::int32_t first_tap(double u, double& fraction) {
  const double whole = std::floor(u);
  fraction = u - whole;
  return static_cast<std::int32_t>(whole) - (N / 2 - 1);
}

template <int N, int D>
void evaluate_points(const Grid& grid, const Positions& x, const JetView& out) {
  const double per_voxel = 1 / grid.voxel();
  Window window(grid);
  double c[N * N * N];
  for (std::size_t i = 0; i < x.size; ++i) {
    const Vec3 u = (x[i] - grid.origin()) / grid.voxel();
    double t[3][3][3] = {};
    if ((u.array().abs() < kFarthestVoxel).all()) {
      Vec3 f;
      const Coord first{first_tap<N>(u[0], f[0]), first_tap<N>(u[1], f[1]), first_tap<N>(u[2], f[2])};
      const bool any = gather<N>(window, first, c);
      if (any || std::any_of(c + 1, c + N * N * N, [&](double v) { return v != c[0]; }))
        tensor<N, D>(c, {f[0], per_voxel}, {f[1], per_voxel}, {f[2], per_voxel}, t);
      else
        t[0][0][0] = c[0];  // constant: derivatives are exactly zero
    } else {
      t[0][0][0] = grid.background();
    }
    store<D>(t, out, i);
  }
}

template <int N>
void evaluate_points(const Grid& grid, const Positions& x, const JetView& out) {
  if (has_hessian(out.order))
    evaluate_points<N, 2>(grid, x, out);
  else if (has_gradient(out.order))
    evaluate_points<N, 1>(grid, x, out);
  else
    evaluate_points<N, 0>(grid, x, out);
}

// ---- coefficients
// ---------------------------------------------------------------------------------------------------------

constexpr std::int32_t kHalo = Grid::kBrick + 2;  // a brick and one voxel around it

/// A brick with one voxel around it, k fastest.
void gather_halo(const Grid& grid, const Coord& brick, std::vector<float>& block) {
  const std::int32_t begin[3] = {0, 1, 1 + Grid::kBrick}, end[3] = {1, 1 + Grid::kBrick, kHalo};
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      for (int d = 0; d < 3; ++d) {
        const Grid::View view = grid.view({brick[0] + a - 1, brick[1] + b - 1, brick[2] + d - 1});
        for (std::int32_t i = begin[a]; i < end[a]; ++i)
          for (std::int32_t j = begin[b]; j < end[b]; ++j)
            for (std::int32_t k = begin[d]; k < end[d]; ++k)
              block[static_cast<std::size_t>((i * kHalo + j) * kHalo + k)] =
                  view.value((i + 7) & 7, (j + 7) & 7, (k + 7) & 7);
      }
}

/// c = f - δ²f/6 along one axis of a 10³ block, in place; the block's first and last layers become meaningless.
void filter_axis(std::vector<double>& block, std::size_t stride) {
  std::vector<double> f = block;
  for (std::size_t n = stride; n + stride < block.size(); ++n)
    block[n] = f[n] - (f[n - stride] - 2 * f[n] + f[n + stride]) / 6;
}

std::vector<float> spline_coefficients(const Grid& grid, const RunControl& run) {
  std::vector<float> result(grid.bricks().size() * Grid::kBrickVoxels);
  parallel_blocks(grid.bricks().size(), kBlockOfBricks, run, [&](std::size_t begin, std::size_t end) {
    std::vector<float> halo(kHalo * kHalo * kHalo);
    for (std::size_t b = begin; b < end; ++b) {
      gather_halo(grid, grid.bricks()[b], halo);
      std::vector<double> block(halo.begin(), halo.end());
      for (const std::size_t stride : {kHalo * kHalo, kHalo, 1}) filter_axis(block, stride);
      for (std::int32_t i = 0; i < Grid::kBrick; ++i)
        for (std::int32_t j = 0; j < Grid::kBrick; ++j)
          for (std::int32_t k = 0; k < Grid::kBrick; ++k)
            result[b * Grid::kBrickVoxels + Grid::number(i, j, k)] =
                static_cast<float>(block[static_cast<std::size_t>(((i + 1) * kHalo + j + 1) * kHalo + k + 1)]);
    }
  });
  return result;
}

// ---- bounds
// ---------------------------------------------------------------------------------------------------------------

void include(Interval& a, double value) {
  a.lo = std::min(a.lo, value);
  a.hi = std::max(a.hi, value);
}

Interval nothing() { return {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()}; }

Interval range_of(std::span<const float> values) {
  const auto [lo, hi] = std::minmax_element(values.begin(), values.end());
  return {*lo, *hi};
}

/// An inclusive range of voxels or bricks.
struct CoordBox {
  Coord lo, hi;
  double count() const {
    double n = 1;
    for (std::size_t a = 0; a < 3; ++a) n *= std::max(0.0, static_cast<double>(hi[a]) - lo[a] + 1);
    return n;
  }
  std::array<std::size_t, 3> size() const {
    std::array<std::size_t, 3> n;
    for (std::size_t a = 0; a < 3; ++a) n[a] = static_cast<std::size_t>(std::max(0, hi[a] - lo[a] + 1));
    return n;
  }
  bool contains(const Coord& c) const {
    for (std::size_t a = 0; a < 3; ++a)
      if (c[a] < lo[a] || c[a] > hi[a]) return false;
    return true;
  }
};

/// The samples of a box of voxels, k fastest.
std::vector<float> gather_box(const Grid& grid, const CoordBox& voxels) {
  std::vector<float> samples;
  samples.reserve(static_cast<std::size_t>(voxels.count()));
  Window window(grid);
  for (std::int32_t i = voxels.lo[0]; i <= voxels.hi[0]; ++i)
    for (std::int32_t j = voxels.lo[1]; j <= voxels.hi[1]; ++j)
      for (std::int32_t k = voxels.lo[2]; k <= voxels.hi[2]; ++k) {
        window.move_to(Grid::brick_of({i, j, k}));
        samples.push_back(window.at(0, 0, 0).value(i & 7, j & 7, k & 7));
      }
  return samples;
}

/// Largest difference between neighbours along one axis.
double steepest(const std::vector<float>& samples, const std::array<std::size_t, 3>& size, std::size_t axis) {
  const std::array<std::size_t, 3> stride{size[1] * size[2], size[2], 1};
  double most = 0;
  for (std::size_t n = 0; n < samples.size(); ++n)
    if (n / stride[axis] % size[axis] + 1 < size[axis])
      most = std::max(most, std::abs(static_cast<double>(samples[n + stride[axis]]) - samples[n]));
  return most;
}

CoordBox intersection(const CoordBox& a, const CoordBox& b) {
  CoordBox r = a;
  for (std::size_t i = 0; i < 3; ++i) {
    r.lo[i] = std::max(a.lo[i], b.lo[i]);
    r.hi[i] = std::min(a.hi[i], b.hi[i]);
  }
  return r;
}

}  // namespace

struct GridField::Shared {
  std::shared_ptr<const Grid> coefficients;
  std::vector<Interval> bricks;           // range of the coefficients of each
  Interval all;                           // of all bricks and of what lies between them
  double largest;                         // magnitude in `all`
  CoordBox box{{0, 0, 0}, {-1, -1, -1}};  // of brick indices

  Shared(std::shared_ptr<const Grid> c) : coefficients(std::move(c)), all(coefficients->background()) {
    const Grid& g = *coefficients;
    for (std::size_t b = 0; b < g.bricks().size(); ++b) {
      const Coord& at = g.bricks()[b];
      if (b == 0) box = {at, at};
      for (std::size_t a = 0; a < 3; ++a) {
        box.lo[a] = std::min(box.lo[a], at[a]);
        box.hi[a] = std::max(box.hi[a], at[a]);
      }
      bricks.push_back(range_of(g.brick(b)));
      all = hull(all, bricks.back());
    }
    if (all.lo < 0) include(all, -g.background());
    largest = std::max(-all.lo, all.hi);
  }

  /// Range of the coefficients of a box of bricks. Places without one may be either side between bricks.
  Interval of_bricks(const CoordBox& places) const;
};

Interval GridField::Shared::of_bricks(const CoordBox& places) const {
  const auto list = coefficients->bricks();
  const CoordBox within = intersection(places, box);
  Interval result = nothing();
  double present = 0;
  for (auto it = std::lower_bound(list.begin(), list.end(), within.lo); it != list.end() && (*it)[0] <= within.hi[0]; ++it) {
    if (!within.contains(*it)) continue;
    const Interval& part = bricks[static_cast<std::size_t>(it - list.begin())];
    result = {std::min(result.lo, part.lo), std::max(result.hi, part.hi)};
    if (result.lo == all.lo && result.hi == all.hi) return result;
    ++present;
  }
  if (present < places.count()) include(result, coefficients->background());
  if (present < within.count() && all.lo < 0) include(result, -coefficients->background());
  return result;
}

GridField::GridField(std::shared_ptr<const Grid> grid, Interpolation interpolation, const RunControl& run)
    : grid_(std::move(grid)), interpolation_(interpolation) {
  if (!grid_) throw InvalidInput("grid field: no grid given");
  auto coefficients = grid_;
  if (interpolation_ == Interpolation::Cubic) {
    const auto bricks = grid_->bricks();
    coefficients =
        std::make_shared<const Grid>(grid_->voxel(), grid_->origin(), grid_->background(),
                                     std::vector<Coord>(bricks.begin(), bricks.end()), spline_coefficients(*grid_, run));
  }
  shared_ = std::make_shared<const Shared>(std::move(coefficients));
}

void GridField::do_evaluate(const Positions& x, const JetView& out) const {
  if (interpolation_ == Interpolation::Cubic)
    evaluate_points<4>(*shared_->coefficients, x, out);
  else
    evaluate_points<2>(*shared_->coefficients, x, out);
  if (!has_time(out.order)) return;
  std::fill_n(out.row(kFt), out.size, 0.0);
  if (has_hessian(out.order))
    for (const JetRow r : {kFxt, kFyt, kFzt}) std::fill_n(out.row(r), out.size, 0.0);
}

Interval GridField::range(const Box& box) const {
  // A sum of B-splines lies between the least and the largest coefficient that reach the place.
  constexpr double kMostVoxels = 16 * 16 * 16;
  const int half = interpolation_ == Interpolation::Cubic ? 2 : 1;  // of the samples that reach a place, along an axis
  const Vec3 lo = (box.min - grid_->origin()) / grid_->voxel(), hi = (box.max - grid_->origin()) / grid_->voxel();
  const auto index = [](double v) { return static_cast<std::int32_t>(std::clamp(v, -kFarthestVoxel, kFarthestVoxel)); };
  CoordBox voxels;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Eigen::Index>(a);
    voxels.lo[a] = std::isnan(lo[axis]) ? index(-kFarthestVoxel) : index(std::floor(lo[axis]) - (half - 1));
    voxels.hi[a] = std::isnan(hi[axis]) ? index(kFarthestVoxel) : index(std::floor(hi[axis]) + half);
  }
  Interval result = shared_->all;
  if (voxels.count() > kMostVoxels) {
    result = shared_->of_bricks({Grid::brick_of(voxels.lo), Grid::brick_of(voxels.hi)});
  } else if (voxels.count() > 0) {
    const std::vector<float> samples = gather_box(*shared_->coefficients, voxels);
    result = range_of(samples);
    // Differences of coefficients bound the slope likewise; from the middle value that is tighter for small boxes.
    double reach = 0;
    for (std::size_t a = 0; a < 3; ++a)
      reach += steepest(samples, voxels.size(), a) * 0.5 * (hi - lo)[static_cast<Eigen::Index>(a)];
    const double middle = value_at(*this, box.center());
    result = {std::max(result.lo, middle - reach), std::min(result.hi, middle + reach)};
  }
  const double rounding = 1e-13 * shared_->largest;
  return {result.lo - rounding, result.hi + rounding};
}

Box GridField::bounds_below(double level) const {
  if (level >= grid_->background()) return Box::everywhere();
  if (!(shared_->all.lo <= level)) return {};
  return grid_->bounds().padded(grid_->voxel() * (interpolation_ == Interpolation::Cubic ? 2 : 1));
}

}  // namespace meniscus::field
