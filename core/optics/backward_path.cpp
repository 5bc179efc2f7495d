#include "optics/backward_path.h"

#include <algorithm>

namespace relign::optics {
namespace {

Op frame_op(const Motion& motion) {
  Op op{};
  op.kind = motion.is_shift() ? Op::shift : Op::frame;
  for (int i = 0; i < 9; ++i) op.rotation[i] = static_cast<float>(motion.rotation[static_cast<std::size_t>(i)]);
  op.translation[0] = static_cast<float>(motion.translation.x);
  op.translation[1] = static_cast<float>(motion.translation.y);
  op.translation[2] = static_cast<float>(motion.translation.z);
  return op;
}

Op face_op(const Face& face, double index_before) {
  Op op{};
  op.kind = Op::face;
  op.curvature = static_cast<float>(face.curvature);
  op.clear_radius2 = static_cast<float>(face.clear_radius_mm * face.clear_radius_mm);
  // Backwards the ray comes from the medium behind the face.
  op.index_before = static_cast<float>(face.index_after);
  op.index_after = static_cast<float>(index_before);
  op.index_ratio = static_cast<float>(face.index_after / index_before);
  if (face.is_sphere()) return op;
  op.kind = Op::asphere;
  op.conic_plus_1 = static_cast<float>(1 + face.conic);
  const double clear2 = face.clear_radius_mm * face.clear_radius_mm;
  op.per_clear_radius2 = static_cast<float>(1 / clear2);
  op.terms = static_cast<std::int32_t>(face.even_asphere.size());
  double scale = clear2;
  for (std::size_t i = 0; i < face.even_asphere.size(); ++i) {
    scale *= clear2;
    op.term[i] = static_cast<float>(face.even_asphere[i] * scale);
  }
  return op;
}
static_assert(kAsphereTerms == kMostAsphereTerms);

// At normal incidence.
double highest_transmittance(double index_before, double index_after) {
  constexpr double kSteepest = 3.7;
  const double ratio = std::max(index_before, index_after) / std::min(index_before, index_after);
  return ratio < kSteepest ? 4 * ratio / ((ratio + 1) * (ratio + 1)) : 1;
}

Op stop_op(Op::Kind kind, double radius) {
  Op op{};
  op.kind = kind;
  op.clear_radius2 = static_cast<float>(radius * radius);
  return op;
}

// Builds the list; keeps the current frame as a motion "frame -> lens" so that consecutive frames
// become one operation, and pure steps along the axis ride on the next face.
class Builder {
 public:
  explicit Builder(std::vector<Op>& ops) : ops_(ops) {}

  // Current frame := `part` with its origin at (0, 0, z) of it. The first call defines the start.
  void enter(const Motion& part, double z, Op op) {
    const Motion origin{kNoRotation, {0, 0, z}};
    const Motion frame = after(part, origin);
    if (!started_) {
      started_ = true;
      first_ = frame;
      op.vertex_z = 0;
    } else if (part.rotation == part_.rotation && part.translation.x == part_.translation.x &&
               part.translation.y == part_.translation.y && part.translation.z == part_.translation.z) {
      op.vertex_z = static_cast<float>(z - z_);
    } else {
      ops_.push_back(frame_op(after(inverse(frame), frame_)));
      op.vertex_z = 0;
    }
    ops_.push_back(op);
    part_ = part;
    z_ = z;
    frame_ = frame;
  }
  // An operation that leaves rays and frame where they are, at height z of the current part.
  void look_at(double z, Op op) {
    op.vertex_z = static_cast<float>(z - z_);
    ops_.push_back(op);
  }
  const Motion& first() const { return first_; }
  const Motion& current() const { return frame_; }
  void start_at(const Motion& part, double z) {
    started_ = true;
    part_ = part;
    z_ = z;
    frame_ = after(part, {kNoRotation, {0, 0, z}});
    first_ = frame_;
  }

 private:
  std::vector<Op>& ops_;
  bool started_ = false;
  Motion first_, frame_, part_;
  double z_ = 0;
};

}  // namespace

void set_backward_path(BackwardPath& path, const Assembly& assembly, const Motion& lens_to_world) {
  const Prescription& lens = assembly.lens();
  path.ops.clear();
  path.through_aperture = 0;
  path.highest_transmittance = 1;
  Builder builder(path.ops);
  const Motion unmoved;
  if (lens.mount) {
    builder.start_at(unmoved, lens.mount->to_z_mm);
    builder.look_at(lens.mount->to_z_mm, stop_op(Op::bore, lens.mount->bore_radius_mm));
  }
  // The stops at z or behind it that have not been passed yet, from the image on.
  double passed = 1e300;
  const auto pass_stops_behind = [&](double z) {
    while (true) {
      const Stop* next = nullptr;
      for (const Stop& stop : lens.stops)
        if (stop.z_mm >= z && stop.z_mm < passed && (!next || stop.z_mm > next->z_mm)) next = &stop;
      if (!next) return;
      builder.enter(unmoved, next->z_mm, stop_op(Op::stop, next->opening_radius_mm));
      if (next->aperture) path.through_aperture = path.ops.size();
      passed = next->z_mm;
    }
  };
  for (std::size_t e = lens.elements.size(); e-- > 0;) {
    const Element& element = lens.elements[e];
    pass_stops_behind(element.faces.back().z_mm);
    for (std::size_t f = element.faces.size(); f-- > 0;) {
      const double index_before = f == 0 ? 1.0 : element.faces[f - 1].index_after;
      builder.enter(assembly.placement(e), element.faces[f].z_mm, face_op(element.faces[f], index_before));
      path.highest_transmittance *= highest_transmittance(index_before, element.faces[f].index_after);
    }
  }
  pass_stops_behind(-1e300);
  constexpr double kRounding = 1e-5;  // of float products over some dozens of faces
  path.highest_transmittance = std::min(1.0, path.highest_transmittance * (1 + kRounding));
  path.into_first_frame = inverse(after(lens_to_world, builder.first()));
  path.world_of_last_frame = after(lens_to_world, builder.current());
}

BackwardPath backward_path(const Assembly& assembly, const Motion& lens_to_world) {
  BackwardPath path;
  set_backward_path(path, assembly, lens_to_world);
  return path;
}

Op last_frame_to_world(const BackwardPath& path) { return frame_op(path.world_of_last_frame); }

void set_first_frame(TileStart& tile, const BackwardPath& path, const Vec3& tile_centre_world) {
  const Motion& motion = path.into_first_frame;
  for (int i = 0; i < 9; ++i) tile.rotation[i] = static_cast<float>(motion.rotation[static_cast<std::size_t>(i)]);
  const Vec3 centre = motion.point(tile_centre_world);
  tile.translation[0] = static_cast<float>(centre.x);
  tile.translation[1] = static_cast<float>(centre.y);
  tile.translation[2] = static_cast<float>(centre.z);
}

}  // namespace relign::optics
