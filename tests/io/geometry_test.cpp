#include "samples.h"

#include <meniscus/base/error.h>
#include <meniscus/io/usd.h>

#include <gtest/gtest.h>

namespace meniscus::io {
namespace {

TEST(RoundTrip, PlyKeepsEveryBitInDoubles) {
  const TemporaryFolder folder;
  for (const bool text : {false, true}) {
    WriteOptions options;
    options.text = text;
    options.overwrite = true;
    options.precision = Precision::Float64;
    options.comments = {"meniscus mesh a.json\nsecond"};
    const mesh::Mesh m = sample_mesh();
    write_mesh(folder / "a.ply", m, options);
    const mesh::Mesh read = read_mesh(folder / "a.ply");
    EXPECT_EQ(read.positions, m.positions);
    EXPECT_EQ(read.triangles, m.triangles);
    EXPECT_EQ(difference(m.attributes, read.attributes), "");
  }
}

TEST(RoundTrip, PlyMeshesAreFloatsAndCloudsDoublesByDefault) {
  const TemporaryFolder folder;
  const mesh::Mesh m = sample_mesh();
  for (const bool text : {false, true}) {
    WriteOptions options;
    options.text = text;
    options.overwrite = true;
    write_mesh(folder / "m.ply", m, options);
    const mesh::Mesh read = read_mesh(folder / "m.ply");
    EXPECT_EQ(in_single_precision(read).positions, in_single_precision(m).positions);
    EXPECT_EQ(difference(in_single_precision(m).attributes, in_single_precision(read).attributes), "");
    if (!text) {
      EXPECT_EQ(read.positions, in_single_precision(m).positions);
    }
    write_cloud(folder / "c.ply", sample_cloud(), options);
    const points::Cloud cloud = read_cloud(folder / "c.ply");
    EXPECT_EQ(cloud.positions, m.positions);
    EXPECT_EQ(difference(m.attributes, cloud.attributes), "");
  }
}

TEST(RoundTrip, ObjKeepsPositionsNormalsAndColours) {
  const TemporaryFolder folder;
  WriteOptions options;
  options.precision = Precision::Float64;
  const mesh::Mesh m = sample_mesh();
  write_mesh(folder / "a.obj", m, options);
  const mesh::Mesh read = read_mesh(folder / "a.obj");
  EXPECT_EQ(read.positions, m.positions);
  EXPECT_EQ(read.triangles, m.triangles);
  mesh::Mesh expected;
  for (const auto name : {attribute::kNormal, attribute::kColor}) {
    const auto values = m.attributes.values(name, 3);
    expected.attributes.set(name, 3, {values.begin(), values.end()});
  }
  EXPECT_EQ(difference(expected.attributes, read.attributes), "");
}

TEST(RoundTrip, VtpKeepsEveryBitInDoubles) {
  const TemporaryFolder folder;
  for (const bool text : {false, true}) {
    WriteOptions options;
    options.text = text;
    options.overwrite = true;
    options.precision = Precision::Float64;
    options.comments = {"a -- <b> --->"};
    const mesh::Mesh m = sample_mesh();
    write_mesh(folder / "a.vtp", m, options);
    const mesh::Mesh read = read_mesh(folder / "a.vtp");
    EXPECT_EQ(read.positions, m.positions);
    EXPECT_EQ(read.triangles, m.triangles);
    EXPECT_EQ(difference(m.attributes, read.attributes), "");
    write_cloud(folder / "c.vtp", sample_cloud(), options);
    const Geometry cloud = read_geometry(folder / "c.vtp");
    EXPECT_EQ(cloud.cloud.positions, m.positions);
    EXPECT_EQ(difference(m.attributes, cloud.cloud.attributes), "");
  }
}

TEST(RoundTrip, StlKeepsShapeInFloats) {
  const TemporaryFolder folder;
  for (const bool text : {false, true}) {
    WriteOptions options;
    options.text = text;
    options.overwrite = true;
    const mesh::Mesh m = in_single_precision(sample_mesh());
    write_mesh(folder / "a.stl", m, options);
    const mesh::Mesh read = in_single_precision(read_mesh(folder / "a.stl"));
    ASSERT_EQ(read.triangles.size(), m.triangles.size());
    for (std::size_t t = 0; t < m.triangles.size(); ++t)
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_EQ(read.positions[static_cast<std::size_t>(read.triangles[t][c])],
                  m.positions[static_cast<std::size_t>(m.triangles[t][c])]);
    EXPECT_DOUBLE_EQ(mesh::volume(read), mesh::volume(m));
  }
  EXPECT_THROW(write_cloud(folder / "c.stl", sample_cloud()), InvalidInput);
}

TEST(RoundTrip, CsvAndXyzKeepEveryBit) {
  const TemporaryFolder folder;
  const points::Cloud cloud = sample_cloud();
  write_cloud(folder / "a.csv", cloud);
  const points::Cloud csv = read_cloud(folder / "a.csv");
  EXPECT_EQ(csv.positions, cloud.positions);
  points::Cloud expected = cloud;  // a table does not tell integers from other numbers, except for identities
  expected.attributes.erase("piece");
  expected.attributes.set("piece", 1, {-1, 0, 1, 2});
  EXPECT_EQ(difference(expected.attributes, csv.attributes), "");
  write_cloud(folder / "a.xyz", cloud);
  const points::Cloud xyz = read_cloud(folder / "a.xyz");
  EXPECT_EQ(xyz.positions, cloud.positions);
  const auto normals = cloud.attributes.values(attribute::kNormal, 3), read = xyz.attributes.values(attribute::kNormal, 3);
  EXPECT_TRUE(std::equal(normals.begin(), normals.end(), read.begin(), read.end()));
}

TEST(RoundTrip, EmptyFramesKeepKindAndAttributes) {
  const TemporaryFolder folder;
  mesh::Mesh none;
  none.attributes.set(attribute::kVelocity, 3, {});
  write_mesh(folder / "m.ply", none);
  const Geometry m = read_geometry(folder / "m.ply");
  EXPECT_EQ(m.kind, Geometry::Kind::Mesh);
  EXPECT_TRUE(m.mesh.attributes.has(attribute::kVelocity));
  write_cloud(folder / "c.ply", {{}, none.attributes});
  const Geometry c = read_geometry(folder / "c.ply");
  EXPECT_EQ(c.kind, Geometry::Kind::Cloud);
  EXPECT_TRUE(c.cloud.attributes.has(attribute::kVelocity));
}

TEST(RoundTrip, IdentitiesBeyond32BitsSurvive) {
  const TemporaryFolder folder;
  points::Cloud cloud;
  cloud.positions = {Vec3::Zero(), Vec3::Ones()};
  cloud.attributes.set_integers(attribute::kId, 1, {1, 1ll << 40});
  write_cloud(folder / "a.ply", cloud);
  EXPECT_EQ(difference(cloud.attributes, read_cloud(folder / "a.ply").attributes), "");
}

TEST(Writing, RefusesWhatNoFileShouldHold) {
  const TemporaryFolder folder;
  mesh::Mesh m = sample_mesh();
  m.positions[2].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(write_mesh(folder / "a.ply", m), InvalidInput);
  m.positions[2].y() = 1e300;  // finite, but not as a float
  EXPECT_THROW(write_mesh(folder / "a.ply", m), InvalidInput);
  WriteOptions doubles;
  doubles.precision = Precision::Float64;
  EXPECT_THROW(write_mesh(folder / "a.stl", m, doubles), InvalidInput);
  EXPECT_THROW(write_mesh(folder / "a.usda", m, doubles), InvalidInput);
  m = sample_mesh();
  m.triangles[0][1] = 4;
  EXPECT_THROW(write_mesh(folder / "a.ply", m), InvalidInput);
  m = sample_mesh();
  m.attributes.set("short", 1, {1, 2});
  EXPECT_THROW(write_mesh(folder / "a.ply", m), InvalidInput);
  points::Cloud wide = sample_cloud();
  wide.attributes.set(attribute::kRadius, 1, {1, 1, 1, 3e38});  // fits a float; USD's width, its double, does not
  EXPECT_THROW(write_cloud(folder / "a.usda", wide), InvalidInput);
  EXPECT_THROW(write_mesh(folder / "a.docx", sample_mesh()), InvalidInput);
  EXPECT_EQ(folder.entries(), 0u);
}

TEST(Reading, MissingFilesAndFoldersAreErrors) {
  const TemporaryFolder folder;
  EXPECT_THROW(read_geometry(folder / "none.ply"), IoError);
  EXPECT_THROW(read_geometry(folder / "."), IoError);
  put_file(folder / "empty.bin", "");
  EXPECT_THROW(read_geometry(folder / "empty.bin"), IoError);
  ReadOptions small;
  small.memory_limit = 10;
  put_file(folder / "a.obj", "v 0 0 0\nv 1 1 1\n");
  EXPECT_THROW(read_geometry(folder / "a.obj", small), ResourceLimit);
  EXPECT_THROW(read_mesh(folder / "a.obj"), IoError);
}

TEST(Ply, KnowsTheNamesOfOthers) {
  const std::string head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
  const Geometry g = read_geometry_bytes("a.ply", head +
                                                      "property uchar red\nproperty uchar green\nproperty uchar "
                                                      "blue\nproperty float vx\nproperty float vy\nproperty float vz\n"
                                                      "property float rad\nproperty float particleId\nproperty float "
                                                      "nx\nproperty float ny\nproperty float nz\nproperty uchar alpha\n"
                                                      "end_header\n1 2 3 255 0 51 4 5 6 .5 17 0 0 1 128\n");
  const Attributes& a = g.cloud.attributes;
  EXPECT_EQ(a.values("Cd", 3)[0], 1.0);
  EXPECT_EQ(a.values("Cd", 3)[2], 0.2);
  EXPECT_EQ(a.values("v", 3)[1], 5.0);
  EXPECT_EQ(a.values("pscale", 1)[0], 0.5);
  EXPECT_EQ(a.integers("id")[0], 17);
  EXPECT_EQ(a.values("N", 3)[2], 1.0);
  EXPECT_EQ(a.integers("alpha")[0], 128);
}

TEST(Obj, NormalsOfSharpEdgesAreLeftOut) {
  ReadReport report;
  const Geometry g = read_geometry_bytes(
      "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvn 1 0 0\nf 1//1 2//1 3//1\nf 1//2 3//2 2//2\n", {}, &report);
  EXPECT_FALSE(g.mesh.attributes.has(attribute::kNormal));
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_EQ(report.warnings[0].code, "ignored-normals");
}

TEST(Table, NamesAndSeparators) {
  const Geometry g = read_geometry_bytes("a.csv", "name;X;Y;Z;id\nab;1.5;2;3;7\nc;1;2;3;8\n");
  EXPECT_EQ(g.cloud.positions[0], Vec3(1.5, 2, 3));
  EXPECT_EQ(g.cloud.attributes.integers("id")[1], 8);
  const Geometry p = read_geometry_bytes(
      "a.csv", "\"velocity:0\",\"velocity:1\",\"velocity:2\",\"Points:0\",\"Points:1\",\"Points:2\"\n1,2,3,4,5,6\n");
  EXPECT_EQ(p.cloud.positions[0], Vec3(4, 5, 6));
  EXPECT_EQ(p.cloud.attributes.values("v", 3)[2], 3.0);
  const Geometry x = read_geometry_bytes("a.xyz", "# comment\n1 2 3 0 0 1\n4 5 6 .6 .8 0\n");
  EXPECT_EQ(x.cloud.attributes.values("N", 3)[3], 0.6);
  const Geometry h = read_geometry_bytes("a.xyz", "#x y z radius\n1 2 3 .5\n");
  EXPECT_EQ(h.cloud.attributes.values("pscale", 1)[0], 0.5);
}

TEST(Off, Colours) {
  const Geometry g =
      read_geometry_bytes("a.off", "COFF 3 1 0\n0 0 0 255 0 51 255\n1 0 0 0 255 0 255\n1 1 0 0 0 255 255\n3 0 1 2\n");
  EXPECT_EQ(g.mesh.attributes.values("Cd", 3)[2], 0.2);
  EXPECT_EQ(g.mesh.triangles.size(), 1u);
}

TEST(VtkXml, CompressedAsParaViewWrites) {
  const Geometry g = read_geometry_bytes("a.vtu", compressed_vtu());
  EXPECT_EQ(g.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 1, 3}, {0, 3, 2}}));
  EXPECT_EQ(g.mesh.attributes.values("v", 3)[4], 4.0);
}

