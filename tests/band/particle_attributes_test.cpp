#include <meniscus/band/particle_attributes.h>

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::band {
namespace {

TEST(ParticleAttributes, MeansAndTheHeaviestNeighbour) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    points::Cloud cloud;
    cloud.positions = {scale * Vec3(0, 0, 0), scale * Vec3(1, 0, 0), scale * Vec3(50, 0, 0)};
    cloud.attributes.set("temperature", 1, std::vector<double>{10, 20, 99});
    cloud.attributes.set("Cd", 3, std::vector<double>{1, 0, 0, 0, 0, 1, 9, 9, 9});
    cloud.attributes.set_integers("kind", 1, {7, 8, 9});
    const ParticleFrame particles = particle_frame(cloud, scale);
    const std::vector<Vec3> at{scale * Vec3(0.5, 0.3, 0), scale * Vec3(0, 0.1, 0), scale * Vec3(20, 0, 0)};
    const Attributes out = carried_attributes(cloud.attributes, particles, 1.5 * scale, at, {"Cd"});

    // The weights (1 - d²/reach²)³ are those of the definition.
    const auto weight = [](double d2) { return std::pow(1 - d2 / 2.25, 3); };
    const double near = weight(0.01), far = weight(1.01);
    const auto t = out.values("temperature", 1);
    ASSERT_EQ(t.size(), 3u);
    EXPECT_NEAR(t[0], 15, 1e-9) << "half way between both";
    EXPECT_NEAR(t[1], (10 * near + 20 * far) / (near + far), 1e-9);
    EXPECT_EQ(t[2], 0) << "no particle is within reach";
    const auto kind = out.integers("kind");
    ASSERT_EQ(kind.size(), 3u);
    EXPECT_EQ(kind[1], 7);
    EXPECT_FALSE(out.has("Cd"));
  }
}

TEST(ParticleAttributes, RowsAreThoseOfTheCloudWhenParticlesWereDropped) {
  points::Cloud cloud;
  cloud.positions = {Vec3(std::nan(""), 0, 0), Vec3(0, 0, 0)};
  cloud.attributes.set("temperature", 1, std::vector<double>{-5, 3});
  const ParticleFrame particles = particle_frame(cloud, 1);
  ASSERT_EQ(particles.dropped, 1u);
  const Attributes out = carried_attributes(cloud.attributes, particles, 1, std::vector<Vec3>{Vec3(0.1, 0, 0)}, {});
  EXPECT_NEAR(out.values("temperature", 1)[0], 3, 1e-12);
}

}  // namespace
}  // namespace meniscus::band
