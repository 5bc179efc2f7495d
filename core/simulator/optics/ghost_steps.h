// The arithmetic of one ray among the surfaces of a GhostWalk, in float, written once: block kernels apply it to blocks
// of rays (ghost_kernels.cpp), GPU kernels to the ray of a thread (advance_ghost). The formulas are those of
// ghost_walk.cpp. Compiled like ray_steps.h.
#pragma once

#include "optics/ghost_block.h"
#include "optics/ray_steps.h"

namespace relign::optics {

// Rounding leaves a ray this close (mm) to the surface that it has just left.
constexpr float kGhostNearest = 1e-4F;
constexpr float kGhostNever = 1e30F;
// The paper's renderer: from the fifth event on a path survives with its throughput, at most 0.95.
constexpr float kGhostMostSurvival = 0.95F;
constexpr std::uint32_t kGhostRouletteFrom = 5 * kGhostEvent;

struct GhostLine {
  float x, y, z, l, m, n;
  std::uint32_t tag;
};

// Where a ray meets a surface: unit normal, its product with the direction, index before / after; and the queues that
// it goes to. One that meets nothing goes to `elsewhere` unchanged.
struct GhostMeeting {
  float x, y, z;
  float normal_x, normal_y, normal_z;
  float cosine, ratio;
  std::int32_t met, elsewhere;
  std::uint32_t tag;  // of the children
  std::int32_t through_to, back_to;
};

// The directions after refraction and reflection; the reflectance, 1: total reflection.
struct GhostWays {
  float through_l, through_m, through_n;
  float back_l, back_m, back_n;
  float reflectance;
};

RELIGN_DEVICE float ghost_product(const float* a, float x, float y, float z) {
  return multiply_add(a[0], x, multiply_add(a[1], y, a[2] * z));
}

// ---- The next surface in order ----

// Distance to the other end of the chord on the concave side of a face, kGhostNever if it is not on the face.
RELIGN_DEVICE float ghost_chord(const GhostFace& face, const GhostLine& ray) {
  const float px = ray.x - face.vertex[0], py = ray.y - face.vertex[1], pz = ray.z - face.vertex[2], c = face.curvature;
  const float nx = multiply_add(-c, px, face.axis[0]), ny = multiply_add(-c, py, face.axis[1]),
              nz = multiply_add(-c, pz, face.axis[2]);
  const float t = 2.0F * multiply_add(ray.l, nx, multiply_add(ray.m, ny, ray.n * nz)) / c;
  const float hx = multiply_add(t, ray.l, px), hy = multiply_add(t, ray.m, py), hz = multiply_add(t, ray.n, pz);
  const float height = ghost_product(face.axis, hx, hy, hz);
  const float square = multiply_add(hx, hx, multiply_add(hy, hy, hz * hz));
  const bool on = ((ray.tag & kGhostLeftFace) != 0) & (t > kGhostNearest) & (c * height < 1.0F) &
                  (multiply_add(-height, height, square) < face.clear_radius2);
  return on ? t : kGhostNever;
}

// Distance to a stop that absorbs the ray before a distance, else that distance.
RELIGN_DEVICE float absorbed_by(const GhostStop& stop, const GhostLine& ray, float before) {
  const float t = (stop.z - ray.z) / ray.n;
  const float x = multiply_add(t, ray.l, ray.x), y = multiply_add(t, ray.m, ray.y);
  return (t > kGhostNearest) & (t < before) & (multiply_add(x, x, y * y) > stop.opening_radius2) ? t : before;
}

// Where the line of a ray may meet a face: e + f / (forward +- root of the discriminant) are the distances, p is
// relative to the vertex.
struct GhostAim {
  float px, py, pz, forward, e, f, discriminant;
};
RELIGN_DEVICE GhostAim aim_at(const GhostFace& face, const GhostLine& ray) {
  const float c = face.curvature;
  const float px = ray.x - face.vertex[0], py = ray.y - face.vertex[1], pz = ray.z - face.vertex[2];
  const float forward = ghost_product(face.axis, ray.l, ray.m, ray.n);
  const float e = -multiply_add(px, ray.l, multiply_add(py, ray.m, pz * ray.n));
  const float mx = multiply_add(e, ray.l, px), my = multiply_add(e, ray.m, py), mz = multiply_add(e, ray.n, pz);
  const float f = multiply_add(c, multiply_add(mx, mx, multiply_add(my, my, mz * mz)),
                               -2.0F * ghost_product(face.axis, mx, my, mz));
  const float discriminant = multiply_add(forward, forward, -c * f);
  return {px, py, pz, forward, e, f, discriminant};
}

// again: distance to the face that the ray came from, which it may hit again; absorbed: to a stop inside this glass.
// kGhostNever: none.
RELIGN_DEVICE GhostMeeting meet_next_face(const GhostStep& step, const GhostLine& ray, float again, float absorbed) {
  const GhostFace& face = step.next;
  const float c = face.curvature;
  const GhostAim aim = aim_at(face, ray);
  const float cosine = step.sign * square_root(magnitude(aim.discriminant));
  const float t = aim.e + aim.f / (aim.forward + cosine);
  const float hx = multiply_add(t, ray.l, aim.px), hy = multiply_add(t, ray.m, aim.py),
              hz = multiply_add(t, ray.n, aim.pz);
  const float height = ghost_product(face.axis, hx, hy, hz);
  const float across = multiply_add(-height, height, multiply_add(hx, hx, multiply_add(hy, hy, hz * hz)));
  const bool met = (step.sign * aim.forward > 0.0F) & (aim.discriminant > 0.0F) & (t > kGhostNearest) &
                   (across < face.clear_radius2) & !(again < t);
  const bool lost = met & (absorbed < t);
  GhostMeeting at;
  at.x = hx + face.vertex[0];
  at.y = hy + face.vertex[1];
  at.z = hz + face.vertex[2];
  at.normal_x = multiply_add(-c, hx, face.axis[0]);
  at.normal_y = multiply_add(-c, hy, face.axis[1]);
  at.normal_z = multiply_add(-c, hz, face.axis[2]);
  at.cosine = cosine;
  at.ratio = step.index_ratio;
  at.met = met & !lost ? 1 : 0;
  at.elsewhere = lost ? kGhostGone : step.search;
  at.tag = (ray.tag | kGhostLeftFace) + kGhostEvent;
  at.through_to = step.refracted;
  at.back_to = step.reflected;
  return at;
}

// The queue behind a stop, which does not change the medium: the ray is not moved.
RELIGN_DEVICE std::int32_t past_stop(const GhostStep& step, const GhostLine& ray, float again) {
  const float t = (step.next.vertex[2] - ray.z) / ray.n;
  const float x = multiply_add(t, ray.l, ray.x), y = multiply_add(t, ray.m, ray.y), r2 = multiply_add(x, x, y * y);
  const bool met = (step.sign * ray.n > 0.0F) & (t > 0.0F) & !(again < t);
  // Directly from a face and within its aperture: no edge in between.
  const bool lost = met & ((ray.tag & kGhostLeftFace) != 0) & (r2 < step.left.clear_radius2);
  return met & (r2 < step.next.clear_radius2) ? step.past : lost ? kGhostGone : step.search;
}

// The queue of a ray that no surface is left for.
RELIGN_DEVICE std::int32_t past_end(const GhostStep& step, const GhostLine& ray, float again) {
  const bool free = ((ray.tag & kGhostLeftFace) != 0) & !(again < kGhostNever);
  return free ? step.past : step.search;
}

// ---- All surfaces of a piece of glass or of air ----

// The nearest hit so far: kHitNothing, kHitAbsorber, or four times the body and what of it.
enum GhostPart : std::int32_t { kHitFront, kHitBack, kHitRing, kHitCylinder };
constexpr std::int32_t kHitNothing = -1, kHitAbsorber = -2;
struct GhostHit {
  float t;
  std::int32_t what;
};

RELIGN_DEVICE bool is_edge(GhostHit hit) { return (hit.what >= 0) & ((hit.what & 3) >= kHitRing); }

// By value, as all that block kernels call in loops: compilers vectorise no references to members.
RELIGN_DEVICE GhostHit nearer(GhostHit found, bool hit, float t, std::int32_t what) {
  const bool is_nearer = hit & (t > kGhostNearest) & (t < found.t);
  const float distance = is_nearer ? t : found.t;
  const std::int32_t part = is_nearer ? what : found.what;
  return {distance, part};
}

RELIGN_DEVICE GhostHit nearest_on_bore(const GhostLens& lens, const GhostLine& ray) {
  const float a = multiply_add(ray.l, ray.l, ray.m * ray.m), b = multiply_add(ray.x, ray.l, ray.y * ray.m);
  const float discriminant = multiply_add(b, b, -a * (multiply_add(ray.x, ray.x, ray.y * ray.y) - lens.bore_radius2));
  const float t = (square_root(magnitude(discriminant)) - b) / a;
  const float z = multiply_add(t, ray.n, ray.z);
  const bool hit = (a > 0.0F) & (discriminant > 0.0F) & (z > lens.front_z) & (z < lens.rim_z);
  const float distance = hit ? t : kGhostNever;
  const std::int32_t what = hit ? kHitAbsorber : kHitNothing;
  return {distance, what};
}

RELIGN_DEVICE GhostHit nearest_on_stop(const GhostStop& stop, const GhostLine& ray, GhostHit found) {
  const float before = found.t, t = absorbed_by(stop, ray, before);
  const std::int32_t other = found.what, what = t < before ? kHitAbsorber : other;
  return {t, what};
}

RELIGN_DEVICE GhostHit nearest_on_face(const GhostFace& face, std::int32_t what, const GhostLine& ray, GhostHit found) {
  const float c = face.curvature;
  const GhostAim aim = aim_at(face, ray);
  const float root = square_root(magnitude(aim.discriminant));
  const auto or_at = [&](GhostHit hit, float t) {
    const float hx = multiply_add(t, ray.l, aim.px), hy = multiply_add(t, ray.m, aim.py),
                hz = multiply_add(t, ray.n, aim.pz);
    const float height = ghost_product(face.axis, hx, hy, hz);
    const float across = multiply_add(-height, height, multiply_add(hx, hx, multiply_add(hy, hy, hz * hz)));
    return nearer(hit, (aim.discriminant > 0.0F) & (c * height < 1.0F) & (across < face.clear_radius2), t, what);
  };
  // Of a plane one of them is infinite or NaN, and rejected.
  return or_at(or_at(found, aim.e + aim.f / (aim.forward + root)), aim.e + aim.f / (aim.forward - root));
}

RELIGN_DEVICE GhostHit nearest_on_edge(const GhostBody& body, std::int32_t number, const GhostLine& ray,
                                       GhostHit found) {
  const float radius2 = body.radius * body.radius, inner2 = body.ring_inner_radius * body.ring_inner_radius;
  const float ax = body.axis[0], ay = body.axis[1], az = body.axis[2];
  const float px = ray.x - body.origin[0], py = ray.y - body.origin[1], pz = ray.z - body.origin[2];
  const float height = multiply_add(px, ax, multiply_add(py, ay, pz * az)),
              forward = multiply_add(ray.l, ax, multiply_add(ray.m, ay, ray.n * az));
  const float cx = multiply_add(-height, ax, px), cy = multiply_add(-height, ay, py),
              cz = multiply_add(-height, az, pz);
  const float sx = multiply_add(-forward, ax, ray.l), sy = multiply_add(-forward, ay, ray.m),
              sz = multiply_add(-forward, az, ray.n);
  const float a = multiply_add(sx, sx, multiply_add(sy, sy, sz * sz)),
              b = multiply_add(cx, sx, multiply_add(cy, sy, cz * sz));
  const float square = multiply_add(cx, cx, multiply_add(cy, cy, cz * cz));
  const float to_ring = (body.ring_z - height) / forward;
  const float r2 = multiply_add(to_ring, multiply_add(to_ring, a, 2.0F * b), square);
  const GhostHit with_ring = nearer(found, (r2 > inner2) & (r2 < radius2), to_ring, number + kHitRing);
  const float discriminant = multiply_add(b, b, -a * (square - radius2));
  const float root = square_root(magnitude(discriminant)), per_a = 1.0F / a;
  const auto or_at = [&](GhostHit hit, float t) {
    const float z = multiply_add(t, forward, height);
    return nearer(hit, (a > 0.0F) & (discriminant > 0.0F) & (z > body.low_z) & (z < body.high_z), t,
                  number + kHitCylinder);
  };
  return or_at(or_at(with_ring, (-root - b) * per_a), (root - b) * per_a);
}

// Whether a ray as long as its nearest hit reaches a body.
RELIGN_DEVICE bool reaches(const GhostBody& body, float z, float n, GhostHit found) {
  const float reached = multiply_add(found.t, n, z);
  return (larger(z, reached) >= body.nearest_z) & (smaller(z, reached) <= body.farthest_z);
}

// The place of a hit; normal, cosine, ratio and queues are set by on_face and on_edge.
RELIGN_DEVICE GhostMeeting meet_nearest(const GhostLens& lens, bool in_air, const GhostLine& ray, GhostHit hit) {
  const bool open = in_air & (hit.what == kHitNothing);
  const std::int32_t object_side = lens.object_side, image_side = lens.image_side;
  const std::uint32_t kept = (ray.tag & ~kGhostLeftFace) + kGhostEvent;
  GhostMeeting at;
  at.x = multiply_add(hit.t, ray.l, ray.x);
  at.y = multiply_add(hit.t, ray.m, ray.y);
  at.z = multiply_add(hit.t, ray.n, ray.z);
  at.normal_x = 0.0F;
  at.normal_y = 0.0F;
  at.normal_z = 1.0F;
  at.cosine = 1.0F;
  at.ratio = 1.0F;
  at.met = hit.what >= 0 ? 1 : 0;
  at.elsewhere = open ? (ray.n < 0.0F ? object_side : image_side) : kGhostGone;
  at.tag = kept | (is_edge(hit) ? kGhostReflected | kGhostFaint : kGhostLeftFace);
  at.through_to = kGhostGone;
  at.back_to = kGhostGone;
  return at;
}

// The queue of a gap and direction.
RELIGN_DEVICE std::int32_t ghost_queue(std::int32_t gap, bool to_image) { return 2 * gap + (to_image ? 1 : 0); }

// A ray that meets the first or second face of a body, at a distance.
RELIGN_DEVICE void on_face(const GhostBody& body, bool second, float t, const GhostLine& ray, GhostMeeting& at) {
  const GhostFace &one = body.faces[0], &other = body.faces[1];
  const float x = multiply_add(t, ray.l, ray.x), y = multiply_add(t, ray.m, ray.y), z = multiply_add(t, ray.n, ray.z);
  const float c = second ? other.curvature : one.curvature;
  const float px = x - (second ? other.vertex[0] : one.vertex[0]), py = y - (second ? other.vertex[1] : one.vertex[1]);
  const float pz = z - (second ? other.vertex[2] : one.vertex[2]);
  at.normal_x = multiply_add(-c, px, second ? other.axis[0] : one.axis[0]);
  at.normal_y = multiply_add(-c, py, second ? other.axis[1] : one.axis[1]);
  at.normal_z = multiply_add(-c, pz, second ? other.axis[2] : one.axis[2]);
  at.cosine = multiply_add(ray.l, at.normal_x, multiply_add(ray.m, at.normal_y, ray.n * at.normal_z));
  const bool to_image = at.cosine > 0.0F;
  const float forth = second ? body.towards_image[1] : body.towards_image[0];
  const float aback = second ? body.towards_object[1] : body.towards_object[0];
  at.ratio = to_image ? forth : aback;
  const std::int32_t surface = body.number + (second ? 1 : 0), beyond = surface + 1;
  at.through_to = ghost_queue(to_image ? beyond : surface, to_image);
  at.back_to = ghost_queue(to_image ? surface : beyond, !to_image);
}

// One that meets the ring or the cylinder. Its queues depend on its next directions (from_edge).
struct GhostEdge {
  float per_ring, per_height, into;  // of the body
};
RELIGN_DEVICE GhostEdge edge_of(const GhostBody& body) {
  return {1.0F / (body.radius - body.ring_inner_radius), 1.0F / (body.high_z - body.low_z), 1.0F / body.index};
}
struct GhostOutward {  // towards the air, of any length
  float x, y, z;
};
RELIGN_DEVICE GhostOutward on_edge(const GhostBody& b, const GhostEdge& edge, bool ring, float t, const GhostLine& ray,
                                   GhostMeeting& at) {
  const float ex = multiply_add(t, ray.l, ray.x) - b.origin[0], ey = multiply_add(t, ray.m, ray.y) - b.origin[1],
              ez = multiply_add(t, ray.n, ray.z) - b.origin[2];
  const float height = ghost_product(b.axis, ex, ey, ez);
  const float cx = multiply_add(-height, b.axis[0], ex), cy = multiply_add(-height, b.axis[1], ey),
              cz = multiply_add(-height, b.axis[2], ez);
  const float radius = square_root(multiply_add(cx, cx, multiply_add(cy, cy, cz * cz)));
  const float share = ring ? (radius - b.ring_inner_radius) * edge.per_ring : (height - b.low_z) * edge.per_height;
  const float r0 = ring ? b.ring_inner[0] : b.cylinder_low[0], r1 = ring ? b.ring_outer[0] : b.cylinder_high[0];
  const float a0 = ring ? b.ring_inner[1] : b.cylinder_low[1], a1 = ring ? b.ring_outer[1] : b.cylinder_high[1];
  const float radial = multiply_add(share, r1 - r0, r0), axial = multiply_add(share, a1 - a0, a0);
  const float scale = 1.0F / square_root(multiply_add(radial, radial, axial * axial));
  const float along = scale * radial / radius, up = scale * axial;
  at.normal_x = multiply_add(along, cx, up * b.axis[0]);
  at.normal_y = multiply_add(along, cy, up * b.axis[1]);
  at.normal_z = multiply_add(along, cz, up * b.axis[2]);
  at.cosine = multiply_add(ray.l, at.normal_x, multiply_add(ray.m, at.normal_y, ray.n * at.normal_z));
  at.ratio = at.cosine < 0.0F ? edge.into : b.index;
  return {ring ? b.ring_side * b.axis[0] : cx, ring ? b.ring_side * b.axis[1] : cy,
          ring ? b.ring_side * b.axis[2] : cz};
}

// Where a ray goes that leaves an edge in a direction: into the glass or the air beside the elements.
RELIGN_DEVICE std::int32_t from_edge(float l, float m, float n, const GhostOutward& outward, float ax, float ay,
                                     float az, std::int32_t gap, std::int32_t air) {
  const bool inside = multiply_add(l, outward.x, multiply_add(m, outward.y, n * outward.z)) < 0.0F;
  const std::int32_t queue = ghost_queue(gap, multiply_add(l, ax, multiply_add(m, ay, n * az)) > 0.0F);
  return inside ? queue : air;
}

// ---- Both ways on ----

// Fresnel reflectance of unpolarised light, as unpolarised_reflectance() of ghost_walk.cpp.
RELIGN_DEVICE GhostWays ways_on(const GhostMeeting& at, float l, float m, float n) {
  const float ratio = at.ratio, signed_cosine = at.cosine, cosine = magnitude(signed_cosine);
  const float squared = multiply_add(-ratio * ratio, multiply_add(-cosine, cosine, 1.0F), 1.0F);
  const float after = square_root(magnitude(squared));
  const float s_below = multiply_add(ratio, cosine, after), p_below = multiply_add(ratio, after, cosine);
  const float s = multiply_add(ratio, cosine, -after) * p_below, p = multiply_add(-ratio, after, cosine) * s_below;
  const float below = s_below * p_below;
  const float partly = 0.5F * multiply_add(s, s, p * p) / (below * below);
  const float signed_after = signed_cosine > 0.0F ? after : -after;
  const float g = multiply_add(-ratio, signed_cosine, signed_after), back = -2.0F * signed_cosine;
  return {multiply_add(g, at.normal_x, ratio * l), multiply_add(g, at.normal_y, ratio * m),
          multiply_add(g, at.normal_z, ratio * n), multiply_add(back, at.normal_x, l),
          multiply_add(back, at.normal_y, m),      multiply_add(back, at.normal_z, n),
          squared > 0.0F ? partly : 1.0F};
}

// Refracted or reflected at random, with Russian roulette: the ray afterwards, and its queue.
RELIGN_DEVICE GhostRay one_way_on(const GhostMeeting& at, const GhostWays& ways, const GhostLine& ray, float weight,
                                  std::uint32_t word, std::uint32_t another, std::int32_t& to) {
  const bool met = at.met != 0;
  const bool turns = unit_of_word(word) < ways.reflectance;
  const std::uint32_t events = at.tag & kGhostEventMask;
  const float survival = events >= kGhostRouletteFrom ? smaller(weight, kGhostMostSurvival) : 1.0F;
  const bool stays = (events < kGhostEvents * kGhostEvent) & (unit_of_word(another) < survival);
  to = met ? (stays ? (turns ? at.back_to : at.through_to) : kGhostGone) : at.elsewhere;
  return {met ? at.x : ray.x,
          met ? at.y : ray.y,
          met ? at.z : ray.z,
          met ? (turns ? ways.back_l : ways.through_l) : ray.l,
          met ? (turns ? ways.back_m : ways.through_m) : ray.m,
          met ? (turns ? ways.back_n : ways.through_n) : ray.n,
          met ? weight / survival : weight,
          met ? at.tag : ray.tag};
}

// ---- One ray alone ----

// Among all surfaces of air (body -1) or of one piece of glass.
RELIGN_DEVICE GhostMeeting search_ghost(const GhostLens& lens, std::int32_t body, const GhostLine& ray,
                                        GhostWays& ways) {
  const bool in_air = body < 0;
  GhostHit found{kGhostNever, kHitNothing};
  if (in_air && lens.has_barrel) found = nearest_on_bore(lens, ray);
  for (std::int32_t k = 0; k < lens.stop_count; ++k) found = nearest_on_stop(lens.stops[k], ray, found);
  const std::int32_t last = in_air ? lens.body_count : body + 1;
  for (std::int32_t k = in_air ? 0 : body; k < last; ++k) {
    const GhostBody& one = lens.bodies[k];
    if (!reaches(one, ray.z, ray.n, found)) continue;
    found = nearest_on_face(one.faces[0], 4 * k + kHitFront, ray, found);
    found = nearest_on_face(one.faces[1], 4 * k + kHitBack, ray, found);
    found = nearest_on_edge(one, 4 * k, ray, found);
  }
  GhostMeeting at = meet_nearest(lens, in_air, ray, found);
  ways = {};
  if (found.what < 0) return at;
  const GhostBody& met = lens.bodies[found.what >> 2];
  const std::int32_t part = found.what & 3;
  if (!is_edge(found)) {
    on_face(met, part == kHitBack, found.t, ray, at);
    ways = ways_on(at, ray.l, ray.m, ray.n);
    return at;
  }
  const GhostOutward outward = on_edge(met, edge_of(met), part == kHitRing, found.t, ray, at);
  ways = ways_on(at, ray.l, ray.m, ray.n);
  const float *const axis = met.axis, ax = axis[0], ay = axis[1], az = axis[2];
  at.through_to = from_edge(ways.through_l, ways.through_m, ways.through_n, outward, ax, ay, az, met.gap, lens.air);
  at.back_to = from_edge(ways.back_l, ways.back_m, ways.back_n, outward, ax, ay, az, met.gap, lens.air);
  return at;
}

// A ray of any queue but the ends, refracted or reflected at random at what it meets next; returns its queue then.
RELIGN_DEVICE std::int32_t advance_ghost(const GhostStep* steps, const GhostLens& lens, std::int32_t queue,
                                         std::uint32_t word, std::uint32_t another, GhostRay& ray) {
  const GhostLine line{ray.x, ray.y, ray.z, ray.l, ray.m, ray.n, ray.tag};
  GhostMeeting at;
  GhostWays ways;
  if (queue < lens.air) {
    const GhostStep& step = steps[queue];
    const float again = step.concave ? ghost_chord(step.left, line) : kGhostNever;
    if (step.kind == GhostStep::stop) return past_stop(step, line, again);
    if (step.kind == GhostStep::end) return past_end(step, line, again);
    float absorbed = kGhostNever;
    if (step.holds_stop)
      for (std::int32_t k = 0; k < lens.stop_count; ++k) absorbed = absorbed_by(lens.stops[k], line, absorbed);
    at = meet_next_face(step, line, again, absorbed);
    ways = ways_on(at, ray.l, ray.m, ray.n);
  } else {
    at = search_ghost(lens, queue - lens.air - 1, line, ways);
  }
  std::int32_t to = kGhostGone;
  ray = one_way_on(at, ways, line, ray.weight, word, another, to);
  return to;
}

}  // namespace relign::optics
