#include <meniscus/pointset/stroke.h>

#include <meniscus/base/error.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace meniscus::pointset {
namespace {

using Tool = Stroke::Tool;

constexpr std::pair<Tool, const char*> kNames[] = {
    {Tool::Force, "force"},   {Tool::Inflate, "inflate"}, {Tool::Smooth, "smooth"}, {Tool::Flatten, "flatten"},
    {Tool::Crease, "crease"}, {Tool::Drag, "drag"},       {Tool::Emboss, "emboss"}, {Tool::Refine, "refine"}};

Vec3 nearest_on(const std::vector<Vec3>& path, const Vec3& x) {
  Vec3 best = path[0];
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Vec3 along = path[i + 1] - path[i];
    const double length2 = along.squaredNorm();
    const double t = length2 > 0 ? std::clamp((x - path[i]).dot(along) / length2, 0.0, 1.0) : 0;
    const Vec3 p = path[i] + t * along;
    if ((x - p).squaredNorm() < (x - best).squaredNorm()) best = p;
  }
  return best;
}

bool may_be_everywhere(Tool tool) { return tool == Tool::Emboss || tool == Tool::Refine; }

}  // namespace

std::string name_of(Tool tool) {
  for (const auto& [t, name] : kNames)
    if (t == tool) return name;
  return {};
}

std::optional<Tool> tool_named(const std::string& name) {
  for (const auto& [t, n] : kNames)
    if (n == name) return t;
  return std::nullopt;
}

double Falloff::at(double r) const {
  if (!(r < 1)) return 0;
  switch (kind) {
    case Kind::Gaussian: {
      const double end = std::exp(-4.5);
      return (std::exp(-4.5 * r * r) - end) / (1 - end);
    }
    case Kind::Constant: {
      const double t = std::clamp((r - 0.8) / 0.2, 0.0, 1.0);
      return 1 - t * t * (3 - 2 * t);
    }
    case Kind::Spherical: return std::sqrt(1 - r * r);
    case Kind::Smooth: return (1 - r * r) * (1 - r * r);
    case Kind::Custom: {
      const double place = r * static_cast<double>(custom.size() - 1);
      const auto i = static_cast<std::size_t>(place);
      return custom[i] + (place - static_cast<double>(i)) * (custom[i + 1] - custom[i]);
    }
  }
  return 0;
}

void check(const Stroke& s) {
  const auto require = [&](bool good, const std::string& what) {
    if (!good) throw InvalidInput(name_of(s.tool) + ": " + what);
  };
  const bool everywhere = may_be_everywhere(s.tool) && s.path.empty();
  require(everywhere || !s.path.empty(), "a path of one place or more is needed");
  require(std::all_of(s.path.begin(), s.path.end(), [](const Vec3& p) { return p.allFinite(); }), "the path is not finite");
  require(everywhere || (s.radius > 0 && std::isfinite(s.radius)), "the radius must be above 0");
  require(std::isfinite(s.strength), "the strength must be finite");
  if (s.tool == Tool::Smooth || s.tool == Tool::Flatten)
    require(s.strength >= 0 && s.strength <= 1, "the strength is a share from 0 to 1");
  if (s.tool == Tool::Drag) require(s.direction.has_value(), "a direction is needed");
  if (s.direction) require(s.direction->allFinite() && s.direction->norm() > 0, "the direction must not be zero");
  if (s.region) require(!s.region->empty(), "the region is empty");
  if (s.falloff.kind == Falloff::Kind::Custom)
    require(s.falloff.custom.size() >= 2 &&
                std::all_of(s.falloff.custom.begin(), s.falloff.custom.end(), [](double v) { return std::isfinite(v); }),
            "a custom falloff takes two finite numbers or more");
  if (s.tool == Tool::Force) {
    check(s.material);
    require(s.seconds > 0 && std::isfinite(s.seconds), "the time must be above 0 seconds");
    require(s.steps >= 1 && s.steps <= 10'000, "1 to 10,000 steps");
    require(s.voxels >= 8 && s.voxels <= 256, "8 to 256 voxels along the region");
  }
  if (s.tool == Tool::Emboss) {
    require(s.image != nullptr, "an image is needed");
    check(s.projection);
  }
  if (s.tool == Tool::Refine) require(s.spacing > 0 && std::isfinite(s.spacing), "the spacing must be above 0");
}

ToolShape::ToolShape(const Stroke& stroke)
    : falloff_(stroke.falloff), radius_(stroke.radius), region_(stroke.region), everywhere_(stroke.path.empty()) {
  for (unsigned corner = 0; corner < 8; ++corner) {
    Vec3 signs = Vec3::Ones();
    bool wanted = true;
    for (unsigned a = 0; a < 3; ++a) {
      if ((corner >> a & 1U) == 0) continue;
      wanted = wanted && stroke.mirror[a];
      signs[a] = -1;
    }
    if (!wanted) continue;
    Copy copy{stroke.path, signs};
    for (Vec3& p : copy.path) {
      p = p.cwiseProduct(signs);
      bounds_.extend(Box::around(p, radius_));
    }
    copies_.push_back(std::move(copy));
  }
  if (everywhere_) bounds_ = Box::everywhere();
  if (region_) bounds_ = bounds_.intersection(*region_);
}

ToolShape::Reach ToolShape::at(const Vec3& x) const {
  Reach best;
  if (region_ && !region_->contains(x)) return best;
  if (everywhere_) {
    best.weight = 1;
    return best;
  }
  double least = radius_;
  for (const Copy& c : copies_) {
    const Vec3 p = nearest_on(c.path, x);
    const double distance = (x - p).norm();
    if (distance >= least) continue;
    least = distance;
    best = {falloff_.at(distance / radius_), p, c.signs};
  }
  return best;
}

}  // namespace meniscus::pointset
