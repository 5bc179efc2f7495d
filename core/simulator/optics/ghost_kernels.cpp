// The kernels of ghost_block.h, compiled once for each instruction set (RELIGN_KERNEL_ISA) like block_kernels.cpp; the
// formulas are those of ghost_walk.cpp.
#include "optics/ghost_block.h"

namespace relign::optics {
namespace RELIGN_KERNEL_ISA {
namespace {

#define RELIGN_LOOP _Pragma("omp simd")

// Rounding leaves a ray this close (mm) to the surface that it has just left.
constexpr float kNearest = 1e-4F;
constexpr float kNever = 1e30F;
constexpr float kMostSurvival = 0.95F;
constexpr std::uint32_t kRouletteFrom = 5 * kGhostEvent;

inline float fused(float a, float b, float c) { return __builtin_fmaf(a, b, c); }
inline float dot3(const float* a, float x, float y, float z) { return fused(a[0], x, fused(a[1], y, a[2] * z)); }
inline float smaller_of(float a, float b) { return a < b ? a : b; }
inline float larger_of(float a, float b) { return a > b ? a : b; }
inline float unit_of(std::uint32_t bits) { return static_cast<float>(static_cast<std::int32_t>(bits >> 8)) * 0x1p-24F; }

// Rays of a block as arrays, which is what the compiler vectorises best.
struct Rays {
  float x[kGhostRays], y[kGhostRays], z[kGhostRays], l[kGhostRays], m[kGhostRays], n[kGhostRays], weight[kGhostRays];
  std::uint32_t tag[kGhostRays];
};

void load(Rays& __restrict rays, const GhostRay* __restrict from, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    rays.x[i] = from[i].x;
    rays.y[i] = from[i].y;
    rays.z[i] = from[i].z;
    rays.l[i] = from[i].l;
    rays.m[i] = from[i].m;
    rays.n[i] = from[i].n;
    rays.weight[i] = from[i].weight;
    rays.tag[i] = from[i].tag;
  }
}

void store(GhostRay* __restrict to, const Rays& __restrict rays, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    to[i].x = rays.x[i];
    to[i].y = rays.y[i];
    to[i].z = rays.z[i];
    to[i].l = rays.l[i];
    to[i].m = rays.m[i];
    to[i].n = rays.n[i];
    to[i].weight = rays.weight[i];
    to[i].tag = rays.tag[i];
  }
}

// One of them.
struct Ray {
  float x, y, z, l, m, n;
  std::uint32_t tag;
};
inline Ray ray_at(const Rays& rays, int i) {
  return {rays.x[i], rays.y[i], rays.z[i], rays.l[i], rays.m[i], rays.n[i], rays.tag[i]};
}

// Where rays meet a surface: unit normal, its product with the direction, indices before / after; and the queues that
// they go to. A ray that meets nothing goes to `elsewhere` unchanged.
struct Meetings {
  float x[kGhostRays], y[kGhostRays], z[kGhostRays];
  float normal_x[kGhostRays], normal_y[kGhostRays], normal_z[kGhostRays];
  float cosine[kGhostRays], ratio[kGhostRays];
  std::int32_t met[kGhostRays], elsewhere[kGhostRays];
  std::uint32_t tag[kGhostRays];  // of the children
  // The directions after refraction and reflection; the reflectance, 1: total reflection.
  float through_l[kGhostRays], through_m[kGhostRays], through_n[kGhostRays];
  float back_l[kGhostRays], back_m[kGhostRays], back_n[kGhostRays];
  float reflectance[kGhostRays];
  std::int32_t through_to[kGhostRays], back_to[kGhostRays];
};

// Fresnel reflectance of unpolarised light, as unpolarised_reflectance() of ghost_walk.cpp.
void weigh(Meetings& __restrict at, const Rays& __restrict rays, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float ratio = at.ratio[i], signed_cosine = at.cosine[i], cosine = __builtin_fabsf(signed_cosine);
    const float squared = fused(-ratio * ratio, fused(-cosine, cosine, 1.0F), 1.0F);
    const float after = __builtin_sqrtf(__builtin_fabsf(squared));
    const float s_below = fused(ratio, cosine, after), p_below = fused(ratio, after, cosine);
    const float s = fused(ratio, cosine, -after) * p_below, p = fused(-ratio, after, cosine) * s_below;
    const float below = s_below * p_below;
    const float partly = 0.5F * fused(s, s, p * p) / (below * below);
    at.reflectance[i] = squared > 0.0F ? partly : 1.0F;
    const float signed_after = signed_cosine > 0.0F ? after : -after;
    const float g = fused(-ratio, signed_cosine, signed_after), back = -2.0F * signed_cosine;
    const float l = rays.l[i], m = rays.m[i], n = rays.n[i];
    const float nx = at.normal_x[i], ny = at.normal_y[i], nz = at.normal_z[i];
    at.through_l[i] = fused(g, nx, ratio * l);
    at.through_m[i] = fused(g, ny, ratio * m);
    at.through_n[i] = fused(g, nz, ratio * n);
    at.back_l[i] = fused(back, nx, l);
    at.back_m[i] = fused(back, ny, m);
    at.back_n[i] = fused(back, nz, n);
  }
}