TEST(Usd, HoldsWhatTheFrameHas) {
  const TemporaryFolder folder;
  WriteOptions options;
  options.comments = {"meniscus \"skin\""};
  write_mesh(folder / "m.usda", sample_mesh(), options);
  const std::string mesh = file_content(folder / "m.usda");
  for (const char* part : {"#usda 1.0\n", "\"meniscus \\\"skin\\\"\"", "def Mesh \"surface\"",
                           "faceVertexIndices = [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]", "point3f[] points = [(0.1, 0, 0)",
                           "vector3f[] velocities = [(0.1, 0.2, 0.3)", "color3f[] primvars:displayColor",
                           "normal3f[] normals", "float2[] primvars:uv", "subdivisionScheme = \"none\"", "upAxis = \"Y\""})
    EXPECT_NE(mesh.find(part), mesh.npos) << part;
  write_cloud(folder / "c.usda", sample_cloud(), options);
  const std::string cloud = file_content(folder / "c.usda");
  for (const char* part :
       {"def Points \"surface\"", "float[] widths = [0.2, 0.4, 0.6, 0.8]", "int64[] ids = [7, 3, 2147483647, 0]"})
    EXPECT_NE(cloud.find(part), cloud.npos) << part;
  EXPECT_THROW(read_geometry(folder / "c.usda"), IoError);
}

