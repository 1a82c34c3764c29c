// Promises 13 to 16 over every format: whatever the bytes, a reader gives a result or a typed error.
#include "samples.h"

#include <meniscus/base/error.h>

#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <functional>
#include <locale>

namespace meniscus::io {
namespace {

std::size_t point_count(const Geometry& g) {
  return g.kind == Geometry::Kind::Mesh ? g.mesh.positions.size() : g.cloud.size();
}

/// Reads and checks what every result promises; typed errors are fine.
void expect_result_or_typed_error(const std::string& name, const std::string& bytes, const std::string& what) {
  try {
    const Geometry g = read_geometry_bytes(name, bytes);
    const auto& positions = g.kind == Geometry::Kind::Mesh ? g.mesh.positions : g.cloud.positions;
    const Attributes& attributes = g.kind == Geometry::Kind::Mesh ? g.mesh.attributes : g.cloud.attributes;
    ASSERT_LE(positions.size(), bytes.size() * 4 + 100) << name << " " << what;
    for (const Vec3& p : positions) ASSERT_TRUE(p.allFinite()) << name << " " << what;
    for (const Attribute& a : attributes) ASSERT_EQ(a.size(), positions.size()) << name << " " << what << " " << a.name;
    for (const Triangle& t : g.mesh.triangles)
      for (const int v : t) ASSERT_TRUE(v >= 0 && static_cast<std::size_t>(v) < positions.size()) << name << " " << what;
  } catch (const Error& e) {
    ASSERT_NE(std::string(e.what()).find(name), std::string::npos) << "the error names no file: " << e.what();
  } catch (const std::exception& e) {
    FAIL() << name << " " << what << ": " << e.what();
  }
}

class Conformance : public testing::TestWithParam<Sample> {};

TEST_P(Conformance, GoodFileIsRead) {
  const Sample& s = GetParam();
  ReadReport report;
  const Geometry g = read_geometry_bytes(s.name, s.bytes, {}, &report);
  EXPECT_EQ(point_count(g), s.points);
  EXPECT_EQ(g.mesh.triangles.size(), s.triangles);
  EXPECT_EQ(report.dropped, 0u);
}

TEST_P(Conformance, FormatIsFoundByContent) {
  const Sample& s = GetParam();
  EXPECT_EQ(point_count(read_geometry_bytes("-", s.bytes)), s.points);
}

TEST_P(Conformance, EveryPrefix) {
  const Sample& s = GetParam();
  for (std::size_t n = 0; n < s.bytes.size(); ++n)
    expect_result_or_typed_error(s.name, s.bytes.substr(0, n), "cut after " + std::to_string(n));
}

TEST_P(Conformance, EveryByteChanged) {
  const Sample& s = GetParam();
  for (std::size_t i = 0; i < s.bytes.size(); ++i)
    for (const int change : {1, -1, 256, 511}) {
      std::string bytes = s.bytes;
      bytes[i] = static_cast<char>(change > 1 ? change - 256 : bytes[i] + change);
      expect_result_or_typed_error(s.name, bytes, "byte " + std::to_string(i) + " change " + std::to_string(change));
    }
}

INSTANTIATE_TEST_SUITE_P(Formats, Conformance, testing::ValuesIn(good_samples()), [](const auto& sample) {
  std::string name = sample.param.name;
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name;
});

bool is_text(const Sample& s) {
  return s.name.find("binary") == s.name.npos && s.name.find("zipped") == s.name.npos &&
         s.name.find("bgeo") == s.name.npos && s.name != "cloud.ply" && s.name != "big.ply" && s.name != "points.vtk";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != text.npos; at += to.size()) text.replace(at, from.size(), to);
  return text;
}

void expect_same(const Geometry& a, const Geometry& b, const std::string& what) {
  EXPECT_EQ(a.kind, b.kind) << what;
  EXPECT_EQ(a.mesh.positions, b.mesh.positions) << what;
  EXPECT_EQ(a.cloud.positions, b.cloud.positions) << what;
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles) << what;
  EXPECT_EQ(difference(a.mesh.attributes, b.mesh.attributes), "") << what;
  EXPECT_EQ(difference(a.cloud.attributes, b.cloud.attributes), "") << what;
}

TEST(TextFormats, LineEndsMarksAndBlanksDoNotMatter) {
  for (const Sample& s : good_samples()) {
    if (!is_text(s)) continue;
    const Geometry expected = read_geometry_bytes(s.name, s.bytes);
    const auto check = [&](const std::string& bytes, const char* what) {
      expect_same(read_geometry_bytes(s.name, bytes), expected, s.name + " " + what);
    };
    check("\xEF\xBB\xBF" + s.bytes, "with a byte-order mark");
    check(replaced(s.bytes, "\n", "\r\n"), "with CRLF");
    check(replaced(s.bytes, "\n", "\r"), "with CR");
    check(s.bytes.substr(0, s.bytes.size() - 1), "without the last line end");
    const std::size_t first = s.bytes.find('\n');  // may be a fixed mark
    check(s.bytes.substr(0, first) + replaced(s.bytes.substr(first), " ", "\t"), "with tabs");
  }
}

