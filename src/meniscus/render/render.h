#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/render/camera.h>
#include <meniscus/render/image.h>
#include <meniscus/render/scene.h>

namespace meniscus::render {

/// What the picture shows of the surfaces.
enum class Shading {
  Studio,  ///< lit, with shadows
  Flat,    ///< the bare colours, neither light nor shadow nor ground
  Normal,  ///< the shading normal in world axes, (N + 1) / 2 as a colour
};

struct RenderOptions {
  int width = 960;   ///< pixels, >= 1
  int height = 720;  ///< pixels, >= 1
  /// Rays per pixel, >= 1; noise falls as 1/sqrt. 16 for a look, 64 for a page.
  int samples = 32;
  Shading shading = Shading::Studio;
  bool transparent = false;  ///< no backdrop: alpha 0 where nothing is seen, shadows as translucent black
  /// Exposure time in frames, >= 0, centred on the moment of the positions: what has the attribute v is smeared along it.
  double shutter = 0;
  double fps = 24;       ///< frames per second, > 0: the unit of `shutter`
  double exposure = 1;   ///< brightness, > 0
  bool tone_map = true;  ///< roll highlights off; without, values above 1 clip in the file
  bool legend = true;    ///< colour bar with its range, when the scene colours by an attribute
};

/// What was left out of a picture, and the range that its colours cover.
struct RenderReport {
  std::size_t dropped_triangles = 0;
  std::size_t dropped_points = 0;
  std::optional<double> color_min;  ///< given if the scene colours by an attribute that some item has
  std::optional<double> color_max;
};

/// Draws the scene as `camera` sees it.
///
/// The same picture, bit for bit, for any number of threads (on one machine); up to rounding also for the same scene and
/// camera at another scale. run.seed() moves the noise. Row 0 is the top. Throws InvalidInput for sizes, samples or options
/// out of range, a camera that is nowhere or looks along its up vector, an attribute array of the wrong length, a triangle
/// with an index out of range, or a color_by attribute that no item has; ResourceLimit when memory runs out; Cancelled from
/// `run`, which is looked at per tile of 16x16 pixels. Cost: about 200 bytes a triangle or point; a few million rays per
/// second and core.
Image render(const Scene& scene, const Camera& camera, const RenderOptions& options = {}, RenderReport* report = nullptr,
             RunControl run = {});

}  // namespace meniscus::render