void go_both_ways(const Meetings& __restrict at, const Rays& __restrict rays, const GhostChoice& choice,
                  GhostChildren& __restrict children, Rays& __restrict first, Rays& __restrict second, int count) {
  const float least = choice.least_weight;
  const std::uint32_t *const words = choice.words, *const more = choice.more_words;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const bool met = at.met[i] != 0;
    const std::uint32_t tag = at.tag[i], old = rays.tag[i];
    const float weight = rays.weight[i], reflectance = at.reflectance[i];
    const float through = weight * (1.0F - reflectance), back = weight * reflectance;
    const bool going = (tag & kGhostEventMask) < kGhostEvents * kGhostEvent;
    const bool kept = (through >= least) | (unit_of(words[i]) * least < through);
    const bool turned = (back >= least) | (unit_of(more[i]) * least < back);
    const bool stays = met & going & (reflectance < 1.0F) & kept, turns = met & going & turned;
    const std::int32_t through_to = at.through_to[i], back_to = at.back_to[i], elsewhere = at.elsewhere[i];
    const float x = rays.x[i], y = rays.y[i], z = rays.z[i], l = rays.l[i], m = rays.m[i], n = rays.n[i];
    const float hx = at.x[i], hy = at.y[i], hz = at.z[i];
    const float tl = at.through_l[i], tm = at.through_m[i], tn = at.through_n[i];
    first.x[i] = met ? hx : x;
    first.y[i] = met ? hy : y;
    first.z[i] = met ? hz : z;
    first.l[i] = met ? tl : l;
    first.m[i] = met ? tm : m;
    first.n[i] = met ? tn : n;
    first.weight[i] = met ? larger_of(through, least) : weight;
    first.tag[i] = met ? tag : old;
    children.first_to[i] = met ? (stays ? through_to : kGhostGone) : elsewhere;
    second.x[i] = hx;
    second.y[i] = hy;
    second.z[i] = hz;
    second.l[i] = at.back_l[i];
    second.m[i] = at.back_m[i];
    second.n[i] = at.back_n[i];
    second.weight[i] = larger_of(back, least);
    second.tag[i] = tag | kGhostReflected;
    children.second_to[i] = turns ? back_to : kGhostGone;
  }
  store(children.first, first, count);
  store(children.second, second, count);
}

void go_one_way(const Meetings& __restrict at, const Rays& __restrict rays, const GhostChoice& choice,
                GhostChildren& __restrict children, Rays& __restrict first, int count) {
  const std::uint32_t *const words = choice.words, *const more = choice.more_words;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const bool met = at.met[i] != 0;
    const std::uint32_t tag = at.tag[i], old = rays.tag[i];
    const float weight = rays.weight[i];
    const bool turns = unit_of(words[i]) < at.reflectance[i];
    const std::uint32_t events = tag & kGhostEventMask;
    const float survival = events >= kRouletteFrom ? smaller_of(weight, kMostSurvival) : 1.0F;
    const bool stays = (events < kGhostEvents * kGhostEvent) & (unit_of(more[i]) < survival);
    const std::int32_t through_to = at.through_to[i], back_to = at.back_to[i], elsewhere = at.elsewhere[i];
    const float x = rays.x[i], y = rays.y[i], z = rays.z[i], l = rays.l[i], m = rays.m[i], n = rays.n[i];
    const float hx = at.x[i], hy = at.y[i], hz = at.z[i];
    const float tl = at.through_l[i], tm = at.through_m[i], tn = at.through_n[i];
    const float bl = at.back_l[i], bm = at.back_m[i], bn = at.back_n[i];
    first.x[i] = met ? hx : x;
    first.y[i] = met ? hy : y;
    first.z[i] = met ? hz : z;
    first.l[i] = met ? (turns ? bl : tl) : l;
    first.m[i] = met ? (turns ? bm : tm) : m;
    first.n[i] = met ? (turns ? bn : tn) : n;
    first.weight[i] = met ? weight / survival : weight;
    first.tag[i] = met ? tag : old;
    children.first_to[i] = met ? (stays ? (turns ? back_to : through_to) : kGhostGone) : elsewhere;
  }
  store(children.first, first, count);
}

