#include <meniscus/band/particle_motion.h>
#include <meniscus/base/error.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace meniscus::band {
namespace {

constexpr double kAbsurd = 1e18;

bool sane(const Vec3& v) { return v.allFinite() && v.cwiseAbs().maxCoeff() < kAbsurd; }

void append(ParticleState& to, const ParticleState& from, std::size_t i) {
  to.position.push_back(from.position[i]);
  to.velocity.push_back(from.velocity[i]);
  to.radius.push_back(from.radius[i]);
  to.weight.push_back(from.weight[i]);
}

/// Particle numbers by rising id, the first of equal ids alone.
std::vector<std::size_t> by_id(const ParticleFrame& f) {
  std::vector<std::size_t> order(f.id.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return f.id[a] < f.id[b]; });
  order.erase(std::unique(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return f.id[a] == f.id[b]; }),
              order.end());
  return order;
}

}  // namespace

ParticleFrame particle_frame(const points::Cloud& cloud, double radius) {
  if (!(radius > 0) || !std::isfinite(radius)) throw InvalidInput("a particle radius must be positive and finite");
  const auto v = cloud.attributes.values("v", 3);
  const auto r = cloud.attributes.values("pscale", 1);
  const auto id = cloud.attributes.integers("id");
  ParticleFrame out;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double own = r.empty() ? radius : r[i];
    const Vec3 u = v.empty() ? Vec3(Vec3::Zero()) : Vec3(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
    if (!sane(cloud.positions[i]) || !sane(u) || !(own > 0) || own > kAbsurd) {
      ++out.dropped;
      continue;
    }
    out.state.position.push_back(cloud.positions[i]);
    out.state.velocity.push_back(u);
    out.state.radius.push_back(own);
    out.state.weight.push_back(1);
    if (!id.empty()) out.id.push_back(id[i]);
    out.source.push_back(i);
  }
  return out;
}

ParticleMotion::ParticleMotion(const ParticleFrame& from, const ParticleFrame& to, double duration) : duration_(duration) {
  if (!(duration > 0) || !std::isfinite(duration)) throw InvalidInput("a frame must last longer than nothing");
  std::vector<char> gone(from.state.size(), 1), come(to.state.size(), 1);
  if (!from.id.empty() && !to.id.empty()) {
    const std::vector<std::size_t> a = by_id(from), b = by_id(to);
    for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
      const std::int64_t x = from.id[a[i]], y = to.id[b[j]];
      if (x == y) {
        append(a_, from.state, a[i]);
        append(b_, to.state, b[j]);
        gone[a[i]] = come[b[j]] = 0;
      }
      i += x <= y;
      j += y <= x;
    }
  }
  pairs_ = a_.size();
  for (std::size_t i = 0; i < gone.size(); ++i)
    if (gone[i] != 0) append(a_, from.state, i);
  for (std::size_t i = 0; i < come.size(); ++i)
    if (come[i] != 0) append(b_, to.state, i);

  double path = 0, stated = 0;
  for (std::size_t i = 0; i < pairs_; ++i) {
    path += (b_.position[i] - a_.position[i]).squaredNorm();
    stated += 0.5 * (a_.velocity[i].squaredNorm() + b_.velocity[i].squaredNorm()) * duration * duration;
  }
  hermite_ = stated > path / 16 && stated < path * 16;
}

double ParticleMotion::typical_speed() const {
  double sum = 0;
  for (std::size_t i = 0; i < pairs_; ++i) sum += (b_.position[i] - a_.position[i]).squaredNorm();
  for (std::size_t i = pairs_; i < b_.size(); ++i) sum += b_.velocity[i].squaredNorm() * duration_ * duration_;
  return b_.size() > 0 ? std::sqrt(sum / static_cast<double>(b_.size())) / duration_ : 0;
}

ParticleState ParticleMotion::at(double s) const {
  ParticleState out;
  for (std::size_t i = 0; i < pairs_; ++i) {
    const Vec3 way = b_.position[i] - a_.position[i];
    Vec3 p = s == 1 ? b_.position[i] : Vec3(a_.position[i] + s * way);
    if (hermite_ && s > 0 && s < 1)
      p += s * (1 - s) * ((1 - s) * (duration_ * a_.velocity[i] - way) - s * (duration_ * b_.velocity[i] - way));
    out.position.push_back(p);
    out.velocity.push_back(way / duration_);
    out.radius.push_back((1 - s) * a_.radius[i] + s * b_.radius[i]);
    out.weight.push_back(1);
  }
  const auto fade = [&](const ParticleState& from, double since, double weight) {
    for (std::size_t i = pairs_; i < from.size() && weight > 0; ++i) {
      append(out, from, i);
      out.position.back() += since * from.velocity[i];
      out.weight.back() = weight;
    }
  };
  fade(a_, s * duration_, 1 - s);
  fade(b_, (s - 1) * duration_, s);
  return out;
}

}  // namespace meniscus::band
