#include <meniscus/band/vdb_grid.h>
#include <meniscus/base/error.h>
#include <meniscus/io/atomic_file.h>
#include <meniscus/io/file_bytes.h>
#include <meniscus/io/vdb.h>

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <cctype>
#include <cmath>
#include <sstream>

namespace meniscus::io {
namespace {

void initialize() {
  static const bool done = [] {
    openvdb::initialize();
    return true;
  }();
  static_cast<void>(done);
}

/// Runs `work` and turns the exceptions of OpenVDB and of streams into ours.
template <class Work>
auto guarded(const std::string& path, const Work& work) {
  initialize();
  try {
    return work();
  } catch (const openvdb::Exception& e) {
    throw IoError(path, std::string("not a readable VDB file: ") + e.what());
  } catch (const std::ios_base::failure&) {
    throw IoError(path, "the VDB data end early");
  } catch (const std::bad_alloc&) {
    throw ResourceLimit(path + ": its grid does not fit into memory");
  }
}

/// All grids of a file. Read from memory, through a stream that throws where OpenVDB would not look whether the data go on.
openvdb::GridPtrVecPtr read_grids(const std::string& path, const ReadOptions& options) {
  std::istringstream stream(load_file(path, options.memory_limit));
  stream.exceptions(std::ios::failbit | std::ios::badbit);
  return openvdb::io::Stream(stream, /*delayLoad=*/false).getGrids();
}

openvdb::FloatGrid::Ptr float_grid(const openvdb::GridPtrVec& grids, const std::string& path,
                                   const std::optional<std::string>& name) {
  for (const openvdb::GridBase::Ptr& grid : grids) {
    if (name && grid->getName() != *name) continue;
    if (grid->isType<openvdb::FloatGrid>()) return openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
    if (name) throw IoError(path, "grid '" + *name + "' holds " + grid->valueType() + ", not float");
  }
  throw IoError(path, name ? "no grid is called '" + *name + "'" : "no float grid is in it");
}

field::Grid to_grid(const openvdb::FloatGrid& from, const std::string& path) {
  const std::string subject = "grid '" + from.getName() + "'";
  if (from.getGridClass() == openvdb::GRID_FOG_VOLUME) throw IoError(path, subject + " is a fog volume, not a level set");
  try {
    return band::from_vdb(from);
  } catch (const InvalidInput& e) {
    throw IoError(path, subject + ": " + e.what());
  }
}

openvdb::FloatGrid::Ptr from_grid(const field::Grid& grid, const WriteOptions& options) {
  openvdb::FloatGrid::Ptr out = band::to_vdb(grid);
  out->setName("surface");
  std::string comment;
  for (const std::string& line : options.comments) comment += (comment.empty() ? "" : "\n") + line;
  if (!comment.empty()) out->insertMeta("comment", openvdb::StringMetadata(comment));
  return out;
}

/// Writes to memory with the table of offsets that lets other programs pick a grid.
class MemoryArchive : public openvdb::io::Archive {
 public:
  std::string bytes(const openvdb::GridCPtrVec& grids) const {
    std::ostringstream out;
    Archive::write(out, grids, /*seekable=*/true);
    return std::move(out).str();
  }
};

/// OpenVDB puts a random identity into the head of every file. Ours is made from the content, so that the same grid gives
/// the same bytes.
void make_identity_reproducible(std::string& bytes) {
  constexpr std::size_t kBegin = 21, kLength = 36;  // after the magic number, three versions and a flag
  const auto is_identity = [&](std::size_t i) {
    return bytes[kBegin + i] == '-' ? i == 8 || i == 13 || i == 18 || i == 23
                                    : std::isxdigit(static_cast<unsigned char>(bytes[kBegin + i])) != 0;
  };
  if (bytes.size() < kBegin + kLength) return;
  for (std::size_t i = 0; i < kLength; ++i)
    if (!is_identity(i)) return;
  std::uint64_t h = 0xCBF29CE484222325ull;
  for (const char c : std::string_view(bytes).substr(kBegin + kLength))
    h = (h ^ static_cast<unsigned char>(c)) * 0x100000001B3ull;
  for (std::size_t i = 0; i < kLength; ++i) {
    if (bytes[kBegin + i] == '-') continue;
    bytes[kBegin + i] = "0123456789abcdef"[h & 15];
    h = (h >> 4) * 0x9E3779B97F4A7C15ull + (h << 60);
  }
}

void write_grids(AtomicFile& file, const openvdb::GridCPtrVec& grids) {
  std::string bytes = MemoryArchive().bytes(grids);
  make_identity_reproducible(bytes);
  file.write(bytes);
  file.commit();
}

openvdb::Vec3SGrid::Ptr velocity_grid(const openvdb::FloatGrid& surface, const field::Grid& grid,
                                      std::span<const Vec3> velocity) {
  const auto out = openvdb::Vec3SGrid::create();
  out->setName("velocity");
  out->setTransform(surface.transform().copy());
  out->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  openvdb::Vec3SGrid::Accessor accessor = out->getAccessor();
  for (std::size_t b = 0; b < grid.bricks().size(); ++b) {
    const field::Coord& c = grid.bricks()[b];
    auto* leaf = accessor.touchLeaf({8 * c[0], 8 * c[1], 8 * c[2]});
    for (openvdb::Index n = 0; n < field::Grid::kBrickVoxels; ++n) {
      if (std::abs(grid.brick(b)[n]) >= static_cast<float>(grid.background())) continue;
      leaf->setValueOn(n, openvdb::Vec3s(velocity[b * field::Grid::kBrickVoxels + n].cast<float>().eval().data()));
    }
  }
  return out;
}

}  // namespace

field::Grid read_vdb(const std::string& path, const std::optional<std::string>& name, const ReadOptions& options) {
  return guarded(path, [&] { return to_grid(*float_grid(*read_grids(path, options), path, name), path); });
}

std::vector<std::string> vdb_grids(const std::string& path, const ReadOptions& options) {
  return guarded(path, [&] {
    const openvdb::GridPtrVecPtr grids = read_grids(path, options);
    std::vector<std::string> names;
    for (const openvdb::GridBase::Ptr& grid : *grids) names.push_back(grid->getName() + " (" + grid->valueType() + ")");
    return names;
  });
}

void write_vdb(const std::string& path, const field::Grid& grid, const WriteOptions& options) {
  initialize();
  AtomicFile file(path, options);  // first: says no before the work is done
  write_grids(file, {from_grid(grid, options)});
}

void write_vdb(const std::string& path, const field::Grid& grid, std::span<const Vec3> velocity,
               const WriteOptions& options) {
  if (velocity.size() != grid.bricks().size() * field::Grid::kBrickVoxels)
    throw InvalidInput("a velocity grid needs one vector per sample");
  initialize();
  AtomicFile file(path, options);
  const openvdb::FloatGrid::Ptr surface = from_grid(grid, options);
  write_grids(file, {surface, velocity_grid(*surface, grid, velocity)});
}

}  // namespace meniscus::io