// Arrays of one thread's block.
struct Work {
  Rays rays, first, second;
  Meetings at;
};

void go_on(Work& work, const GhostChoice& choice, GhostChildren& children, int count) {
  if (choice.both)
    go_both_ways(work.at, work.rays, choice, children, work.first, work.second, count);
  else
    go_one_way(work.at, work.rays, choice, children, work.first, count);
}

// Distance to the other end of the chord on the concave side of a face, kNever if it is not on the face.
inline float chord(const GhostFace& face, const Ray& ray) {
  const float px = ray.x - face.vertex[0], py = ray.y - face.vertex[1], pz = ray.z - face.vertex[2], c = face.curvature;
  const float nx = fused(-c, px, face.axis[0]), ny = fused(-c, py, face.axis[1]), nz = fused(-c, pz, face.axis[2]);
  const float t = 2.0F * fused(ray.l, nx, fused(ray.m, ny, ray.n * nz)) / c;
  const float hx = fused(t, ray.l, px), hy = fused(t, ray.m, py), hz = fused(t, ray.n, pz);
  const float height = dot3(face.axis, hx, hy, hz);
  const float square = fused(hx, hx, fused(hy, hy, hz * hz));
  const bool on = ((ray.tag & kGhostLeftFace) != 0) & (t > kNearest) & (c * height < 1.0F) &
                  (fused(-height, height, square) < face.clear_radius2);
  return on ? t : kNever;
}

// Distance to a stop that absorbs the ray before a distance, else that distance.
inline float absorbed_by(const GhostStop& stop, const Ray& ray, float before) {
  const float t = (stop.z - ray.z) / ray.n;
  const float x = fused(t, ray.l, ray.x), y = fused(t, ray.m, ray.y);
  return (t > kNearest) & (t < before) & (fused(x, x, y * y) > stop.opening_radius2) ? t : before;
}

template <bool Concave, bool HoldsStop>
void advance_to_face(const GhostStep& given, const GhostLens& lens, const Rays& __restrict rays,
                     Meetings& __restrict at, int count) {
  const GhostStep step = given;
  const GhostFace face = step.next;
  const float c = face.curvature;
  float absorbed[kGhostRays];
  if (HoldsStop) {
    for (int i = 0; i < count; ++i) absorbed[i] = kNever;
    for (int k = 0; k < lens.stop_count; ++k) {
      const GhostStop stop = lens.stops[k];
      RELIGN_LOOP
      for (int i = 0; i < count; ++i) absorbed[i] = absorbed_by(stop, ray_at(rays, i), absorbed[i]);
    }
  }
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const Ray ray = ray_at(rays, i);
    const float px = ray.x - face.vertex[0], py = ray.y - face.vertex[1], pz = ray.z - face.vertex[2];
    const float forward = dot3(face.axis, ray.l, ray.m, ray.n);
    const float e = -fused(px, ray.l, fused(py, ray.m, pz * ray.n));
    const float mx = fused(e, ray.l, px), my = fused(e, ray.m, py), mz = fused(e, ray.n, pz);
    const float f = fused(c, fused(mx, mx, fused(my, my, mz * mz)), -2.0F * dot3(face.axis, mx, my, mz));
    const float discriminant = fused(forward, forward, -c * f);
    const float cosine = step.sign * __builtin_sqrtf(__builtin_fabsf(discriminant));
    const float t = e + f / (forward + cosine);
    const float hx = fused(t, ray.l, px), hy = fused(t, ray.m, py), hz = fused(t, ray.n, pz);
    const float height = dot3(face.axis, hx, hy, hz);
    const float across = fused(-height, height, fused(hx, hx, fused(hy, hy, hz * hz)));
    bool met = (step.sign * forward > 0.0F) & (discriminant > 0.0F) & (t > kNearest) & (across < face.clear_radius2);
    if (Concave) met = met & !(chord(step.left, ray) < t);
    bool lost = false;
    if (HoldsStop) lost = met & (absorbed[i] < t);
    at.x[i] = hx + face.vertex[0];
    at.y[i] = hy + face.vertex[1];
    at.z[i] = hz + face.vertex[2];
    at.normal_x[i] = fused(-c, hx, face.axis[0]);
    at.normal_y[i] = fused(-c, hy, face.axis[1]);
    at.normal_z[i] = fused(-c, hz, face.axis[2]);
    at.cosine[i] = cosine;
    at.ratio[i] = step.index_ratio;
    at.met[i] = met & !lost ? 1 : 0;
    at.elsewhere[i] = lost ? kGhostGone : step.search;
    at.tag[i] = (ray.tag | kGhostLeftFace) + kGhostEvent;
    at.through_to[i] = step.refracted;
    at.back_to[i] = step.reflected;
  }
}

