// The example of the torus and the sphere, as its page tells it, with fewer points.
#include "support/program.h"

#include <meniscus/io/geometry.h>
#include <meniscus/io/msurf.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace meniscus {
namespace {

using test::meniscus_program;
using test::Scratch;

nlohmann::json report_of(const std::string& arguments) {
  const auto r = meniscus_program(arguments + " --json");
  EXPECT_EQ(r.code, 0) << arguments << "\n" << r.err;
  return r.code == 0 ? nlohmann::json::parse(r.out) : nlohmann::json::object();
}

class PointSets : public testing::Test {
 protected:
  void SetUp() override {
    for (const std::string name : {"torus", "sphere"}) {
      report_of("sample " MENISCUS_SOURCE_DIR "/examples/torus_and_sphere/" + name + ".json --fast --count 1500 -o " +
                path(name + ".ply"));
      fits_[name] = report_of("fit " + path(name + ".ply") + " -o " + path(name + ".msurf"))["fit"];
    }
  }
  std::string path(const std::string& name) { return folder_ / name; }

  Scratch folder_;
  nlohmann::json fits_;
};

TEST_F(PointSets, FitBooleanMesh) {
  EXPECT_EQ(fits_["torus"]["points"], 1500);
  EXPECT_EQ(fits_["torus"]["domains"], 1500);
  EXPECT_LT(fits_["torus"]["mean_value"].get<double>(), 1e-3);
  EXPECT_LT(fits_["torus"]["mean_normal_error_deg"].get<double>(), 1);
  EXPECT_GT(fits_["torus"]["bytes"].get<double>(), 1500 * 8 * 27);
  EXPECT_NE(meniscus_program("fit " + path("torus.msurf") + " -o " + path("x.msurf")).code, 0);

  const std::string both = path("torus.msurf") + " " + path("sphere.msurf");
  double volume[4];
  int k = 0;
  for (const std::string& what : {"union " + both, "intersection " + both, "difference " + both,
                                  "difference " + path("sphere.msurf") + " " + path("torus.msurf")}) {
    const auto b = report_of("boolean " + what + " -f -o " + path("r.msurf"))["boolean"];
    EXPECT_GT(b["kept_a"], 0) << what;
    EXPECT_GT(b["kept_b"], 0) << what;
    EXPECT_GT(b["edge_points"], 20) << what;
    const auto mesh = report_of("mesh " + path("r.msurf") + " --voxel 0.05 -f -o " + path("r.ply"))["mesh"];
    EXPECT_TRUE(mesh["closed"].get<bool>() && mesh["manifold"].get<bool>()) << what;
    volume[k++] = mesh["volume"].get<double>();
  }
  // Both balances of volumes: |A ∪ B| = |A − B| + |B − A| + |A ∩ B| = |A| + |B| − |A ∩ B|.
  EXPECT_NEAR(volume[0], volume[1] + volume[2] + volume[3], 0.01 * volume[0]);
  const double pi = 3.14159265358979;
  const double torus = 2 * pi * pi * 0.38 * 0.38, sphere = 4 * pi / 3 * 0.65 * 0.65 * 0.65;
  EXPECT_NEAR(volume[0], torus + sphere - volume[1], 0.01 * volume[0]);
}

TEST_F(PointSets, RenderUpsamples) {
  const std::string both = path("torus.msurf") + " " + path("sphere.ply");
  const std::string render = "render --upsample --size 400x300 --samples 1 " + both + " -f -o " + path("p.png");
  EXPECT_TRUE(report_of(render)["warnings"].empty());
  const auto warned = report_of(render + " --most-points 20000")["warnings"];
  ASSERT_EQ(warned.size(), 2);  // one an input
  EXPECT_EQ(warned[0]["code"], "coarser");
  EXPECT_EQ(meniscus_program(render + " --discs").code, 2);
  EXPECT_EQ(meniscus_program("render --upsample=-1 " + both + " -f -o " + path("p.png")).code, 2);
}

TEST_F(PointSets, PointsBlendsMeshesAndNests) {
  const std::string both = path("torus.msurf") + " " + path("sphere.msurf");
  const auto told = report_of("boolean union " + both + " -o " + path("r.ply"))["warnings"];
  EXPECT_EQ(told[0]["code"], "soft-edges");
  const points::Cloud cloud = io::read_cloud(path("r.ply"));
  EXPECT_EQ(cloud.attributes.values("N_b", 3).size(), 3 * cloud.size());
  EXPECT_EQ(cloud.attributes.integers("part").size(), cloud.size());

  report_of("boolean union " + both + " --blend -o " + path("soft.msurf"));
  EXPECT_FALSE(io::read_msurf(path("soft.msurf")).operation.has_value());
  EXPECT_EQ(report_of("info " + path("soft.msurf"))["info"]["points"], cloud.size());

  report_of("boolean intersection " + both + " -o " + path("common.msurf"));
  report_of("boolean difference " + path("torus.msurf") + " " + path("common.msurf") + " -o " + path("nested.msurf"));
  EXPECT_EQ(io::read_msurf(path("nested.msurf")).inputs.at(1).operation, pointset::Operation::Intersection);

  // A scene among them: a mesh.
  const auto r =
      report_of("boolean difference " + path("torus.msurf") +
                " " MENISCUS_SOURCE_DIR "/examples/torus_and_sphere/sphere.json --voxel 0.06 -o " + path("m.ply"));
  EXPECT_GT(r["outputs"][0]["triangles"], 100);
  EXPECT_EQ(meniscus_program("boolean union " + path("torus.msurf") +
                             " " MENISCUS_SOURCE_DIR "/examples/torus_and_sphere/sphere.json -o " + path("m.msurf"))
                .code,
            2);
}

// The cloud of a Boolean is a surface to other verbs, though the samplings it came from have radii.
TEST_F(PointSets, CloudsOfBooleansAreSurfaces) {
  report_of("boolean union " + path("torus.msurf") + " " + path("sphere.msurf") + " -o " + path("r.ply"));
  const auto mesh = report_of("mesh " + path("r.ply") + " --voxel 0.06 -o " + path("r.obj"))["mesh"];
  EXPECT_EQ(mesh["components"], 1);
  EXPECT_TRUE(mesh["closed"].get<bool>());
}

// Topology changes on the way from a fitted ring to a cloud of a ball; both ends are what was asked for.
TEST_F(PointSets, MorphFromFitToFit) {
  const auto r = report_of("morph " + path("torus.msurf") + " " + path("sphere.msurf") + " --frames 4 --voxel 0.06 -o " +
                           path("m.####.ply"));
  ASSERT_EQ(r["frames"].size(), 4u);
  const double pi = 3.14159265358979, torus = 2 * pi * pi * 0.38 * 0.38, sphere = 4 * pi / 3 * 0.65 * 0.65 * 0.65;
  EXPECT_NEAR(r["frames"][0]["volume"].get<double>(), torus, 0.03 * torus);
  EXPECT_NEAR(r["frames"][3]["volume"].get<double>(), sphere, 0.03 * sphere);
}

TEST_F(PointSets, NothingLeftIsAnAnswer) {
  const std::string twice = path("torus.msurf") + " " + path("torus.msurf");
  const auto r = report_of("boolean difference " + twice + " -o " + path("none.ply"));
  EXPECT_EQ(r["warnings"][0]["code"], "empty");
  EXPECT_EQ(io::read_cloud(path("none.ply")).size(), 0u);
}

}  // namespace
}  // namespace meniscus
