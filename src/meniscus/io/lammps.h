#pragma once

#include <meniscus/io/format.h>

namespace meniscus::io {

/// LAMMPS text dump, time step number `frame` of the file (0 is the first): id, x y z (or xu, xs, xsu: scaled ones are
/// multiplied by the box), vx vy vz; other columns ride along. Atoms are put in the order of their id, because LAMMPS writes
/// them in any.
RawGeometry read_lammps(const Source& source, std::size_t frame, ReadReport& report);

/// Extensions of dump files: "lammpstrj", "dump", "lammps".
bool is_lammps_extension(std::string_view extension);

/// Where the time steps start, in bytes.
std::vector<std::size_t> lammps_frames(std::string_view bytes);

}  // namespace meniscus::io