TEST(Usd, DocumentsAndCollectionsNameTheirFrames) {
  const TemporaryFolder folder;
  const std::vector<SequenceFile> frames = {{1, "s.0001.usda"}, {2, "s.0002.usda"}, {3.5, "s&t.usda"}};
  write_usd_sequence(folder / "s.usda", frames, {});
  const std::string usd = file_content(folder / "s.usda");
  for (const char* part : {"defaultPrim = \"sequence\"", "startTimeCode = 1", "endTimeCode = 3.5", "timeCodesPerSecond = 24",
                           "prepend references = @./s.0002.usda@",
                           "1: \"invisible\",\n            2: \"inherited\",\n            3.5: \"invisible\""})
    EXPECT_NE(usd.find(part), usd.npos) << part;
  write_pvd(folder / "s.pvd", frames, {});
  const std::string pvd = file_content(folder / "s.pvd");
  for (const char* part : {"<Collection>", "timestep=\"3.5\" part=\"0\" file=\"s&amp;t.usda\""})
    EXPECT_NE(pvd.find(part), pvd.npos) << part;
}

TEST(Reading, OtherKindsOfFilesAreNamed) {
  EXPECT_THROW(read_geometry_bytes("-", "{ \"format\": 1, \"x\": 2 }\n"), IoError);
  EXPECT_THROW(read_geometry_bytes("a.vdb", std::string(" BDV\0\0\0\0", 8)), IoError);
}

