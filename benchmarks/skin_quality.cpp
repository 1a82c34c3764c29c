// How calm, how true to volume and how honest about velocity is a skin, frame by frame, against making every frame's surface
// anew: our own particle surface, and OpenVDB's ParticlesToLevelSet with three Gaussian passes. Without --particles: two
// drops that collide and merge, 200 frames, and the volume of every component.
// Usage: bench_skin_quality [--particles FILE-OR-PATTERN --radius R --voxel H --fps F --min-neighbours N] [--frames N]
//        [--openvdb no] [--csv FILE] [--svg FILE]
#include <meniscus/band/particle_shells.h>
#include <meniscus/band/skin.h>
#include <meniscus/io/sequence.h>

#include <benchmarks/support/curves.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetFilter.h>
#include <openvdb/tools/ParticlesToLevelSet.h>
#include <tests/support/colliding_drops.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <optional>
#include <string>

using namespace meniscus;

namespace {

struct Settings {
  std::string particles, csv, svg;
  double radius = 0.75, voxel = 0.375, fps = 1;
  int min_neighbours = 0;
  std::size_t frames = 200;
  bool openvdb = true;
};

struct Particles {
  using PosType = openvdb::Vec3R;
  const band::ParticleState& state;
  std::size_t size() const { return state.size(); }
  void getPos(std::size_t n, openvdb::Vec3R& x) const { x = openvdb::Vec3R(state.position[n].data()); }
  void getPosRad(std::size_t n, openvdb::Vec3R& x, openvdb::Real& r) const {
    getPos(n, x);
    r = state.radius[n];
  }
};

band::Band openvdb_band(const band::ParticleState& state, double voxel) {
  auto grid = openvdb::createLevelSet<openvdb::FloatGrid>(voxel, band::Band::kHalfWidth);
  openvdb::tools::ParticlesToLevelSet<openvdb::FloatGrid> raster(*grid);
  raster.rasterizeSpheres(Particles{state});
  raster.finalize(true);
  openvdb::tools::LevelSetFilter<openvdb::FloatGrid> filter(*grid);
  for (int pass = 0; pass < 3; ++pass) filter.gaussian(1);
  std::vector<field::Coord> bricks;
  std::vector<float> values;
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
    const openvdb::Coord& o = leaf->origin();
    bricks.push_back({o.x() >> 3, o.y() >> 3, o.z() >> 3});
    values.insert(values.end(), leaf->buffer().data(), leaf->buffer().data() + 512);
  }
  return band::Band(field::Grid(voxel, Vec3::Zero(), static_cast<double>(grid->background()), bricks, values));
}

double volume_of(const band::Band& b) {
  double v = 0;
  for (const band::Component& c : band::measure_components(b, band::label_components(b))) v += c.volume;
  return v;
}

/// A surface made anew every frame, with the figures that a skin reports of itself. Its velocity is the local mean of the
/// particles' velocities.
class Stateless {
 public:
  struct Figures {
    double flicker = 0, volume = 0, residual = 0;
  };
  Figures add(band::Band now, const band::ParticleState& s, double frame) {
    Figures f;
    f.volume = volume_of(now);
    if (before_ && last_) f.flicker = band::flicker(*before_, *last_, now);
    double off = 0;
    std::size_t counted = 0;
    for (const Vec3& x : thrown_) {
      bool known = false;
      const double d = now.sample(x, &known);
      off += known ? std::abs(d) : 0;
      counted += known;
    }
    f.residual = counted > 0 ? off / static_cast<double>(counted) / now.voxel() : 0;
    const band::VelocityGrid velocity(s.position, s.velocity, s.weight, 2 * s.radius.front());
    const band::Crossings c = band::find_crossings(now);
    thrown_.clear();
    for (std::size_t i = 0; i < c.size(); i += 8) thrown_.push_back(c.x.view()[i] + frame * velocity.at(c.x.view()[i]));
    before_ = std::move(last_);
    last_ = std::move(now);
    return f;
  }

 private:
  std::optional<band::Band> before_, last_;
  std::vector<Vec3> thrown_;
};