// A stop does not change the medium: the ray is not moved.
template <bool Concave>
void advance_to_stop(const GhostStep& given, const Rays& __restrict rays, GhostChildren& __restrict children,
                     int count) {
  const GhostStep step = given;
  const float z = step.next.vertex[2], clear2 = step.next.clear_radius2, left2 = step.left.clear_radius2;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const Ray ray = ray_at(rays, i);
    const float t = (z - ray.z) / ray.n;
    const float x = fused(t, ray.l, ray.x), y = fused(t, ray.m, ray.y), r2 = fused(x, x, y * y);
    bool met = (step.sign * ray.n > 0.0F) & (t > 0.0F);
    if (Concave) met = met & !(chord(step.left, ray) < t);
    // Directly from a face and within its aperture: no edge in between.
    const bool lost = met & ((ray.tag & kGhostLeftFace) != 0) & (r2 < left2);
    children.first_to[i] = met & (r2 < clear2) ? step.past : lost ? kGhostGone : step.search;
  }
}

template <bool Concave>
void advance_to_end(const GhostStep& given, const Rays& __restrict rays, GhostChildren& __restrict children,
                    int count) {
  const GhostStep step = given;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const Ray ray = ray_at(rays, i);
    bool free = (ray.tag & kGhostLeftFace) != 0;
    if (Concave) free = free & !(chord(step.left, ray) < kNever);
    children.first_to[i] = free ? step.past : step.search;
  }
}

void advance(const GhostStep& step, const GhostLens& lens, const GhostRay* from, const GhostChoice& choice,
             GhostChildren& children, int count) {
  Work work;
  load(work.rays, from, count);
  if (step.kind != GhostStep::face) {
    if (step.kind == GhostStep::stop)
      (step.concave ? advance_to_stop<true> : advance_to_stop<false>)(step, work.rays, children, count);
    else
      (step.concave ? advance_to_end<true> : advance_to_end<false>)(step, work.rays, children, count);
    store(children.first, work.rays, count);
    for (int i = 0; i < count; ++i) children.second_to[i] = kGhostGone;
    return;
  }
  if (step.holds_stop)
    (step.concave ? advance_to_face<true, true> : advance_to_face<false, true>)(step, lens, work.rays, work.at, count);
  else
    (step.concave ? advance_to_face<true, false> : advance_to_face<false, false>)(step, lens, work.rays, work.at,
                                                                                  count);
  weigh(work.at, work.rays, count);
  go_on(work, choice, children, count);
}

// The nearest hit so far of each ray: kNothing, kAbsorbed, or four times the body and what of it.
enum Part : std::int32_t { front, back, ring, cylinder };
constexpr std::int32_t kNothing = -1, kAbsorbed = -2;
struct Nearest {
  float t[kGhostRays];
  std::int32_t what[kGhostRays];
};

inline void keep(float& nearest, std::int32_t& what, bool hit, float t, std::int32_t new_what) {
  const bool nearer = hit & (t > kNearest) & (t < nearest);
  nearest = nearer ? t : nearest;
  what = nearer ? new_what : what;
}

