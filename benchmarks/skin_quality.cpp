// How calm, how true to volume and how honest about velocity is a skin, frame by frame, against making every frame's surface
// anew: our own particle surface, and OpenVDB's ParticlesToLevelSet with three Gaussian passes. Without --particles: two
// drops that collide and merge, 200 frames, and the volume of every component.
// Usage: bench_skin_quality [--particles FILE-OR-PATTERN --radius R --voxel H --fps F --min-neighbours N] [--frames N]
//        [--tension B] [--inner R] [--first F] [--still rest|coast] [--thin F] [--openvdb no] [--csv FILE] [--svg FILE
//        --title TEXT]
// --still makes a run of frame --first alone: its particles rest, or go straight on with their velocities (the frame as it
// is stands in the middle). --thin takes every second particle away from frame F on and lets the others have their liquid.
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
  std::string particles, csv, svg, still, title = "Skin, and surfaces made anew in every frame";
  double radius = 0.75, voxel = 0.375, fps = 1, inner = 0;
  std::optional<double> tension;
  int min_neighbours = 0;
  std::size_t frames = 200, first = 1, thin = 0;
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

/// The largest way, voxels, of the surface `now` from the surface `before`; 4 stands for more.
double largest_way(const band::Band& before, const band::Band& now) {
  const band::Crossings c = band::find_crossings(now);
  double most = 0;
  for (std::size_t i = 0; i < c.size(); ++i) most = std::max(most, std::abs(before.sample(c.x.view()[i])));
  return most / now.voxel();
}

/// Of a frame, against those before.
struct Figures {
  double flicker = 0, volume = 0, residual = 0, way = 0;
};

/// A surface made anew every frame, with the figures that a skin reports of itself. Its velocity is the local mean of the
/// particles' velocities.
class Stateless {
 public:
  Figures add(band::Band now, const band::ParticleState& s, double frame) {
    Figures f;
    f.volume = volume_of(now);
    if (last_) f.way = largest_way(*last_, now);
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

/// Where frames come from.
class Frames {
 public:
  explicit Frames(const Settings& s) : s_(s) {
    if (!s.particles.empty()) sequence_.emplace(std::vector<std::string>{s.particles});
    if (s.particles.empty()) drops_.emplace(5, 4, 0.08);
    if (!s.still.empty()) at_ = sequence_ ? sequence_->read(sequence_->frames().at(s.first - 1)) : drops_->cloud();
  }

  std::size_t count() const {
    return sequence_ && s_.still.empty() ? std::min(s_.frames, sequence_->frames().size()) : s_.frames;
  }
  /// Seconds between frame `f` and the one before.
  double duration(std::size_t f) const {
    if (!sequence_ || !s_.still.empty() || f == 0) return 1 / s_.fps;
    return static_cast<double>(sequence_->frames()[f] - sequence_->frames()[f - 1]) / s_.fps;
  }
  points::Cloud frame(std::size_t f) {
    points::Cloud cloud = whole(f);
    if (s_.thin == 0 || f + 1 < s_.thin) return cloud;
    std::vector<std::size_t> keep;
    for (std::size_t i = 0; i < cloud.size(); i += 2) keep.push_back(i);
    cloud = points::gathered(cloud, keep);
    cloud.attributes.set(attribute::kRadius, 1, std::vector<double>(cloud.size(), std::cbrt(2.0) * s_.radius));
    return cloud;
  }

 private:
  points::Cloud whole(std::size_t f) {
    if (s_.still.empty()) {
      if (sequence_) return sequence_->read(sequence_->frames()[f]);
      if (f > 0) drops_->advance();
      return drops_->cloud();
    }
    points::Cloud cloud = at_;
    const auto v = cloud.attributes.values(attribute::kVelocity, 3);
    const double time = (static_cast<double>(f) - 0.5 * static_cast<double>(s_.frames - 1)) / s_.fps;
    for (std::size_t i = 0; i < v.size() / 3; ++i) {
      if (s_.still == "coast") cloud.positions[i] += time * Vec3(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
      if (s_.still == "rest") std::fill_n(v.begin() + static_cast<std::ptrdiff_t>(3 * i), 3, 0.0);
    }
    return cloud;
  }

  const Settings& s_;
  std::optional<io::ParticleSequence> sequence_;
  std::optional<test::CollidingDrops> drops_;
  points::Cloud at_;
};

Settings parse(int argc, char** argv) {
  Settings s;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string key = argv[i], value = argv[i + 1];
    if (key == "--particles") s.particles = value;
    if (key == "--csv") s.csv = value;
    if (key == "--svg") s.svg = value;
    if (key == "--title") s.title = value;
    if (key == "--still") s.still = value;
    if (key == "--radius") s.radius = std::stod(value);
    if (key == "--voxel") s.voxel = std::stod(value);
    if (key == "--fps") s.fps = std::stod(value);
    if (key == "--min-neighbours") s.min_neighbours = std::stoi(value);
    if (key == "--openvdb") s.openvdb = value != "no";
    if (key == "--frames") s.frames = std::stoul(value);
    if (key == "--first") s.first = std::stoul(value);
    if (key == "--thin") s.thin = std::stoul(value);
    if (key == "--tension") s.tension = std::stod(value);
    if (key == "--inner") s.inner = std::stod(value);
  }
  return s;
}

constexpr const char* kFlicker = "Flicker, voxels per frame²";
constexpr const char* kVolume = "Volume against the first frame's, %";
constexpr const char* kResidual = "x + v dt against the next frame's surface, voxels";
constexpr const char* kComponent = "Largest error of a component's volume, %";
constexpr const char* kWay = "Largest way of the surface in a frame, voxels";

}  // namespace

int main(int argc, char** argv) {
  const Settings s = parse(argc, argv);
  openvdb::initialize();
  Frames source(s);

  band::SkinOptions options;
  options.radius = s.radius;
  options.voxel = s.voxel;
  options.tension = s.tension;
  options.shells.inner = s.inner;
  options.surface.min_neighbours = s.min_neighbours;
  band::Skin skin(options);
  Stateless anew, openvdb_anew;
  std::optional<band::Band> last;
  bench::Curves curves;
  std::string components = "frame,component,volume,goal,error\n";
  std::map<std::string, double> first;
  double worst_component = 0;
  for (std::size_t f = 0; f < source.count(); ++f) {
    const points::Cloud cloud = source.frame(f);
    const double duration = source.duration(f);
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
    std::vector<std::pair<std::string, Figures>> rows;
    rows.push_back({"skin", {r.flicker, r.volume, r.velocity_residual, last ? largest_way(*last, skin.band()) : 0}});
    last = skin.band();
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
      if (f > 0 && s.thin > 0) curves.add(kWay, x, {{name, row.way}});
      if (f > 1) curves.add(kFlicker, x, {{name, row.flicker}});
      curves.add(kVolume, x, {{name, 100 * (row.volume / start - 1)}});
      if (f > 1 && s.thin == 0) curves.add(kResidual, x, {{name, row.residual}});
    }
    if (s.thin == 0) curves.add(kComponent, x, {{"skin", 100 * r.worst_volume_error}});
  }
  std::fputs(curves.markdown().c_str(), stdout);
  std::printf("\nlargest error of a component's volume: %.3f %%, components at the end: %zu\n", 100 * worst_component,
              skin.components().size());
  if (!s.csv.empty()) std::ofstream(s.csv) << curves.csv() << '\n' << components;
  if (!s.svg.empty()) std::ofstream(s.svg) << curves.svg(s.title);
}
