#pragma once

#include "support.h"

#include <meniscus/io/base64.h>

#include <zlib.h>

#include <string>
#include <vector>

namespace meniscus::io {

struct Sample {
  std::string name;  ///< a file name whose extension tells the format
  std::string bytes;
  std::size_t points;
  std::size_t triangles;

  friend void PrintTo(const Sample& sample, std::ostream* out) { *out << sample.name; }
};

inline std::string written(const std::string& name, bool mesh, const WriteOptions& options) {
  const TemporaryFolder folder;
  const std::string path = folder / name;
  if (mesh)
    write_mesh(path, sample_mesh(), options);
  else
    write_cloud(path, sample_cloud(), options);
  return file_content(path);
}

inline std::string gzipped(const std::string& bytes) {
  z_stream s{};
  deflateInit2(&s, 9, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  std::string out(bytes.size() + 256, '\0');
  s.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  s.avail_in = static_cast<uInt>(bytes.size());
  s.next_out = reinterpret_cast<Bytef*>(out.data());
  s.avail_out = static_cast<uInt>(out.size());
  deflate(&s, Z_FINISH);
  out.resize(s.total_out);
  deflateEnd(&s);
  return out;
}

inline std::string big_endian_ply() {
  std::string out =
      "ply\nformat binary_big_endian 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty short z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty list uchar int extra_is_after\n";
  out = out.substr(0, out.find("property list"));
  out +=
      "element face 1\nproperty uchar flag\nproperty list uchar uint vertex_index\nelement edge 1\nproperty int "
      "a\nend_header\n";
  for (int i = 0; i < 4; ++i)
    out += big_endian(double(i & 1)) + big_endian(float(i >> 1)) + big_endian(short(i)) + std::string("\xff\x80\0", 3);
  out += std::string("\1\4", 2) + big_endian(0u) + big_endian(1u) + big_endian(3u) + big_endian(2u) + big_endian(9);
  return out;
}

inline std::string vtk_text(const std::string& version, const std::string& cells) {
  return "# vtk DataFile Version " + version +
         "\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0 1 0 0\n0 1 0 1 1 0\n" + cells +
         "CELL_TYPES 2\n9\n5\nPOINT_DATA 4\nSCALARS id unsigned_int 1\nLOOKUP_TABLE default\n4 3 2 1\nVECTORS velocity "
         "float\n"
         "1 2 3 4 5 6 7 8 9 10 11 12\nNORMALS my%20n float\n0 0 1 0 0 1 0 0 1 0 0 1\nFIELD FieldData 2\ndensity 1 4 "
         "float\n1 2 3 4\n"
         "METADATA\nINFORMATION 0\n\nuv 2 4 double\n0 0 1 0 0 1 1 1\n";
}

inline std::string vtk_binary() {
  std::string out = "# vtk DataFile Version 4.2\ntitle\nBINARY\nDATASET POLYDATA\nPOINTS 4 float\n";
  for (int i = 0; i < 4; ++i) out += big_endian(float(i & 1)) + big_endian(float(i >> 1)) + big_endian(0.5f);
  out += "\nPOLYGONS 1 5\n";
  for (const int i : {4, 0, 1, 3, 2}) out += big_endian(i);
  out += "\nPOINT_DATA 4\nFIELD FieldData 1\nvelocity 3 4 double\n";
  for (int i = 0; i < 12; ++i) out += big_endian(double(i));
  return out + "\n";
}

inline std::string vtk_binary_cloud() {
  std::string out = "# vtk DataFile Version 5.1\ntitle\nBINARY\nDATASET POLYDATA\nPOINTS 3 double\n";
  for (int i = 0; i < 9; ++i) out += big_endian(double(i) / 3);
  out += "\nVERTICES 4 3\nOFFSETS vtktypeint64\n";
  for (const std::int64_t i : {0, 1, 2, 3}) out += big_endian(i);
  out += "\nCONNECTIVITY vtktypeint64\n";
  for (const std::int64_t i : {0, 1, 2}) out += big_endian(i);
  return out + "\nPOINT_DATA 3\nSCALARS pscale float\nLOOKUP_TABLE default\n" + big_endian(1.f) + big_endian(2.f) +
         big_endian(3.f) + "\n";
}

inline std::string bgeo(bool polygons) {
  std::string out = "BgeoV" + big_endian(5);
  for (const int n : {4, polygons ? 2 : 0, 0, 0, 3, 0, 0, 0}) out += big_endian(n);
  const auto field = [](const std::string& name, short size, int type) {
    return big_endian(short(name.size())) + name + big_endian(size) + big_endian(type);
  };
  out += field("id", 1, 1) + big_endian(0) + field("v", 3, 5) + std::string(12, '\0');
  out += field("name", 1, 4) + big_endian(1) + big_endian(short(2)) + "ab";
  for (int i = 0; i < 4; ++i) {
    out += big_endian(float(i & 1)) + big_endian(float(i >> 1)) + big_endian(0.f) + big_endian(1.f) + big_endian(i + 10);
    for (int c = 0; c < 3; ++c) out += big_endian(float(c + i));
    out += big_endian(0);
  }
  if (polygons) {
    out += big_endian(0xFFFFFFFFu) + big_endian(short(2)) + big_endian(1);
    out += big_endian(3) + "<" + big_endian(short(0)) + big_endian(short(1)) + big_endian(short(2));
    out += big_endian(3) + "<" + big_endian(short(1)) + big_endian(short(3)) + big_endian(short(2));
  }
  return out + std::string("\x00\xff", 2);
}

inline std::string lammps() {
  const std::string box = "ITEM: BOX BOUNDS pp pp pp\n0 10\n0 20\n-5 5\n";
  return "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\n" + box +
         "ITEM: ATOMS id type x y z vx vy vz\n2 1 1 2 3 .1 .2 .3\n1 1 4 5 6 0 0 1e-3\n" +
         "ITEM: TIMESTEP\n100\nITEM: NUMBER OF ATOMS\n1\n" + box + "ITEM: ATOMS id element xs ys zs\n1 Ar .5 .5 .5\n";
}

/// A VTU as ParaView writes it by default: appended, zlib-compressed.
inline std::string compressed_vtu() {
  std::string appended;
  std::string arrays[4];
  const auto add = [&](const std::string& raw) {
    std::string packed(compressBound(raw.size()), '\0');
    uLongf size = packed.size();
    compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(raw.data()), raw.size());
    const std::string offset = std::to_string(appended.size());
    for (const std::size_t n : {std::size_t{1}, raw.size(), std::size_t{0}, std::size_t{size}})
      appended += little_endian(static_cast<std::uint32_t>(n));
    appended += packed.substr(0, size);
    return "format=\"appended\" offset=\"" + offset + "\"/>\n";
  };
  std::string points, corners, ends, types = "\5\11";
  for (int i = 0; i < 12; ++i) points += little_endian(float(i % 5));
  for (const std::int64_t i : {0, 1, 2, 0, 1, 3, 2}) corners += little_endian(i);
  for (const std::int64_t i : {3, 7}) ends += little_endian(i);
  std::string out =
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt32\" "
      "compressor=\"vtkZLibDataCompressor\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"4\" NumberOfCells=\"2\">\n";
  out += "<PointData Vectors=\"v\">\n<DataArray type=\"Float32\" Name=\"vel\" NumberOfComponents=\"3\" " + add(points) +
         "</PointData>\n";
  out += "<CellData>\n</CellData>\n<Points>\n<DataArray type=\"Float32\" NumberOfComponents=\"3\" " + add(points) +
         "</Points>\n<Cells>\n";
  out += "<DataArray type=\"Int64\" Name=\"connectivity\" " + add(corners) + "<DataArray type=\"Int64\" Name=\"offsets\" " +
         add(ends);
  out += "<DataArray type=\"UInt8\" Name=\"types\" " + add(types);
  return out + "</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_" + appended +
         "\n</AppendedData>\n</VTKFile>\n";
}

/// Arrays inline in base64.
inline std::string base64_vtp() {
  std::string points;
  for (int i = 0; i < 6; ++i) points += little_endian(double(i));
  const std::string array = encode_base64(little_endian(static_cast<std::uint32_t>(points.size())) + points);
  return "<?xml version='1.0'?>\n<!-- a > b -->\n<VTKFile type='PolyData' byte_order='LittleEndian'><PolyData><Piece "
         "NumberOfPoints='2' "
         "NumberOfVerts='0'>\n<PointData><DataArray type='Int32' Name='id' format='ascii'> 5\n6 </DataArray></PointData>\n"
         "<Points><DataArray type='Float64' NumberOfComponents='3' format='binary'>\n  " +
         array + "\n</DataArray></Points></Piece></PolyData></VTKFile>\n";
}

/// Small good files of every format: what the conformance suites run over. A new reader adds its lines here.
inline std::vector<Sample> good_samples() {
  WriteOptions text;
  text.text = true;
  const std::string obj =
      "# quad\nmtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3//1 -1//-1\n";
  return {
      {"binary.ply", written("a.ply", true, {}), 4, 4},
      {"text.ply", written("a.ply", true, text), 4, 4},
      {"cloud.ply", written("a.ply", false, {}), 4, 0},
      {"big.ply", big_endian_ply(), 4, 2},
      {"written.obj", written("a.obj", true, {}), 4, 4},
      {"hand.obj", obj, 4, 2},
      {"old.vtk", vtk_text("3.0", "CELLS 2 9\n4 0 1 3 2\n3 0 1 2\n"), 4, 3},
      {"new.vtk", vtk_text("5.1", "CELLS 3 7\nOFFSETS vtktypeint64\n0 4 7\nCONNECTIVITY vtktypeint64\n0 1 3 2 0 1 2\n"), 4,
       3},
      {"binary.vtk", vtk_binary(), 4, 2},
      {"points.vtk", vtk_binary_cloud(), 3, 0},
      {"points.bgeo", bgeo(false), 4, 0},
      {"polygons.bgeo", bgeo(true), 4, 2},
      {"zipped.bgeo", gzipped(bgeo(true)), 4, 2},
      {"atoms.lammpstrj", lammps(), 2, 0},
      {"binary.stl", written("a.stl", true, {}), 4, 4},
      {"text.stl", written("a.stl", true, text), 4, 4},
      {"colours.off",
       "COFF # c\n4 2 5\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n# c\n1 1 0 0 0 255 255\n0 1 0 9 9 9 255\n4 0 1 2 3 .5 .5 "
       ".5\n3 0 1 2\n",
       4, 3},
      {"written.csv", written("a.csv", false, {}), 4, 0},
      {"written.xyz", written("a.xyz", false, {}), 4, 0},
      {"german.csv", "name;X;Y;Z;id\nab;1.5;2;3;7\nc;1;2;3;8\n", 2, 0},
      {"paraview.csv", "\"velocity:0\",\"velocity:1\",\"velocity:2\",\"Points:0\",\"Points:1\",\"Points:2\"\n1,2,3,4,5,6\n",
       1, 0},
      {"binary.vtp", written("a.vtp", true, {}), 4, 4},
      {"text.vtp", written("a.vtp", true, text), 4, 4},
      {"binary_cloud.vtp", written("a.vtp", false, {}), 4, 0},
      {"binary_compressed.vtu", compressed_vtu(), 4, 3},
      {"base64.vtp", base64_vtp(), 2, 0},
      {"zipped.lammpstrj.gz", gzipped(lammps()), 2, 0},
  };
}

}  // namespace meniscus::io