void nearest_on_face(const GhostFace& given, std::int32_t number, const Rays& __restrict rays,
                     Nearest& __restrict found, int from, int to) {
  const GhostFace face = given;
  const float c = face.curvature;
  RELIGN_LOOP
  for (int i = from; i < to; ++i) {
    const Ray ray = ray_at(rays, i);
    const float px = ray.x - face.vertex[0], py = ray.y - face.vertex[1], pz = ray.z - face.vertex[2];
    const float forward = dot3(face.axis, ray.l, ray.m, ray.n);
    const float e = -fused(px, ray.l, fused(py, ray.m, pz * ray.n));
    const float mx = fused(e, ray.l, px), my = fused(e, ray.m, py), mz = fused(e, ray.n, pz);
    const float f = fused(c, fused(mx, mx, fused(my, my, mz * mz)), -2.0F * dot3(face.axis, mx, my, mz));
    const float discriminant = fused(forward, forward, -c * f);
    const float root = __builtin_sqrtf(__builtin_fabsf(discriminant));
    float nearest = found.t[i];
    std::int32_t what = found.what[i];
    const auto try_at = [&](float t) {
      const float hx = fused(t, ray.l, px), hy = fused(t, ray.m, py), hz = fused(t, ray.n, pz);
      const float height = dot3(face.axis, hx, hy, hz);
      const float across = fused(-height, height, fused(hx, hx, fused(hy, hy, hz * hz)));
      keep(nearest, what, (discriminant > 0.0F) & (c * height < 1.0F) & (across < face.clear_radius2), t, number);
    };
    try_at(e + f / (forward + root));
    try_at(e + f / (forward - root));  // of a plane one of them is infinite or NaN, and rejected
    found.t[i] = nearest;
    found.what[i] = what;
  }
}

void nearest_on_edge(const GhostBody& body, std::int32_t number, const Rays& __restrict rays, Nearest& __restrict found,
                     int from, int to) {
  const float ox = body.origin[0], oy = body.origin[1], oz = body.origin[2];
  const float ax = body.axis[0], ay = body.axis[1], az = body.axis[2];
  const float radius2 = body.radius * body.radius, inner2 = body.ring_inner_radius * body.ring_inner_radius;
  const float ring_z = body.ring_z, low_z = body.low_z, high_z = body.high_z;
  RELIGN_LOOP
  for (int i = from; i < to; ++i) {
    const Ray ray = ray_at(rays, i);
    const float px = ray.x - ox, py = ray.y - oy, pz = ray.z - oz;
    const float height = fused(px, ax, fused(py, ay, pz * az)),
                forward = fused(ray.l, ax, fused(ray.m, ay, ray.n * az));
    const float cx = fused(-height, ax, px), cy = fused(-height, ay, py), cz = fused(-height, az, pz);
    const float sx = fused(-forward, ax, ray.l), sy = fused(-forward, ay, ray.m), sz = fused(-forward, az, ray.n);
    const float a = fused(sx, sx, fused(sy, sy, sz * sz)), b = fused(cx, sx, fused(cy, sy, cz * sz));
    const float square = fused(cx, cx, fused(cy, cy, cz * cz));
    float nearest = found.t[i];
    std::int32_t what = found.what[i];
    const float to_ring = (ring_z - height) / forward;
    const float r2 = fused(to_ring, fused(to_ring, a, 2.0F * b), square);
    keep(nearest, what, (r2 > inner2) & (r2 < radius2), to_ring, number + ring);
    const float discriminant = fused(b, b, -a * (square - radius2));
    const float root = __builtin_sqrtf(__builtin_fabsf(discriminant)), per_a = 1.0F / a;
    const auto try_at = [&](float t) {
      const float z = fused(t, forward, height);
      keep(nearest, what, (a > 0.0F) & (discriminant > 0.0F) & (z > low_z) & (z < high_z), t, number + cylinder);
    };
    try_at((-root - b) * per_a);
    try_at((root - b) * per_a);
    found.t[i] = nearest;
    found.what[i] = what;
  }
}

