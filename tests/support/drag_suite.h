#pragma once

#include <meniscus/control/drag.h>
#include <meniscus/field/blobs.h>
#include <meniscus/field/combine.h>
#include <meniscus/field/primitives.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace meniscus::test {

/// A surface and a closed path for one of its points; the other points stay.
struct DragScene {
  std::string name;
  std::unique_ptr<field::Field> surface;
  Vec3 grab;
  std::vector<Vec3> pins;
  bool sideways = false;
};

/// Four surfaces of different kinds, about `scale` in size.
inline std::vector<DragScene> drag_scenes(double scale = 1) {
  using field::Number;
  const auto at = [scale](double x, double y, double z) {
    return field::Number3{Number(x * scale), Number(y * scale), Number(z * scale)};
  };
  std::vector<DragScene> list;
  std::vector<field::Blob> row, sheet;
  for (int i = 0; i < 5; ++i) row.push_back({at(0.8 * i, 0.1 * (i % 3), 0), Number(0.9 * scale), Number(1.0)});
  for (int i = 0; i < 16; ++i)
    sheet.push_back({at(i % 4, 0.1 * (i % 3), i / 4), Number(1.6 * scale), Number::frozen(1.0)});  // NOLINT: rows of four
  list.push_back({"row of Gaussian blobs",
                  field::blobs(field::BlobKernel::Gaussian, Number::frozen(0.3), row),
                  scale * Vec3(1.6, 1.1, 0),
                  {scale * Vec3(0, -0.9, 0), scale * Vec3(3.2, -0.8, 0)}});
  list.push_back({"sheet of compact blobs",
                  field::blobs(field::BlobKernel::Compact, Number::frozen(0.4), sheet),
                  scale * Vec3(1.5, 1.1, 1.5),
                  {scale * Vec3(0, -0.9, 0), scale * Vec3(3, -0.9, 3)}});
  std::vector<field::SegmentBlob> cylinders;
  for (int i = 0; i < 5; ++i)
    cylinders.push_back({at(0.5 * i, -0.5, 0), at(0.5 * i, 0.5, 0), Number(0.45 * scale), Number(1.0)});
  list.push_back({"row of blobby cylinders",
                  field::segments(field::BlobKernel::Gaussian, Number::frozen(0.35), cylinders),
                  scale * Vec3(1, 1.1, 0),
                  {scale * Vec3(1, -1.1, 0)}});
  field::Inputs balls;
  balls.push_back(field::sphere(at(0, 0, 0), Number(scale)));
  balls.push_back(field::sphere(at(1.2, 0, 0), Number(0.7 * scale)));
  list.push_back({"two spheres blended",
                  field::blend(std::move(balls), Number::frozen(0.3 * scale)),
                  scale * Vec3(1.2, 0.7, 0),
                  {scale * Vec3(-1, 0, 0)},
                  true});
  return list;
}

/// What a drag did to the surface.
struct DragMeasure {
  double jump = 0;        ///< largest motion of the surface in a step, over the drag's motion in that step
  std::size_t flips = 0;  ///< times that the normal of a point that rides on the surface turned by more than 90° in a step
  double hysteresis =
      0;  ///< largest change of an unknown once the drag is back, in sizes of the surface (as is, if no length)
  std::size_t steps = 0, failed = 0;
};

/// Drags the point round a loop of 0.4 sizes' radius and back, 1/60 s a step, while points ride on the surface.
inline DragMeasure drag_around(DragScene& scene, double scale) {
  field::Field& f = *scene.surface;
  const auto values = [&f] {
    std::vector<double> q;
    for (const auto& p : f.parameters()) q.push_back(p.value);
    return q;
  };
  const std::vector<double> before = values();
  control::ControlSession session(f);
  const std::size_t dragged = session.add(scene.grab, scene.sideways).id;
  for (const Vec3& p : scene.pins) session.add(p);
  const Vec3 start = session.controls()[dragged].position;

  std::vector<Vec3> riders;
  const Box box = control::tight_bounds(f);
  for (int i = 0; i < 200; ++i) {
    const Vec3 u(std::fmod(0.7548776662466927 * i, 1), std::fmod(0.5698402909980532 * i, 1), std::fmod(0.4301597090 * i, 1));
    if (const auto p = control::nearest_surface_point(f, box.min + u.cwiseProduct(box.size()), scale)) riders.push_back(*p);
  }
  const auto normals = [&] {
    const field::JetBatch jets = field::evaluate(f, riders, field::Order::Gradient);
    std::vector<Vec3> n;
    for (std::size_t i = 0; i < riders.size(); ++i) n.push_back(jets.gradient(i).normalized());
    return n;
  };

  DragMeasure m;
  const double h = 0.4 * scale;
  std::vector<Vec3> n = normals();
  for (const Vec3& to :
       {Vec3(0, h, 0), Vec3(h, h, 0), Vec3(h, 0.2 * h, h), Vec3(0, -0.5 * h, h), Vec3(-h, 0, 0), Vec3(0, 0, 0)}) {
    session.aim(dragged, start + to);
    for (int i = 0; i < 100; ++i, ++m.steps) {
      const Vec3 was = session.controls()[dragged].position;
      const control::StepReport r = session.step(1 / 60.0);
      m.failed += r.outcome == control::StepReport::Outcome::Failed ? 1 : 0;
      const double gone = (session.controls()[dragged].position - was).norm();
      for (Vec3& p : riders) {
        const auto next = control::nearest_surface_point(f, p, scale);
        if (!next) continue;
        // Steps in place go on towards the drag's beginning: they are measured by the least step worth a look.
        m.jump = std::max(m.jump, (*next - p).norm() / std::max(gone, 0.01 * scale));
        p = *next;
      }
      const std::vector<Vec3> now = normals();
      for (std::size_t k = 0; k < now.size(); ++k) m.flips += now[k].dot(n[k]) < 0 ? 1 : 0;
      n = now;
      if (r.outcome == control::StepReport::Outcome::Arrived && r.settled) break;
    }
  }
  session.run();
  const std::vector<double> after = values();
  for (std::size_t k = 0; k < after.size(); ++k) {
    const auto kind = f.parameters()[k].quantity;
    const bool length = kind == field::Quantity::Coordinate || kind == field::Quantity::Length;
    m.hysteresis = std::max(m.hysteresis, std::abs(after[k] - before[k]) / (length ? scale : 1));
  }
  return m;
}

}  // namespace meniscus::test
