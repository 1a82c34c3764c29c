// Floaters on a cylinder, right after it is stretched fourfold and once they have recovered.
// Writes stretched.0001.ply (before), 0002 (stretched), 0003 (ten steps later) and 0004 (at rest). The picture in README.md:
// meniscus render "stretched.####.ply" --frames 2-4 --discs --sheet 1 --camera "0.3,1.6,6.2->0,0,0" --fov 16 --size 720x220
#include <meniscus/field/primitives.h>
#include <meniscus/io/geometry.h>
#include <meniscus/sample/floaters.h>

#include <string>

int main(int argc, char** argv) {
  using namespace meniscus;
  const std::string folder = argc > 1 ? std::string(argv[1]) + "/" : "";
  const auto cylinder = [](double length) {
    return field::capsule({-0.5 * length, 0.0, 0.0}, {0.5 * length, 0.0, 0.0}, 0.4);
  };
  const auto save = [&](const sample::Floaters& f, const field::Field& surface, int number) {
    io::write_cloud(folder + "stretched.000" + std::to_string(number) + ".ply", f.cloud(surface));
  };
  const sample::FloaterOptions options{.radius = 0.07};
  const Box box{Vec3(-2.6, -0.6, -0.6), Vec3(2.6, 0.6, 0.6)};

  const auto unit = cylinder(1), stretched = cylinder(4);
  sample::Floaters before(box, options);
  before.settle(*unit, 500);
  save(before, *unit, 1);

  // The floaters ride on the surface while it is stretched.
  sample::Floaters after(box, options);
  for (std::size_t i = 0; i < before.size(); ++i) {
    Vec3 p = before.points().position(i);
    p.x() *= 4;
    after.add(p, before.points().normal(i), before.radii()[i]);
  }
  after.step(*stretched);
  save(after, *stretched, 2);
  for (int k = 0; k < 9; ++k) after.step(*stretched);
  save(after, *stretched, 3);
  after.settle(*stretched, 500);
  save(after, *stretched, 4);
}