void nearest_absorber(const GhostLens& lens, bool in_air, const Rays& __restrict rays, Nearest& __restrict found,
                      int count) {
  const float bore2 = lens.bore_radius2, front_z = lens.front_z, rim_z = lens.rim_z;
  if (in_air && lens.has_barrel) {
    RELIGN_LOOP
    for (int i = 0; i < count; ++i) {
      const Ray ray = ray_at(rays, i);
      const float a = fused(ray.l, ray.l, ray.m * ray.m), b = fused(ray.x, ray.l, ray.y * ray.m);
      const float discriminant = fused(b, b, -a * (fused(ray.x, ray.x, ray.y * ray.y) - bore2));
      const float t = (__builtin_sqrtf(__builtin_fabsf(discriminant)) - b) / a;
      const float z = fused(t, ray.n, ray.z);
      const bool hit = (a > 0.0F) & (discriminant > 0.0F) & (z > front_z) & (z < rim_z);
      found.t[i] = hit ? t : kNever;
      found.what[i] = hit ? kAbsorbed : kNothing;
    }
  }
  for (int k = 0; k < lens.stop_count; ++k) {
    const GhostStop stop = lens.stops[k];
    RELIGN_LOOP
    for (int i = 0; i < count; ++i) {
      const float before = found.t[i], t = absorbed_by(stop, ray_at(rays, i), before);
      const std::int32_t what = found.what[i];
      found.what[i] = t < before ? kAbsorbed : what;
      found.t[i] = t;
    }
  }
}

// The queue of a gap and direction.
inline std::int32_t queue_of(std::int32_t gap, bool to_image) { return 2 * gap + (to_image ? 1 : 0); }

// What the rays from one lane to another meet that meet this body.
void describe_face(const GhostBody& given, std::int32_t number, const Nearest& __restrict found,
                   const Rays& __restrict rays, Meetings& __restrict at, int from, int to) {
  const GhostBody body = given;
  const GhostFace one = body.faces[0], other = body.faces[1];
  RELIGN_LOOP
  for (int i = from; i < to; ++i) {
    const Ray ray = ray_at(rays, i);
    const std::int32_t part = found.what[i] - number;
    const bool mine = (part == front) | (part == back), second = part == back;
    const float t = found.t[i];
    const float x = fused(t, ray.l, ray.x), y = fused(t, ray.m, ray.y), z = fused(t, ray.n, ray.z);
    const float c = second ? other.curvature : one.curvature;
    const float px = x - (second ? other.vertex[0] : one.vertex[0]),
                py = y - (second ? other.vertex[1] : one.vertex[1]);
    const float pz = z - (second ? other.vertex[2] : one.vertex[2]);
    const float nx = fused(-c, px, second ? other.axis[0] : one.axis[0]);
    const float ny = fused(-c, py, second ? other.axis[1] : one.axis[1]);
    const float nz = fused(-c, pz, second ? other.axis[2] : one.axis[2]);
    const float cosine = fused(ray.l, nx, fused(ray.m, ny, ray.n * nz));
    const bool to_image = cosine > 0.0F;
    const float forth = second ? body.towards_image[1] : body.towards_image[0];
    const float aback = second ? body.towards_object[1] : body.towards_object[0];
    const float old_x = at.normal_x[i], old_y = at.normal_y[i], old_z = at.normal_z[i];
    const float old_cosine = at.cosine[i], old_ratio = at.ratio[i];
    const std::int32_t old_through = at.through_to[i], old_back = at.back_to[i];
    const std::int32_t surface = body.number + (second ? 1 : 0), beyond = surface + 1;
    at.normal_x[i] = mine ? nx : old_x;
    at.normal_y[i] = mine ? ny : old_y;
    at.normal_z[i] = mine ? nz : old_z;
    at.cosine[i] = mine ? cosine : old_cosine;
    at.ratio[i] = mine ? (to_image ? forth : aback) : old_ratio;
    at.through_to[i] = mine ? queue_of(to_image ? beyond : surface, to_image) : old_through;
    at.back_to[i] = mine ? queue_of(to_image ? surface : beyond, !to_image) : old_back;
  }
}

// Where a ray goes that leaves an edge: into the glass or the air beside the elements.
inline std::int32_t from_edge(float l, float m, float n, float ox, float oy, float oz, float ax, float ay, float az,
                              std::int32_t gap, std::int32_t air) {
  const bool inside = fused(l, ox, fused(m, oy, n * oz)) < 0.0F;
  const std::int32_t queue = queue_of(gap, fused(l, ax, fused(m, ay, n * az)) > 0.0F);
  return inside ? queue : air;
}

