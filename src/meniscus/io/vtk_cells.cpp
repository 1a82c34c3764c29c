#include <meniscus/io/triangulate.h>
#include <meniscus/io/vtk_cells.h>

#include <array>

namespace meniscus::io {

bool add_vtk_cell(VtkCell type, std::span<const std::int64_t> c, std::vector<Triangle>& triangles) {
  switch (type) {
    case VtkCell::Vertex:
    case VtkCell::PolyVertex: return true;
    case VtkCell::Triangle:
    case VtkCell::Polygon:
    case VtkCell::Quad: add_polygon(c, triangles); return true;
    case VtkCell::Pixel:  // a quad with its corners in the order of memory
      if (c.size() == 4) add_polygon(std::array{c[0], c[1], c[3], c[2]}, triangles);
      return true;
    case VtkCell::Strip:  // every second triangle is turned round
      for (std::size_t i = 2; i < c.size(); ++i)
        add_polygon(i % 2 == 0 ? std::array{c[i - 2], c[i - 1], c[i]} : std::array{c[i - 1], c[i - 2], c[i]}, triangles);
      return true;
  }
  return false;
}

}  // namespace meniscus::io
