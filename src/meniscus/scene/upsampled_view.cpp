#include <meniscus/base/error.h>
#include <meniscus/scene/upsampled_view.h>

namespace meniscus::scene {
namespace {

constexpr double kAway = 0.3;  // cosine beyond a right angle from which on a point is taken to face away with all about it
constexpr double kHidden = 4;  // times the spacing of what is seen: enough for shadows

}  // namespace

points::Cloud upsampled_for(const pointset::Solid& solid, const render::Camera& camera, int width, int height,
                            const ViewSampling& sampling, pointset::UpsampleReport* report, const RunControl& run) {
  if (!(sampling.pixels > 0)) throw InvalidInput("the points of a picture need a spacing above zero");
  const bool sharp = solid.operation.has_value();  // what faces away may come up to an edge that is seen
  const auto spacing = [&](const Vec3& place, const Vec3& normal) {
    const Vec3 to_camera = camera.position - place;
    const bool hidden = normal.dot(to_camera) < -kAway * to_camera.norm();
    return (hidden && !sharp ? kHidden : 1) * sampling.pixels * render::pixel_size(camera, width, height, place);
  };
  return pointset::upsample(solid, spacing, sampling.most, report, run);
}

}  // namespace meniscus::scene
