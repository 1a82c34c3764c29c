#include <meniscus/base/error.h>
#include <meniscus/io/manifest.h>
#include <meniscus/scene/build_field.h>
#include <meniscus/scene/file_field.h>
#include <meniscus/scene/point_surface.h>
#include <meniscus/scene/surface_source.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>

namespace meniscus::scene {
namespace {

constexpr double kVoxelsPerDiameter = 128;
constexpr double kVoxelsPerRadius = 2;

bool is_pattern(const std::string& path) { return io::FramePattern::parse(path).has_value(); }

/// A file that exists and holds triangles.
bool holds_faces(const io::Geometry& g) { return g.kind == io::Geometry::Kind::Mesh && !g.mesh.triangles.empty(); }

/// Whether a leaf of the scene is a cloud, whose borders may be open.
bool names_points(const nlohmann::json& node) {
  if (node.is_object() && node.contains("type") && node["type"] == "points") return true;
  if (node.is_structured())
    for (const auto& child : node)
      if (names_points(child)) return true;
  return false;
}

double smallest_radius(const points::Cloud& cloud, std::optional<double> radius) {
  if (radius) return *radius;
  const auto own = cloud.attributes.values(attribute::kRadius, 1);
  if (own.empty()) return default_radius(cloud).value_or(0);
  return *std::min_element(own.begin(), own.end());
}

}  // namespace

SurfaceSource::SurfaceSource(const std::vector<std::string>& inputs, SourceOptions options, const RunControl& run)
    : inputs_(inputs), options_(std::move(options)) {
  if (inputs_.empty()) throw InvalidInput("an input file is needed");
  if (options_.radius && !(*options_.radius > 0)) throw InvalidInput("the radius must be above zero");
  if (options_.fps && !(*options_.fps > 0)) throw InvalidInput("frames per second must be above zero");
  const std::string format = io::format_of_input(inputs_[0]);
  const bool one_file = inputs_.size() == 1 && !is_pattern(inputs_[0]);

  if (one_file && format == "json") {
    kind_ = Kind::Scene;
    document_ = Document::load(inputs_[0]);
    for (const auto& [name, value] : options_.set) document_->set_parameter(name, value);
    field_ = build_field(*document_, run);
    open_ = names_points(document_->json()["surface"]);
    if (options_.frames) frames_ = *options_.frames;
    return;
  }
  if (!options_.set.empty()) throw InvalidInput("--set changes parameters of a scene; " + inputs_[0] + " is none");
  if (one_file && format == "vdb") {
    kind_ = Kind::Grid;
    field_ = field_from_grid(inputs_[0], run);
    return;
  }
  if (one_file && format == "msurf") {
    kind_ = Kind::Points;
    open_ = true;
    field_ = pointset::field_of(read_point_surface(inputs_[0]));
    return;
  }
  if (one_file && io::count_frames(inputs_[0]) <= 1) {
    io::ReadReport read;
    io::Geometry g = io::read_geometry(inputs_[0], {}, &read);
    if (holds_faces(g)) {
      told(read);
      kind_ = Kind::Mesh;
      field_ = field_from_mesh(g.mesh, inputs_[0], options_.voxel, run);
      return;
    }
    if (!options_.radius && !options_.frames && is_point_surface(g.cloud)) {
      told(read);
      kind_ = Kind::Points;
      open_ = true;
      field_ = pointset::field_of(point_surface(std::move(g.cloud), inputs_[0], {}, nullptr, run));
      return;
    }
  }
  kind_ = Kind::Particles;
  io::SequenceOptions sequence;
  sequence.frames = options_.frames;
  sequence.missing = options_.missing;
  sequence_.emplace(inputs_, sequence);
  const bool several = sequence_->frames().size() > 1 || options_.frames.has_value() || !one_file;
  if (several) frames_ = sequence_->frames();
}

SurfaceSource::~SurfaceSource() = default;
SurfaceSource::SurfaceSource(SurfaceSource&&) noexcept = default;

std::string_view SurfaceSource::kind_name() const {
  switch (kind_) {
    case Kind::Scene: return "scene";
    case Kind::Mesh: return "mesh";
    case Kind::Grid: return "grid";
    case Kind::Points: return "points";
    case Kind::Particles: return "particles";
  }
  return "";
}

double SurfaceSource::frames_per_second() const {
  return options_.fps.value_or(document_ ? document_->frames_per_second() : 24);
}

std::string SurfaceSource::settings() const {
  const auto number = [](const std::optional<double>& v) { return v ? nlohmann::json(*v) : nlohmann::json(); };
  nlohmann::json j{{"radius", number(options_.radius)},
                   {"voxel", number(options_.voxel)},
                   {"fps", frames_per_second()},
                   {"missing", static_cast<int>(options_.missing)},
                   {"set", options_.set}};
  for (const std::string& path : inputs_) j["inputs"].push_back(std::filesystem::path(path).filename().string());
  if (inputs_.size() == 1) j["content"] = io::fingerprint_of_file(inputs_[0]);
  return j.dump();
}

std::vector<long> SurfaceSource::all_frames() const {
  if (sequence_) return frames_;
  std::vector<long> all;
  if (document_)
    for (long f = document_->first_frame(); f <= document_->last_frame(); ++f) all.push_back(f);
  return all;
}

Surface SurfaceSource::open(std::optional<long> frame, const RunControl& run) const {
  Surface s;
  if (sequence_) {
    run.check();
    io::ReadReport read;
    s.particles = sequence_->read(frame.value_or(sequence_->frames().front()), &read);
    told(read);
    s.field = field_from_particles(s.particles, options_.radius);
    s.voxel = smallest_radius(s.particles, options_.radius) / kVoxelsPerRadius;
    return s;
  }
  s.field = field_->clone();
  s.open = open_;
  const double time = frame ? static_cast<double>(*frame) / frames_per_second() : options_.time.value_or(0);
  s.field->set_time(time);
  const Box bounds = s.field->bounds();
  if (bounds.finite() && !bounds.empty()) s.voxel = bounds.diameter() / kVoxelsPerDiameter;
  return s;
}

}  // namespace meniscus::scene
