#include <meniscus/band/band.h>

#include <algorithm>
#include <cmath>

namespace meniscus::band {

Band::Band(const field::Grid& grid) : Band(grid.voxel(), grid.origin()) {
  bricks_.assign(grid.bricks().begin(), grid.bricks().end());
  values_.reserve(bricks_.size() * kBrickNodes);
  const float known = static_cast<float>(grid.background());
  for (std::size_t b = 0; b < bricks_.size(); ++b)
    for (const float v : grid.brick(b)) {
      // A narrower grid's background means "at least this far".
      const float wide = std::abs(v) >= known ? std::copysign(background_, v) : v;
      values_.push_back(std::clamp(wide, -background_, background_));
    }
  index();
  link({});
}

field::Grid Band::grid() const { return {voxel_, origin_, static_cast<double>(background_), bricks_, values_}; }

}  // namespace meniscus::band
