#include "sim/renderer.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <thread>

#include "sim/meshes.hpp"

namespace crane {
namespace {

using Eigen::Vector3f;
constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr double kFloorHalf = 2000;

std::uint64_t mix(std::uint64_t h) {
  h = (h ^ (h >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  h = (h ^ (h >> 27U)) * 0x94D049BB133111EBULL;
  return h ^ (h >> 31U);
}

/// 0..1, the same for the same number everywhere.
float uniform(std::uint64_t h) {
  return float(mix(h) >> 40U) * (1.0F / 16'777'216.0F);
}

/// Box-Muller; one value is enough.
float gaussian(std::uint64_t h) {
  const float u = std::max(uniform(h), 1e-7F);
  return std::sqrt(-2 * std::log(u)) * std::cos(6.2831853F * uniform(h ^ 0x9E3779B97F4A7C15ULL));
}

float lattice(int x, int y, int z, std::uint64_t seed) {
  return uniform(seed + std::uint64_t(std::uint32_t(x)) * 0x8DA6B343ULL +
                 std::uint64_t(std::uint32_t(y)) * 0xD8163841ULL * 65'537ULL +
                 std::uint64_t(std::uint32_t(z)) * 0xCB1AB31FULL * 257ULL);
}

/// Smoothly interpolated noise, 0..1.
float value_noise(const Vector3f& p, std::uint64_t seed) {
  const Vector3f base = p.array().floor();
  const Vector3f f = p - base;
  const Vector3f s = f.array() * f.array() * (3.0F - 2.0F * f.array());
  const int x = int(base.x());
  const int y = int(base.y());
  const int z = int(base.z());
  const auto line = [&](int dy, int dz) {
    const float a = lattice(x, y + dy, z + dz, seed);
    return a + s.x() * (lattice(x + 1, y + dy, z + dz, seed) - a);
  };
  const auto plane = [&](int dz) {
    const float a = line(0, dz);
    return a + s.y() * (line(1, dz) - a);
  };
  const float a = plane(0);
  return a + s.z() * (plane(1) - a);
}

/// Three octaves, -1..1.
float texture(const Vector3f& p, float grain_m, std::uint64_t seed) {
  float sum = 0;
  float weight = 1;
  float scale = 1 / grain_m;
  for (int octave = 0; octave < 3; ++octave) {
    sum += weight * (2 * value_noise(p * scale, seed + std::uint64_t(octave) * 7919) - 1);
    weight *= 0.6F;
    scale *= 2.1F;
  }
  return std::clamp(sum, -1.0F, 1.0F);
}

/// Unit rays of all sub-pixels, in the camera frame; the lens is inverted by fixed-point steps.
std::vector<Vector3f> camera_rays(const CameraModel& c, int samples) {
  std::vector<Vector3f> rays;
  rays.reserve(std::size_t(c.width) * c.height * std::size_t(samples));
  const int side = std::max(1, int(std::lround(std::sqrt(samples))));
  for (std::uint32_t v = 0; v < c.height; ++v)
    for (std::uint32_t u = 0; u < c.width; ++u)
      for (int s = 0; s < samples; ++s) {
        const double du = samples == 1   ? 0
                          : samples == 2 ? (s == 0 ? -0.25 : 0.25)
                                         : (s % side + 0.5) / side - 0.5;
        const double dv = samples == 1   ? 0
                          : samples == 2 ? (s == 0 ? -0.25 : 0.25)
                                         : (s / side % side + 0.5) / side - 0.5;
        const double xd = (u + du - c.cx_px) / c.fx_px;
        const double yd = (v + dv - c.cy_px) / c.fy_px;
        double x = xd;
        double y = yd;
        for (int i = 0; i < 20; ++i) {
          const double r2 = x * x + y * y;
          const double radial = 1 + c.k1 * r2 + c.k2 * r2 * r2;
          x = (xd - 2 * c.p1 * x * y - c.p2 * (r2 + 2 * x * x)) / radial;
          y = (yd - c.p1 * (r2 + 2 * y * y) - 2 * c.p2 * x * y) / radial;
        }
        rays.push_back(Vector3f(float(x), float(y), 1));
      }
  return rays;
}

void parallel_rows(int rows, const std::function<void(int)>& work) {
  const int threads = std::max(1, int(std::thread::hardware_concurrency()));
  std::vector<std::jthread> pool;
  for (int t = 0; t < threads; ++t)
    pool.emplace_back([=, &work] {
      for (int row = t; row < rows; row += threads) work(row);
    });
}

float to_srgb(float linear) {
  const float c = std::clamp(linear, 0.0F, 1.0F);
  return c <= 0.0031308F ? 12.92F * c : 1.055F * std::pow(c, 1 / 2.4F) - 0.055F;
}

}  // namespace

struct Renderer::Impl {
  Scene scene;
  RTCDevice device = nullptr;
  RTCScene geometry = nullptr;
  std::map<unsigned, const Material*> materials;  ///< by Embree geometry id
  std::vector<Vector3f> left_rays, right_rays;

  void add(const Mesh& mesh, const Material& material, unsigned id) {
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
    for (const auto& v : mesh.vertices) vertices = std::copy(v.begin(), v.end(), vertices);
    auto* indices = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned),
                                mesh.triangles.size()));
    for (const auto& t : mesh.triangles) indices = std::copy(t.begin(), t.end(), indices);
    rtcCommitGeometry(g);
    rtcAttachGeometryByID(geometry, g, id);
    rtcReleaseGeometry(g);
    materials[id] = &material;
  }