// Sets the normals and queues of the rays that meet this body's edge. `outward` are the directions towards the air.
void describe_edge(const GhostBody& given, std::int32_t number, const Nearest& __restrict found,
                   const Rays& __restrict rays, Meetings& __restrict at, Rays& __restrict outward, int from, int to) {
  const GhostBody b = given;
  const float per_ring = 1.0F / (b.radius - b.ring_inner_radius), per_height = 1.0F / (b.high_z - b.low_z);
  const float into = 1.0F / b.index;
  RELIGN_LOOP
  for (int i = from; i < to; ++i) {
    const Ray ray = ray_at(rays, i);
    const std::int32_t part = found.what[i] - number;
    const bool mine = (part == ring) | (part == cylinder), on_ring = part == ring;
    const float t = found.t[i];
    const float ex = fused(t, ray.l, ray.x) - b.origin[0], ey = fused(t, ray.m, ray.y) - b.origin[1],
                ez = fused(t, ray.n, ray.z) - b.origin[2];
    const float height = dot3(b.axis, ex, ey, ez);
    const float cx = fused(-height, b.axis[0], ex), cy = fused(-height, b.axis[1], ey),
                cz = fused(-height, b.axis[2], ez);
    const float radius = __builtin_sqrtf(fused(cx, cx, fused(cy, cy, cz * cz)));
    const float share = on_ring ? (radius - b.ring_inner_radius) * per_ring : (height - b.low_z) * per_height;
    const float r0 = on_ring ? b.ring_inner[0] : b.cylinder_low[0], r1 = on_ring ? b.ring_outer[0] : b.cylinder_high[0];
    const float a0 = on_ring ? b.ring_inner[1] : b.cylinder_low[1], a1 = on_ring ? b.ring_outer[1] : b.cylinder_high[1];
    const float radial = fused(share, r1 - r0, r0), axial = fused(share, a1 - a0, a0);
    const float scale = 1.0F / __builtin_sqrtf(fused(radial, radial, axial * axial));
    const float along = scale * radial / radius, up = scale * axial;
    const float nx = fused(along, cx, up * b.axis[0]), ny = fused(along, cy, up * b.axis[1]),
                nz = fused(along, cz, up * b.axis[2]);
    const float cosine = fused(ray.l, nx, fused(ray.m, ny, ray.n * nz));
    const float old_x = at.normal_x[i], old_y = at.normal_y[i], old_z = at.normal_z[i];
    const float old_cosine = at.cosine[i], old_ratio = at.ratio[i];
    const float old_ox = outward.x[i], old_oy = outward.y[i], old_oz = outward.z[i];
    const float old_ax = outward.l[i], old_ay = outward.m[i], old_az = outward.n[i];
    const std::uint32_t old_gap = outward.tag[i];
    at.normal_x[i] = mine ? nx : old_x;
    at.normal_y[i] = mine ? ny : old_y;
    at.normal_z[i] = mine ? nz : old_z;
    at.cosine[i] = mine ? cosine : old_cosine;
    at.ratio[i] = mine ? (cosine < 0.0F ? into : b.index) : old_ratio;
    outward.x[i] = mine ? (on_ring ? b.ring_side * b.axis[0] : cx) : old_ox;
    outward.y[i] = mine ? (on_ring ? b.ring_side * b.axis[1] : cy) : old_oy;
    outward.z[i] = mine ? (on_ring ? b.ring_side * b.axis[2] : cz) : old_oz;
    outward.l[i] = mine ? b.axis[0] : old_ax;
    outward.m[i] = mine ? b.axis[1] : old_ay;
    outward.n[i] = mine ? b.axis[2] : old_az;
    outward.tag[i] = mine ? static_cast<std::uint32_t>(b.gap) : old_gap;
  }
}

