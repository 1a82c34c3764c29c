#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/pointset/upsample.h>
#include <meniscus/render/camera.h>

#include <cstddef>

namespace meniscus::scene {

/// How dense the points of a picture are.
struct ViewSampling {
  double pixels = 1;           ///< between neighbouring points, > 0
  std::size_t most = 3000000;  ///< points; about 300 bytes each while the picture is drawn
};

/// The points of a point-set surface for a picture of width x height pixels, so dense that their discs show a closed smooth
/// surface (see pointset::upsample). What faces away from the camera, and only casts shadows, has four times the spacing;
/// what is outside of the picture the cloud's own.
points::Cloud upsampled_for(const pointset::Solid& solid, const render::Camera& camera, int width, int height,
                            const ViewSampling& sampling = {}, pointset::UpsampleReport* report = nullptr,
                            const RunControl& run = {});

}  // namespace meniscus::scene
