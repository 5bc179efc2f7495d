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
  const float least_weight = choice.least_weight, least_faint = choice.least_faint;
  const std::uint32_t *const words = choice.words, *const more = choice.more_words;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const bool met = at.met[i] != 0;
    const std::uint32_t tag = at.tag[i], old = rays.tag[i];
    const float weight = rays.weight[i], reflectance = at.reflectance[i];
    const float least = (tag & kGhostFaint) != 0 ? least_faint : least_weight;
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

#include "optics/ghost_search.inc"

}  // namespace

extern const GhostKernels ghost_kernels = {advance, search};

}  // namespace RELIGN_KERNEL_ISA
}  // namespace relign::optics