Settings parse(int argc, char** argv) {
  Settings s;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string key = argv[i], value = argv[i + 1];
    if (key == "--particles") s.particles = value;
    if (key == "--csv") s.csv = value;
    if (key == "--svg") s.svg = value;
    if (key == "--radius") s.radius = std::stod(value);
    if (key == "--voxel") s.voxel = std::stod(value);
    if (key == "--fps") s.fps = std::stod(value);
    if (key == "--min-neighbours") s.min_neighbours = std::stoi(value);
    if (key == "--openvdb") s.openvdb = value != "no";
    if (key == "--frames") s.frames = static_cast<std::size_t>(std::stoi(value));
  }
  return s;
}

}  // namespace

int main(int argc, char** argv) {
  const Settings s = parse(argc, argv);
  openvdb::initialize();
  std::optional<io::ParticleSequence> sequence;
  if (!s.particles.empty()) sequence.emplace(std::vector<std::string>{s.particles});
  test::CollidingDrops drops(5, 4, 0.08);
  const std::size_t frames = sequence ? std::min(s.frames, sequence->frames().size()) : s.frames;

  band::SkinOptions options;
  options.radius = s.radius;
  options.voxel = s.voxel;
  options.surface.min_neighbours = s.min_neighbours;
  band::Skin skin(options);
  Stateless anew, openvdb_anew;
  bench::Curves curves;
  std::string components = "frame,component,volume,goal,error\n";
  std::map<std::string, double> first;
  double worst_component = 0;
  for (std::size_t f = 0; f < frames; ++f) {
    const points::Cloud cloud = sequence ? sequence->read(sequence->frames()[f]) : drops.cloud();
    const long step = sequence && f > 0 ? sequence->frames()[f] - sequence->frames()[f - 1] : 1;
    const double duration = static_cast<double>(step) / s.fps;
    const band::SkinReport r = skin.advance(cloud, duration);
    for (std::size_t c = 0; c < skin.components().size(); ++c) {
      const band::Component& part = skin.components()[c];
      const double error = part.goal ? part.volume / *part.goal - 1 : 0;
      if (part.volume > 100 * std::pow(s.voxel, 3)) worst_component = std::max(worst_component, std::abs(error));
      components += std::to_string(f + 1) + ',' + std::to_string(c + 1) + ',' + std::to_string(part.volume) + ',' +
                    std::to_string(part.goal.value_or(0)) + ',' + std::to_string(error) + '\n';
    }
    const band::ParticleState all = band::particle_frame(cloud, s.radius).state;
    const band::ParticleSurface surface(all, options.surface);
    std::vector<std::pair<std::string, Stateless::Figures>> rows;
    rows.push_back({"skin", {r.flicker, r.volume, r.velocity_residual}});
    rows.push_back({"anew", anew.add(surface.band(s.voxel), all, duration)});
    if (s.openvdb) {
      band::ParticleState counted;  // no strays
      counted.position = surface.positions();
      counted.radius = surface.radii();
      rows.push_back({"OpenVDB", openvdb_anew.add(openvdb_band(counted, s.voxel), all, duration)});
    }
    const double x = static_cast<double>(f + 1);
    for (const auto& [name, row] : rows) {
      const double start = first.try_emplace(name, row.volume).first->second;
      if (f > 1) curves.add("flicker, voxels per frame²", x, {{name, row.flicker}});
      curves.add("volume against the first frame, %", x, {{name, 100 * (row.volume / start - 1)}});
      if (f > 1) curves.add("x + v dt against the next frame, voxels", x, {{name, row.residual}});
    }
    curves.add("largest error of a component's volume, %", x, {{"skin", 100 * r.worst_volume_error}});
    if (!sequence) drops.advance();
  }
  std::fputs(curves.markdown().c_str(), stdout);
  std::printf("\nlargest error of a component's volume: %.3f %%, components at the end: %zu\n", 100 * worst_component,
              skin.components().size());
  if (!s.csv.empty()) std::ofstream(s.csv) << curves.csv() << '\n' << components;
  if (!s.svg.empty()) std::ofstream(s.svg) << curves.svg();
}
