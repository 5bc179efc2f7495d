#include "optics/ghost_tables.h"

namespace relign::optics {
namespace {

void set(float (&to)[3], const Vec3& from) {
  to[0] = static_cast<float>(from.x);
  to[1] = static_cast<float>(from.y);
  to[2] = static_cast<float>(from.z);
}

}  // namespace

int GhostTables::search_queue(int glass) const {
  if (glass != 0)
    for (std::size_t k = 0; k < bodies_.size(); ++k)
      if (bodies_[k].gap == glass) return lens_.air + 1 + static_cast<int>(k);
  return lens_.air;
}

void GhostTables::set(const GhostWalk& walk) {
  const auto face_of = [](const GhostWalk::Surface& surface) {
    GhostFace face{};
    optics::set(face.vertex, surface.vertex);
    optics::set(face.axis, surface.axis);
    face.curvature = static_cast<float>(surface.curvature);
    face.clear_radius2 = static_cast<float>(surface.clear_radius2);
    return face;
  };
  const auto surface_at = [&](int number) -> const GhostWalk::Surface& {
    return walk.surfaces_[static_cast<std::size_t>(number)];
  };
  surfaces_ = static_cast<int>(walk.surfaces_.size());

  bodies_.clear();
  for (const GhostWalk::Edge& edge : walk.edges_) {
    GhostBody body{};
    body.gap = edge.gap;
    body.number = edge.gap - 1;
    for (int k = 0; k < 2; ++k) {
      const GhostWalk::Surface& surface = surface_at(body.number + k);
      body.faces[k] = face_of(surface);
      body.towards_image[k] = static_cast<float>(surface.index_front / surface.index_back);
      body.towards_object[k] = static_cast<float>(surface.index_back / surface.index_front);
    }
    optics::set(body.origin, edge.origin);
    optics::set(body.axis, edge.axis);
    body.index = static_cast<float>(edge.index);
    body.radius = static_cast<float>(edge.radius);
    body.low_z = static_cast<float>(edge.low_z);
    body.high_z = static_cast<float>(edge.high_z);
    body.ring_z = static_cast<float>(edge.ring_z);
    body.ring_inner_radius = static_cast<float>(edge.ring_inner_radius);
    body.ring_side = edge.ring_faces_image ? 1.0F : -1.0F;
    const auto normal = [](float(&to)[2], const GhostWalk::Normal& from) {
      to[0] = static_cast<float>(from.radial);
      to[1] = static_cast<float>(from.axial);
    };
    normal(body.ring_inner, edge.ring_inner);
    normal(body.ring_outer, edge.ring_outer);
    normal(body.cylinder_low, edge.cylinder_low);
    normal(body.cylinder_high, edge.cylinder_high);
    body.nearest_z = static_cast<float>(edge.nearest_z);
    body.farthest_z = static_cast<float>(edge.farthest_z);
    bodies_.push_back(body);
  }
  stops_.clear();
  for (const int stop : walk.stops_)
    stops_.push_back(
        {static_cast<float>(surface_at(stop).vertex.z), static_cast<float>(surface_at(stop).clear_radius2)});

  lens_.bodies = bodies_.data();
  lens_.stops = stops_.data();
  lens_.body_count = static_cast<int>(bodies_.size());
  lens_.stop_count = static_cast<int>(stops_.size());
  lens_.has_barrel = walk.has_barrel_ ? 1 : 0;
  lens_.bore_radius2 = static_cast<float>(walk.bore_radius2_);
  lens_.front_z = static_cast<float>(walk.front_z_);
  lens_.rim_z = static_cast<float>(walk.rim_z_);
  lens_.air = 2 * (surfaces_ + 1);
  lens_.object_side = lens_.air + 1 + lens_.body_count;
  lens_.image_side = lens_.object_side + 1;

  steps_.clear();
  for (int gap = 0; gap <= surfaces_; ++gap)
    for (const bool to_image : {false, true}) {
      GhostStep step{};
      step.sign = to_image ? 1.0F : -1.0F;
      step.search = lens_.air;
      for (const GhostWalk::Edge& edge : walk.edges_)
        if (edge.gap == gap) {
          step.search = search_queue(gap);
          step.holds_stop = edge.holds_stop ? 1 : 0;
        }
      int left = to_image ? gap - 1 : gap;
      while (left >= 0 && left < surfaces_ && surface_at(left).is_stop) left += to_image ? -1 : 1;
      if (left >= 0 && left < surfaces_) {
        step.left = face_of(surface_at(left));
        step.concave = to_image ? step.left.curvature > 0 : step.left.curvature < 0;
      }
      const int number = to_image ? gap : gap - 1, past = to_image ? gap + 1 : gap - 1;
      if (number < 0 || number >= surfaces_) {
        step.kind = GhostStep::end;
        step.past = to_image ? lens_.image_side : lens_.object_side;
      } else {
        const GhostWalk::Surface& next = surface_at(number);
        step.kind = next.is_stop ? GhostStep::stop : GhostStep::face;
        step.next = face_of(next);
        step.index_ratio =
            static_cast<float>(to_image ? next.index_front / next.index_back : next.index_back / next.index_front);
        step.past = step.refracted = queue_of(past, to_image);
        step.reflected = queue_of(gap, !to_image);
      }
      steps_.push_back(step);
    }
}

void GhostTables::advance(const GhostKernels& kernels, int queue, const GhostRay* rays, const GhostChoice& choice,
                          GhostChildren& children, int count) const {
  if (queue < lens_.air)
    kernels.advance(steps_[static_cast<std::size_t>(queue)], lens_, rays, choice, children, count);
  else
    kernels.search(lens_, queue - lens_.air - 1, rays, choice, children, count);
}

}  // namespace relign::optics