TEST(TextFormats, DecimalCommaIsAnError) {
  WriteOptions text_options;
  text_options.text = true;
  const std::string text_vtp = written("a.vtp", true, text_options);
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0,5 1,5 "
      "2\n";
  EXPECT_THROW(read_geometry_bytes("a.ply", ply), IoError);
  EXPECT_THROW(read_geometry_bytes("a.obj", "v 0,5 1,5 2\n"), IoError);
  EXPECT_THROW(read_geometry_bytes("a.lammpstrj", replaced(lammps(), "1 2 3", "1,5 2 3")), IoError);
  EXPECT_THROW(read_geometry_bytes("a.vtk", replaced(vtk_text("3.0", ""), "0 0 0 1", "0,5 0 0 1")), IoError);
  EXPECT_THROW(read_geometry_bytes("a.off", "OFF\n1 0 0\n0,5 1,5 2\n"), IoError);
  EXPECT_THROW(read_geometry_bytes("a.stl", "solid\nvertex 0,5 1,5 2\nendsolid\n"), IoError);
  for (const char* text : {"0,5 1,5 2,5\n", "0,5\t1,5\t2,5\n", "0,5;1,5;2,5\n", "0,5,1,5,2,5\n", "x;y;z\n0,5;1,5;2,5\n",
                           "x,y,z\n0,5,1,5,2,5\n", "x;y;z;w\n1;2;3;0,5\n", "1 2 3\n1,5 2 3\n"})
    EXPECT_THROW(read_geometry_bytes("a.csv", text), IoError) << text;
  EXPECT_THROW(read_geometry_bytes("a.vtp", replaced(text_vtp, "0 0 -0.0025", "0 0 -0,0025")), IoError);
}

TEST(TextFormats, ErrorsNameTheLine) {
  try {
    read_geometry_bytes("a.obj", "v 0 0 0\r\nv 1 0 0\r\nv 1 x 0\r\n");
    FAIL();
  } catch (const IoError& e) {
    EXPECT_EQ(e.place().kind, FilePlace::Kind::Line);
    EXPECT_EQ(e.place().number, 3u);
    EXPECT_STREQ(e.what(), "a.obj:3: not a number: 'x'");
  }
}

/// A locale whose decimal point is a comma, whether or not the machine has one installed.
struct CommaPunctuation : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(TextFormats, TheLocaleDoesNotMatter) {
  const std::string before = written("a.obj", true, {});
  const Geometry expected = read_geometry_bytes("a.obj", before);
  const std::locale old = std::locale::global(std::locale(std::locale::classic(), new CommaPunctuation));
  for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "de_DE"})
    if (std::setlocale(LC_ALL, name) != nullptr) break;
  const std::string after = written("a.obj", true, {});
  const Geometry read = read_geometry_bytes("a.obj", before);
  std::setlocale(LC_ALL, "C");
  std::locale::global(old);
  EXPECT_EQ(after, before);
  expect_same(read, expected, "with a decimal comma in the locale");
}

TEST(DeclaredCounts, AreCheckedBeforeAllocating) {
  const std::string huge = "4000000000000";
  const std::string ply_head = "ply\nformat ascii 1.0\nelement vertex ";
  const std::string ply_rest = "\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n";
  EXPECT_THROW(read_geometry_bytes("a.ply", ply_head + huge + ply_rest), IoError);
  EXPECT_THROW(read_geometry_bytes("a.ply", replaced(ply_head, "ascii", "binary_little_endian") + huge + ply_rest), IoError);
  EXPECT_THROW(read_geometry_bytes("a.ply", replaced(written("a.ply", true, {}), "element face 4", "element face " + huge)),
               IoError);
  EXPECT_THROW(read_geometry_bytes("a.lammpstrj", replaced(lammps(), "ATOMS\n2\n", "ATOMS\n" + huge + "\n")), IoError);
  for (const std::string& text : {vtk_binary(), vtk_binary_cloud(), vtk_text("3.0", "CELLS 2 9\n4 0 1 3 2\n3 0 1 2\n")})
    for (const char* key : {"POINTS ", "POINT_DATA ", "POLYGONS ", "CELLS ", "VERTICES ", "CELL_TYPES "}) {
      if (text.find(key) == text.npos) continue;
      EXPECT_THROW(read_geometry_bytes("a.vtk", replaced(text, key, std::string(key) + "400000000000")), IoError) << key;
    }
  std::string points = bgeo(false);
  points.replace(9, 4, "\x7f\xff\xff\xff");
  EXPECT_THROW(read_geometry_bytes("a.bgeo", points), IoError);
  const std::string off = "OFF\n1 1 0\n0 0 0\n1 0\n";
  EXPECT_THROW(read_geometry_bytes("a.off", replaced(off, "1 1 0", huge + " 1 0")), IoError);
  EXPECT_THROW(read_geometry_bytes("a.off", replaced(off, "1 1 0", "1 " + huge + " 0")), IoError);
  EXPECT_THROW(read_geometry_bytes("a.off", replaced(off, "1 0\n", huge + " 0\n")), IoError);
  EXPECT_THROW(read_geometry_bytes("a.vtp", replaced(base64_vtp(), "NumberOfPoints='2'", "NumberOfPoints='" + huge + "'")),
               IoError);
  std::string blocks = compressed_vtu();
  blocks.replace(blocks.rfind("_\1") + 1, 4, "\xff\xff\xff\x7f");
  EXPECT_THROW(read_geometry_bytes("a.vtu", blocks), Error);
  // Arrays may share appended bytes: together they must stay within the limit, too.
  std::string shared = written("a.vtp", false, {});
  const std::size_t array = shared.find("<DataArray"), end = shared.find("/>", array) + 2;
  for (int i = 0; i < 900; ++i) shared.insert(end, shared.substr(array, end - array));
  ReadOptions small;
  small.memory_limit = 4000;
  EXPECT_THROW(read_geometry_bytes("a.vtp", shared, small), ResourceLimit);
  // An element without properties takes no bytes: any count of it must take no time either.
  const std::string nothing = "ply\nformat ascii 1.0\nelement nothing " + huge + "\nelement vertex 1" + ply_rest;
  EXPECT_EQ(read_geometry_bytes("a.ply", nothing).cloud.size(), 1u);
}

