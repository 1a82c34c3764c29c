#include <meniscus/base/error.h>
#include <meniscus/io/atomic_file.h>
#include <meniscus/io/file_bytes.h>
#include <meniscus/io/vdb.h>

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <cctype>
#include <cmath>
#include <sstream>

namespace meniscus::io {
namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;
static_assert(Leaf::DIM == field::Grid::kBrick && Leaf::SIZE == field::Grid::kBrickVoxels);

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
  if (from.getGridClass() == openvdb::GRID_FOG_VOLUME)
    throw IoError(path, "grid '" + from.getName() + "' is a fog volume, not a level set");
  const openvdb::Vec3d size = from.voxelSize();
  const bool uniform = std::abs(size.x() - size.y()) <= 1e-9 * size.x() && std::abs(size.x() - size.z()) <= 1e-9 * size.x();
  const openvdb::Vec3d step = from.indexToWorld(openvdb::Vec3d(1, 1, 1)) - from.indexToWorld(openvdb::Vec3d(0, 0, 0));
  const bool aligned = (step - openvdb::Vec3d(size.x())).length() <= 1e-9 * size.x();
  if (!from.transform().isLinear() || !uniform || !aligned)
    throw IoError(path, "grid '" + from.getName() + "' has a rotated, stretched or perspective transform");
  std::vector<field::Coord> bricks;
  std::vector<float> values;
  bricks.reserve(from.tree().leafCount());
  values.reserve(from.tree().leafCount() * field::Grid::kBrickVoxels);
  for (auto leaf = from.tree().cbeginLeaf(); leaf; ++leaf) {
    const openvdb::Coord o = leaf->origin();
    bricks.push_back({o.x() >> 3, o.y() >> 3, o.z() >> 3});
    const float* data = leaf->buffer().data();
    values.insert(values.end(), data, data + field::Grid::kBrickVoxels);
  }
  const openvdb::Vec3d origin = from.indexToWorld(openvdb::Vec3d(0, 0, 0));
  try {
    return field::Grid(size.x(), Vec3(origin.x(), origin.y(), origin.z()), from.background(), std::move(bricks),
                       std::move(values));
  } catch (const InvalidInput& e) {
    throw IoError(path, e.what());
  }
}

openvdb::FloatGrid::Ptr from_grid(const field::Grid& grid, const WriteOptions& options) {
  auto out = openvdb::FloatGrid::create(static_cast<float>(grid.background()));
  for (std::size_t b = 0; b < grid.bricks().size(); ++b) {
    const auto [i, j, k] = grid.bricks()[b];
    auto* leaf = new Leaf(openvdb::Coord(i * 8, j * 8, k * 8), out->background(), false);
    const auto values = grid.brick(b);
    for (openvdb::Index v = 0; v < Leaf::SIZE; ++v) {
      if (std::abs(values[v]) < out->background())
        leaf->setValueOn(v, values[v]);
      else
        leaf->setValueOff(v, values[v]);
    }
    out->tree().addLeaf(leaf);  // takes it over
  }
  openvdb::tools::signedFloodFill(out->tree());
  out->setName("surface");
  out->setGridClass(openvdb::GRID_LEVEL_SET);
  auto transform = openvdb::math::Transform::createLinearTransform(grid.voxel());
  transform->postTranslate(openvdb::Vec3d(grid.origin().x(), grid.origin().y(), grid.origin().z()));
  out->setTransform(transform);
  std::string comment;
  for (const std::string& line : options.comments) comment += (comment.empty() ? "" : "\n") + line;
  if (!comment.empty()) out->insertMeta("comment", openvdb::StringMetadata(comment));
  return out;
}

/// Writes to memory with the table of offsets that lets other programs pick a grid.
class MemoryArchive : public openvdb::io::Archive {
 public:
  std::string bytes(const openvdb::GridBase::ConstPtr& grid) const {
    std::ostringstream out;
    Archive::write(out, openvdb::GridCPtrVec{grid}, /*seekable=*/true);
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
  std::string bytes = MemoryArchive().bytes(from_grid(grid, options));
  make_identity_reproducible(bytes);
  file.write(bytes);
  file.commit();
}

}  // namespace meniscus::io