TEST(Bgeo, AttributesAndPolygons) {
  const Geometry g = read_geometry_bytes("a.bgeo", bgeo(true));
  EXPECT_EQ(g.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
  EXPECT_EQ(g.mesh.attributes.integers("id")[3], 13);
  EXPECT_EQ(g.mesh.attributes.values("v", 3)[3 * 2 + 1], 3.0);
}

TEST(Vtk, PointDataOfAllKinds) {
  const Geometry g = read_geometry_bytes(
      "a.vtk", vtk_text("5.1", "CELLS 3 7\nOFFSETS vtktypeint64\n0 4 7\nCONNECTIVITY vtktypeint64\n0 1 3 2 0 1 2\n"));
  EXPECT_EQ(g.mesh.triangles, (std::vector<Triangle>{{0, 1, 3}, {0, 3, 2}, {0, 1, 2}}));
  const Attributes& a = g.mesh.attributes;
  EXPECT_EQ(a.integers("id")[0], 4);
  EXPECT_EQ(a.values("v", 3)[11], 12.0);
  EXPECT_EQ(a.values("N", 3)[2], 1.0);
  EXPECT_EQ(a.values("density", 1)[3], 4.0);
  EXPECT_EQ(a.values("uv", 2)[7], 1.0);
}

TEST(Lammps, FramesScaledPositionsAndOrder) {
  ReadOptions options;
  const Geometry first = read_geometry_bytes("a.lammpstrj", lammps(), options);
  EXPECT_EQ(first.cloud.attributes.integers("id")[0], 1);
  EXPECT_EQ(first.cloud.positions[0], Vec3(4, 5, 6));
  EXPECT_EQ(first.cloud.attributes.values("v", 3)[2], 1e-3);
  options.frame = 1;
  EXPECT_EQ(read_geometry_bytes("a.lammpstrj", lammps(), options).cloud.positions.at(0), Vec3(5, 10, 0));
  options.frame = 2;
  EXPECT_THROW(read_geometry_bytes("a.lammpstrj", lammps(), options), IoError);
}

bool have_data() { return std::filesystem::exists(data_file("README.md")); }

TEST(RealData, Meshes) {
  if (!have_data()) GTEST_SKIP() << "no shared data on this machine";
  const mesh::Mesh nefertiti = read_mesh(data_file("meshes/nefertiti.obj"));
  EXPECT_EQ(nefertiti.positions.size(), 35002u);
  EXPECT_EQ(nefertiti.triangles.size(), 70000u);
  const mesh::Mesh spot = read_mesh(data_file("meshes/spot.obj"));
  EXPECT_EQ(spot.positions.size(), 11533u);
  EXPECT_FALSE(spot.attributes.has(attribute::kNormal));  // one normal a face: a vertex has several
  EXPECT_EQ(read_mesh(data_file("meshes/fish.obj")).positions.size(), 10786u);
}

TEST(RealData, Particles) {
  if (!have_data()) GTEST_SKIP() << "no shared data on this machine";
  const std::vector<std::pair<const char*, std::size_t>> files = {{"double_dam_break_frame_01_4732_particles.vtk", 4732},
                                                                  {"double_dam_break_frame_26_4732_particles.vtk", 4732},
                                                                  {"ParticleData_Fluid_5.vtk", 4732},
                                                                  {"ParticleData_Fluid_50.bgeo", 4732},
                                                                  {"dam_break_frame_9_6859_particles.bgeo", 6859}};
  for (const auto& [name, count] : files) {
    const Geometry g = read_geometry(data_file(std::string("particles/") + name));
    EXPECT_EQ(g.kind, Geometry::Kind::Cloud) << name;
    EXPECT_EQ(g.cloud.size(), count) << name;
    EXPECT_EQ(g.cloud.attributes.values("v", 3).size(), 3 * count) << name;
    EXPECT_EQ(g.cloud.attributes.integers("id").size(), count) << name;
    EXPECT_LT(points::bounds(g.cloud).diameter(), 20) << name;
  }
}

TEST(RealData, Dump) {
  if (!have_data()) GTEST_SKIP() << "no shared data on this machine";
  const std::string path = data_file("particles/drops/drops.lammpstrj");
  EXPECT_EQ(count_frames(path), 40u);
  ReadOptions options;
  options.frame = 39;
  const points::Cloud cloud = read_cloud(path, options);
  EXPECT_EQ(cloud.size(), 7091u);
  EXPECT_EQ(cloud.attributes.integers("id")[7090], 7091);
}

}  // namespace
}  // namespace meniscus::io