void place_hits(const GhostLens& lens, bool in_air, const Nearest& __restrict found, const Rays& __restrict rays,
                Meetings& __restrict at, int count) {
  const std::int32_t object_side = lens.object_side, image_side = lens.image_side;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const Ray ray = ray_at(rays, i);
    const float t = found.t[i];
    const std::int32_t what = found.what[i];
    const bool edge = (what >= 0) & ((what & 3) >= ring), open = in_air & (what == kNothing);
    const std::uint32_t kept = (ray.tag & ~kGhostLeftFace) + kGhostEvent;
    at.x[i] = fused(t, ray.l, ray.x);
    at.y[i] = fused(t, ray.m, ray.y);
    at.z[i] = fused(t, ray.n, ray.z);
    at.met[i] = what >= 0 ? 1 : 0;
    at.tag[i] = kept | (edge ? kGhostReflected : kGhostLeftFace);
    at.elsewhere[i] = open ? (ray.n < 0.0F ? object_side : image_side) : kGhostGone;
    at.normal_x[i] = 0.0F;
    at.normal_y[i] = 0.0F;
    at.normal_z[i] = 1.0F;
    at.cosine[i] = 1.0F;
    at.ratio[i] = 1.0F;
    at.through_to[i] = kGhostGone;
    at.back_to[i] = kGhostGone;
  }
}

void leave_edges(const Nearest& __restrict found, std::int32_t air, Meetings& __restrict at,
                 const Rays& __restrict outward, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const bool edge = (found.what[i] >= 0) & ((found.what[i] & 3) >= ring);
    const Ray to = ray_at(outward, i);
    const auto gap = static_cast<std::int32_t>(to.tag);
    const std::int32_t through =
        from_edge(at.through_l[i], at.through_m[i], at.through_n[i], to.x, to.y, to.z, to.l, to.m, to.n, gap, air);
    const std::int32_t back =
        from_edge(at.back_l[i], at.back_m[i], at.back_n[i], to.x, to.y, to.z, to.l, to.m, to.n, gap, air);
    const std::int32_t old_through = at.through_to[i], old_back = at.back_to[i];
    at.through_to[i] = edge ? through : old_through;
    at.back_to[i] = edge ? back : old_back;
  }
}

void search(const GhostLens& lens, int body, const GhostRay* from, const GhostChoice& choice, GhostChildren& children,
            int count) {
  Work work;
  Nearest found;
  Rays& outward = work.second;
  load(work.rays, from, count);
  for (int i = 0; i < count; ++i) {
    found.t[i] = kNever;
    found.what[i] = kNothing;
    outward.x[i] = outward.y[i] = outward.z[i] = outward.l[i] = outward.m[i] = outward.n[i] = 0.0F;
    outward.tag[i] = 0;
  }
  nearest_absorber(lens, body < 0, work.rays, found, count);
  const int first = body < 0 ? 0 : body, last = body < 0 ? lens.body_count : body + 1;
  for (int start = 0; start < count; start += kGhostLanes) {
    const int end = start + kGhostLanes;
    for (int k = first; k < last; ++k) {
      const GhostBody& one = lens.bodies[k];
      int within = 0;
      for (int i = start; i < end; ++i) {
        const float z = work.rays.z[i], reached = fused(found.t[i], work.rays.n[i], z);
        within |= (larger_of(z, reached) >= one.nearest_z) & (smaller_of(z, reached) <= one.farthest_z) ? 1 : 0;
      }
      if (!within) continue;
      nearest_on_face(one.faces[0], 4 * k + front, work.rays, found, start, end);
      nearest_on_face(one.faces[1], 4 * k + back, work.rays, found, start, end);
      nearest_on_edge(one, 4 * k, work.rays, found, start, end);
    }
  }
  place_hits(lens, body < 0, found, work.rays, work.at, count);
  for (int start = 0; start < count; start += kGhostLanes) {
    const int end = start + kGhostLanes;
    for (int k = first; k < last; ++k) {
      int faces = 0, edges = 0;
      for (int i = start; i < end; ++i) {
        faces |= found.what[i] >> 1 == 2 * k ? 1 : 0;
        edges |= found.what[i] >> 1 == 2 * k + 1 ? 1 : 0;
      }
      if (faces) describe_face(lens.bodies[k], 4 * k, found, work.rays, work.at, start, end);
      if (edges) describe_edge(lens.bodies[k], 4 * k, found, work.rays, work.at, outward, start, end);
    }
  }
  weigh(work.at, work.rays, count);
  leave_edges(found, lens.air, work.at, outward, count);
  go_on(work, choice, children, count);
}

}  // namespace

extern const GhostKernels ghost_kernels = {advance, search};

}  // namespace RELIGN_KERNEL_ISA
}  // namespace relign::optics