TEST(AbsurdNumbers, ArePointsDroppedAndCounted) {
  for (const char* bad : {"nan", "-inf", "1e400", "-1e400", "1e30", "infinity"}) {
    ReadReport report;
    const Geometry g = read_geometry_bytes("a.obj", std::string("v 0 0 0\nv 1 ") + bad + " 0\nv 2 0 0\n", {}, &report);
    EXPECT_EQ(g.cloud.positions, (std::vector<Vec3>{Vec3(0, 0, 0), Vec3(2, 0, 0)})) << bad;
    EXPECT_EQ(report.dropped, 1u) << bad;
    ASSERT_EQ(report.warnings.size(), 1u) << bad;
    EXPECT_EQ(report.warnings[0].code, "dropped-points");
  }
  const Geometry tiny = read_geometry_bytes("a.obj", "v 1e-400 -1e-400 4e-324\n");
  EXPECT_EQ(tiny.cloud.positions.at(0), Vec3(0, 0, 4e-324));
}

TEST(AbsurdNumbers, InVelocitiesDropTheAtom) {
  ReadReport report;
  const Geometry g = read_geometry_bytes("a.lammpstrj", replaced(lammps(), ".1 .2 .3", ".1 nan .3"), {}, &report);
  EXPECT_EQ(g.cloud.size(), 1u);
  EXPECT_EQ(report.dropped, 1u);
}

TEST(AbsurdNumbers, InMeshesAreErrorsWhereAFaceUsesThem) {
  const std::string faces = "f 1 2 3\n";
  EXPECT_THROW(read_geometry_bytes("a.obj", "v 0 0 0\nv 1 nan 0\nv 2 0 0\n" + faces), IoError);
  ReadReport report;
  const Geometry g = read_geometry_bytes("a.obj", "v nan 0 0\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 2 3 4\n", {}, &report);
  EXPECT_EQ(g.mesh.positions.size(), 3u);
  EXPECT_EQ(g.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  EXPECT_EQ(report.dropped, 1u);
}

TEST(AbsurdNumbers, IndicesOutOfRangeAreErrors) {
  for (const char* face : {"f 1 2 4\n", "f 1 2 -4\n", "f 1 2 0\n", "f 1 2 99999999999\n", "f 1 2 99999999999999999999\n"})
    EXPECT_THROW(read_geometry_bytes("a.obj", std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\n") + face), IoError) << face;
}

TEST(AbsurdNumbers, IsFiniteWorksInThisBuild) {
  volatile double zero = 0;
  EXPECT_FALSE(std::isfinite(1 / zero));
  EXPECT_FALSE(std::isfinite(zero / zero));
}

TEST(Gzip, BombsAreRefused) {
  const std::string zeros(1 << 20, '\0');
  z_stream s{};
  deflateInit2(&s, 9, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  std::string bomb(1 << 20, '\0');
  s.next_out = reinterpret_cast<Bytef*>(bomb.data());
  s.avail_out = static_cast<uInt>(bomb.size());
  for (int i = 0; i < 200; ++i) {
    s.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(zeros.data()));
    s.avail_in = static_cast<uInt>(zeros.size());
    deflate(&s, i == 199 ? Z_FINISH : Z_NO_FLUSH);
  }
  bomb.resize(s.total_out);
  deflateEnd(&s);
  EXPECT_THROW(read_geometry_bytes("bomb.ply.gz", bomb), ResourceLimit);
  ReadOptions small;
  small.memory_limit = 100;
  EXPECT_THROW(read_geometry_bytes("a.lammpstrj.gz", gzipped(lammps()), small), ResourceLimit);
}

}  // namespace
}  // namespace meniscus::io
