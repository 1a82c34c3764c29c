#include <meniscus/base/error.h>
#include <meniscus/render/tracer.h>

#include <embree3/rtcore.h>

#include <algorithm>
#include <string>

namespace meniscus::render {
namespace {

RTCRay embree_ray(const Ray& ray) {
  RTCRay r{};
  r.org_x = static_cast<float>(ray.origin.x());
  r.org_y = static_cast<float>(ray.origin.y());
  r.org_z = static_cast<float>(ray.origin.z());
  r.dir_x = static_cast<float>(ray.direction.x());
  r.dir_y = static_cast<float>(ray.direction.y());
  r.dir_z = static_cast<float>(ray.direction.z());
  r.time = static_cast<float>(ray.time);
  r.tnear = 0;
  r.tfar = std::numeric_limits<float>::infinity();
  r.mask = ~0U;
  return r;
}

RTCGeometryType embree_type(Surface::Kind kind) {
  switch (kind) {
    case Surface::Kind::Mesh: return RTC_GEOMETRY_TYPE_TRIANGLE;
    case Surface::Kind::Discs: return RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT;
    case Surface::Kind::Spheres: break;
  }
  return RTC_GEOMETRY_TYPE_SPHERE_POINT;
}

bool keep_building(void* run, double) { return !static_cast<const RunControl*>(run)->cancelled(); }

}  // namespace

struct Tracer::Scene {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  Scene() : device(rtcNewDevice("")), scene(device != nullptr ? rtcNewScene(device) : nullptr) {
    if (scene == nullptr) {
      release();
      throw ResourceLimit("the ray tracer cannot start: out of memory?");
    }
  }
  ~Scene() { release(); }
  Scene(Scene&&) = delete;
  Scene& operator=(Scene&&) = delete;

  void release() const {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  // Places at begin and end of the exposure share one index buffer and one set of normals.
  void attach(const Surface& s) const {
    const RTCGeometry geometry = rtcNewGeometry(device, embree_type(s.kind));
    const bool is_mesh = s.kind == Surface::Kind::Mesh;
    const unsigned steps = s.end.empty() ? 1 : 2;
    rtcSetGeometryTimeStepCount(geometry, steps);
    for (unsigned step = 0; step < steps; ++step) {
      const auto& places = step == 0 ? s.begin : s.end;
      rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, step, is_mesh ? RTC_FORMAT_FLOAT3 : RTC_FORMAT_FLOAT4,
                                 places.data(), 0, sizeof(Vec4f), places.size());
      if (s.kind == Surface::Kind::Discs) set_normals(geometry, step, s);
    }
    if (is_mesh) {
      rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, s.triangles.data(), 0,
                                 sizeof(Triangle), s.triangles.size());
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
  }

  // Copied: Embree reads 16 bytes at a time, past the end of an array of threes.
  static void set_normals(RTCGeometry geometry, unsigned step, const Surface& s) {
    void* data =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_NORMAL, step, RTC_FORMAT_FLOAT3, sizeof(Vec3f), s.normals.size());
    if (data != nullptr) std::copy(s.normals.begin(), s.normals.end(), static_cast<Vec3f*>(data));
  }
};

Tracer::Tracer(const std::vector<Surface>& surfaces, const RunControl& run) : scene_(std::make_unique<Scene>()) {
  // Robust: no leaks between neighbouring triangles.
  rtcSetSceneFlags(scene_->scene, RTC_SCENE_FLAG_ROBUST);
  for (const Surface& surface : surfaces) scene_->attach(surface);
  rtcSetSceneProgressMonitorFunction(scene_->scene, keep_building, const_cast<RunControl*>(&run));

  // Built by one thread: where two triangles are hit at the same distance, the order in the tree decides, and that would
  // depend on the number of builders.
  RunControl({.threads = 1, .seed = 0, .on_progress = {}}).execute([&] { rtcCommitScene(scene_->scene); });
  run.check();
  const RTCError error = rtcGetDeviceError(scene_->device);
  if (error != RTC_ERROR_NONE) {
    throw ResourceLimit("the ray tracer cannot hold the scene (Embree error " + std::to_string(static_cast<int>(error)) +
                        ")");
  }
}

Tracer::~Tracer() = default;

Hit Tracer::nearest(const Ray& ray) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray = embree_ray(ray);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {
      static_cast<double>(query.ray.tfar),
      query.hit.geomID,
      query.hit.primID,
      static_cast<double>(query.hit.u),
      static_cast<double>(query.hit.v),
      Vec3(static_cast<double>(query.hit.Ng_x), static_cast<double>(query.hit.Ng_y), static_cast<double>(query.hit.Ng_z))};
}

bool Tracer::blocked(const Ray& ray) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay query = embree_ray(ray);
  rtcOccluded1(scene_->scene, &context, &query);
  return query.tfar < 0;
}

}  // namespace meniscus::render