  struct Hit {
    float distance = kFar;
    Vector3f normal{0, 0, 1};
    unsigned id = 0;
  };

  [[nodiscard]] Hit trace(const Vector3f& origin, const Vector3f& direction) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    RTCRayHit r{};
    r.ray.org_x = origin.x(), r.ray.org_y = origin.y(), r.ray.org_z = origin.z();
    r.ray.dir_x = direction.x(), r.ray.dir_y = direction.y(), r.ray.dir_z = direction.z();
    r.ray.tnear = 1e-4F;
    r.ray.tfar = kFar;
    r.ray.mask = ~0U;
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(geometry, &context, &r);
    Hit hit;
    if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
    hit.distance = r.ray.tfar;
    hit.id = r.hit.geomID;
    hit.normal = Vector3f(r.hit.Ng_x, r.hit.Ng_y, r.hit.Ng_z).normalized();
    if (hit.normal.dot(direction) > 0) hit.normal = -hit.normal;
    return hit;
  }

  [[nodiscard]] bool blocked(const Vector3f& from, const Vector3f& to) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay r{};
    const Vector3f d = to - from;
    r.org_x = from.x(), r.org_y = from.y(), r.org_z = from.z();
    r.dir_x = d.x(), r.dir_y = d.y(), r.dir_z = d.z();
    r.tnear = 1e-3F;
    r.tfar = 0.999F;
    r.mask = ~0U;
    rtcOccluded1(geometry, &context, &r);
    return r.tfar < 0;
  }

  /// Linear light from a surface point towards the eye.
  [[nodiscard]] Vector3f shade(const Vector3f& p, const Vector3f& to_eye, const Hit& hit) const {
    const Material& m = *materials.at(hit.id);
    Vector3f albedo = m.colour;
    if (m.texture > 0)
      albedo *= 1 + float(m.texture) * texture(p, float(m.grain_m), scene.seed * 1000 + hit.id);
    albedo = albedo.cwiseMax(0.005F);
    Vector3f light = albedo * float(scene.ambient);
    const Vector3f from = p + hit.normal * 1e-3F;
    // Which point of a lamp lights a point depends on the point alone: the grain of a penumbra then
    // lies on the surface, and both cameras see the same.
    constexpr float kGrain = 400;  // a 2.5 mm
    const std::uint64_t random =
        mix((std::uint64_t(std::uint32_t(int(std::floor(p.x() * kGrain)))) << 32U) ^
            (std::uint64_t(std::uint32_t(int(std::floor(p.y() * kGrain)))) << 13U) ^
            std::uint32_t(int(std::floor(p.z() * kGrain)))) +
        scene.seed;
    for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
      const Lamp& lamp = scene.lamps[i];
      const Vector3f centre = lamp.centre.cast<float>();
      const float half_x = 0.5F * float(lamp.size_x_m);
      const float half_y = 0.5F * float(lamp.size_y_m);
      const Vector3f sample = centre + Vector3f((2 * uniform(random + 2 * i) - 1) * half_x,
                                                (2 * uniform(random + 2 * i + 1) - 1) * half_y, 0);
      const Vector3f towards = sample - from;
      const float distance2 = towards.squaredNorm();
      const Vector3f l = towards / std::sqrt(distance2);
      const float cosine = hit.normal.dot(l);
      if (cosine <= 0 || l.z() <= 0 || blocked(from, sample)) continue;
      const float arriving = float(lamp.power) * l.z() / distance2;
      light += albedo * (arriving * cosine);
      if (m.gloss <= 0) continue;
      // Highlight of an area lamp: the point of the lamp nearest to the mirrored eye ray.
      const Vector3f mirrored = 2 * hit.normal.dot(to_eye) * hit.normal - to_eye;
      if (mirrored.z() <= 0.05F) continue;
      Vector3f nearest = from + mirrored * ((centre.z() - from.z()) / mirrored.z());
      nearest.x() = std::clamp(nearest.x(), centre.x() - half_x, centre.x() + half_x);
      nearest.y() = std::clamp(nearest.y(), centre.y() - half_y, centre.y() + half_y);
      const float align = std::max(0.0F, mirrored.dot((nearest - from).normalized()));
      light +=
          Vector3f::Ones() * (float(m.gloss) * arriving * 4 * std::pow(align, float(m.shininess)));
    }
    return light;
  }

  [[nodiscard]] Eigen::Isometry3f T_map_camera(bool left, double cart, double trolley) const {
    const StereoRig& rig = scene.camera.rig;
    Eigen::Isometry3d T = Eigen::Translation3d(cart, trolley, 0) * rig.T_map_camera_at_zero;
    if (!left) T = T * rig.T_left_right;
    return T.cast<float>();
  }

  ~Impl() {
    if (geometry != nullptr) rtcReleaseScene(geometry);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

Renderer::Renderer(const Scene& scene) : impl_(std::make_unique<Impl>()) {
  impl_->scene = scene;
  impl_->device = rtcNewDevice("threads=1");
  expects(impl_->device != nullptr, "Embree starts");
  show(obstacles_at(scene, 0));
  impl_->left_rays = camera_rays(scene.camera.rig.left, scene.camera.samples);
  impl_->right_rays = camera_rays(scene.camera.rig.right, scene.camera.samples);
}

void Renderer::show(const std::vector<std::optional<SceneObstacle>>& obstacles) {
  Impl& m = *impl_;
  if (m.geometry != nullptr) rtcReleaseScene(m.geometry);
  m.geometry = rtcNewScene(m.device);
  rtcSetSceneFlags(m.geometry, RTC_SCENE_FLAG_ROBUST);
  m.materials.clear();
  m.add(floor_mesh(kFloorHalf), m.scene.materials.at(m.scene.floor_material), 0);
  for (std::size_t i = 0; i < obstacles.size(); ++i)
    if (obstacles[i])
      m.add(mesh_of(*obstacles[i]), m.scene.materials.at(obstacles[i]->material),
            static_cast<unsigned>(i + 1));
  rtcCommitScene(m.geometry);
}

Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

Image Renderer::render(bool left, double cart_m, double trolley_m, std::uint64_t frame) const {
  const Impl& m = *impl_;
  const CameraModel& camera = left ? m.scene.camera.rig.left : m.scene.camera.rig.right;
  const std::vector<Vector3f>& rays = left ? m.left_rays : m.right_rays;
  const Eigen::Isometry3f T = m.T_map_camera(left, cart_m, trolley_m);
  const Vector3f eye = T.translation();
  const int samples = m.scene.camera.samples;
  Image image{camera.width, camera.height, m.scene.camera.colour ? 3U : 1U, {}};
  image.bytes.resize(std::size_t(image.width) * image.height * image.channels);
  const std::uint64_t seed = mix(m.scene.seed * 31 + frame * 2 + (left ? 1 : 0)) << 24U;
  parallel_rows(int(camera.height), [&](int row) {
    for (std::uint32_t u = 0; u < camera.width; ++u) {
      const std::size_t pixel = std::size_t(row) * camera.width + u;
      Vector3f light = Vector3f::Zero();
      for (int s = 0; s < samples; ++s) {
        const std::size_t index = pixel * std::size_t(samples) + std::size_t(s);
        const Vector3f direction = (T.linear() * rays[index]).normalized();
        const Impl::Hit hit = m.trace(eye, direction);
        if (hit.distance < kFar) light += m.shade(eye + direction * hit.distance, -direction, hit);
      }
      light *= float(m.scene.camera.exposure) / float(samples);
      const auto level = [&](float linear, std::uint64_t channel) {
        const float grey = 255 * to_srgb(linear) +
                           float(m.scene.camera.noise_grey) * gaussian(seed + pixel * 4 + channel);
        return static_cast<std::uint8_t>(std::clamp(std::lround(grey), 0L, 255L));
      };
      std::uint8_t* out = image.bytes.data() + pixel * image.channels;
      if (image.channels == 1) {
        out[0] = level(0.2126F * light.x() + 0.7152F * light.y() + 0.0722F * light.z(), 0);
      } else {
        out[0] = level(light.z(), 0);
        out[1] = level(light.y(), 1);
        out[2] = level(light.x(), 2);
      }
    }
  });
  return image;
}

std::vector<float> Renderer::depth(double cart_m, double trolley_m) const {
  const Impl& m = *impl_;
  const CameraModel& camera = m.scene.camera.rig.left;
  const std::vector<Vector3f> rays = camera_rays(camera, 1);
  const Eigen::Isometry3f T = m.T_map_camera(true, cart_m, trolley_m);
  std::vector<float> out(rays.size());
  parallel_rows(int(camera.height), [&](int row) {
    for (std::uint32_t u = 0; u < camera.width; ++u) {
      const std::size_t i = std::size_t(row) * camera.width + u;
      // The ray's z component is 1: the distance in units of it is the depth.
      const Impl::Hit hit = m.trace(T.translation(), T.linear() * rays[i]);
      out[i] = hit.distance < kFar ? hit.distance : 0;
    }
  });
  return out;
}

double Renderer::height_m(double x_m, double y_m) const {
  constexpr float kAbove = 200;
  const Impl::Hit hit = impl_->trace(Vector3f(float(x_m), float(y_m), kAbove), Vector3f(0, 0, -1));
  return hit.distance < kFar ? double(kAbove - hit.distance) : 0;
}

bool Renderer::sees(double cart_m, double trolley_m, const Eigen::Vector3d& p_map) const {
  const Eigen::Isometry3f T = impl_->T_map_camera(true, cart_m, trolley_m);
  const CameraModel& c = impl_->scene.camera.rig.left;
  const Vector3f p = T.inverse() * p_map.cast<float>();
  if (p.z() <= 0.05F) return false;
  const double u = c.fx_px * p.x() / p.z() + c.cx_px;  // without the lens: a border of few pixels
  const double v = c.fy_px * p.y() / p.z() + c.cy_px;
  if (u < 0 || v < 0 || u > c.width - 1 || v > c.height - 1) return false;
  return !impl_->blocked(T.translation(), p_map.cast<float>() + Vector3f(0, 0, 1e-3F));
}

}  // namespace crane
