// Blocks of rays among the surfaces of a GhostWalk, in float: what GhostWalk::advance, reflect and refract do, for up
// to kGhostRays rays in one gap and direction at a time.
//
// Rays wait in queues: one for each gap and direction, one for each piece of glass and one for air whose rays must be
// searched among all surfaces, and two for rays that have left the lens. A kernel takes rays of one queue and tells to
// which queue each goes next, so that all rays of a block meet the same surface.
//
// This header is compiled for several instruction sets: plain data only, no inline functions.
#pragma once

#include <cstdint>

namespace relign::optics {

constexpr int kGhostRays = 128;  // of a block, at most; a multiple of kGhostLanes
constexpr int kGhostLanes = 16;
constexpr int kGhostEvents = 64;  // a path ends after this many

// Lens coordinates, mm.
struct GhostRay {
  float x, y, z;
  float l, m, n;  // direction, unit
  float weight;
  std::uint32_t tag;
};
// Of tags: the path's number, how often it met a surface or left the lens, whether it comes directly from a face,
// whether it was reflected or met an edge, whether it met an edge or was scattered (such light is faint).
constexpr std::uint32_t kGhostPaths = 1U << 22, kGhostEvent = 1U << 22, kGhostEventMask = 127U << 22;
constexpr std::uint32_t kGhostLeftFace = 1U << 29, kGhostReflected = 1U << 30, kGhostFaint = 1U << 31;

struct GhostFace {
  float vertex[3], axis[3];
  float curvature, clear_radius2;
};

// What rays in one gap and direction meet next.
struct GhostStep {
  enum Kind : std::int32_t { face, stop, end };
  Kind kind;
  float sign;      // 1 towards the image, -1 towards the object
  GhostFace next;  // stop: a plane
  float index_ratio;
  // The face that rays of this queue may come from, if they may hit it again; and the square of its radius.
  std::int32_t concave;
  GhostFace left;
  std::int32_t holds_stop;                          // in glass with a stop
  std::int32_t refracted, reflected, past, search;  // queues; past: of a stop or of the end
};

// An element's piece of glass: two faces, a cylinder and a plane ring; see GhostWalk::Edge.
struct GhostBody {
  GhostFace faces[2];
  std::int32_t number;                        // of the first face among the surfaces
  float towards_image[2], towards_object[2];  // index ratios
  float origin[3], axis[3];
  float index;
  float radius, low_z, high_z;
  float ring_z, ring_inner_radius, ring_side;
  float ring_inner[2], ring_outer[2], cylinder_low[2], cylinder_high[2];  // normals: radial, axial
  float nearest_z, farthest_z;
  std::int32_t gap;
};

struct GhostStop {
  float z, opening_radius2;
};

struct GhostLens {
  const GhostBody* bodies;
  const GhostStop* stops;
  std::int32_t body_count, stop_count;
  std::int32_t has_barrel;
  float bore_radius2, front_z, rim_z;
  std::int32_t air, object_side, image_side;  // queues
};

// How rays continue at faces and edges.
struct GhostChoice {
  // false: refracted or reflected at random, with Russian roulette from the fifth event on (the paper's renderer).
  // true: both, weighted; roulette applies to weights below least_weight, of faint light below least_faint.
  bool both;
  float least_weight, least_faint;
  const std::uint32_t *words, *more_words;  // random, one of each per ray
};

constexpr std::int32_t kGhostGone = -1;  // in place of a queue

struct GhostChildren {
  GhostRay first[kGhostRays], second[kGhostRays];
  std::int32_t first_to[kGhostRays], second_to[kGhostRays];  // queues; second only if rays continue as both
};

struct GhostKernels {
  // Advances rays of one gap and direction.
  void (*advance)(const GhostStep& step, const GhostLens& lens, const GhostRay* rays, const GhostChoice& choice,
                  GhostChildren& children, int count);
  // Searches all surfaces of air (body -1) or of one piece of glass.
  void (*search)(const GhostLens& lens, int body, const GhostRay* rays, const GhostChoice& choice,
                 GhostChildren& children, int count);
};

#if !defined(__CUDACC_RTC__)
namespace generic {
extern const GhostKernels ghost_kernels;
}
namespace avx2 {
extern const GhostKernels ghost_kernels;
}
namespace avx512 {
extern const GhostKernels ghost_kernels;
}
#endif

}  // namespace relign::optics
