#pragma once

#include <meniscus/io/format.h>

namespace meniscus::io {

class AtomicFile;

/// XYZ and CSV: one point a line, numbers separated by blanks, commas or semicolons (whatever the first line has); lines
/// with
/// '#' are comments. A first line of names tells the columns (x, y and z in any order and case; ParaView's Points:0 …);
/// without one they are x y z, then a normal if there are six and the last three are of unit length. Columns of words are
/// skipped. Numbers use a decimal point: a decimal comma is an error.
RawGeometry read_table(const Source& source, ReadReport& report);

/// CSV with a line of names and every attribute.
void write_csv(AtomicFile& file, const GeometryView& geometry, const WriteOptions& options);

/// x y z, and nx ny nz when there are normals.
void write_xyz(AtomicFile& file, const GeometryView& geometry, const WriteOptions& options);

}  // namespace meniscus::io
