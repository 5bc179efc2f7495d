#include "optics/backward_path.h"

#include <algorithm>
#include <iterator>

namespace relign::optics {
namespace {

ExactOp frame_op(const Motion& motion) {
  ExactOp op{};
  op.kind = motion.is_shift() ? Op::shift : Op::frame;
  for (int i = 0; i < 9; ++i) op.rotation[i] = motion.rotation[static_cast<std::size_t>(i)];
  op.translation[0] = motion.translation.x;
  op.translation[1] = motion.translation.y;
  op.translation[2] = motion.translation.z;
  return op;
}

// `opening`: radius of the stop on this face; huge without one.
ExactOp face_op(const Face& face, const FaceBounds& bounds, double index_before, double opening) {
  ExactOp op{};
  op.kind = Op::face;
  op.curvature = face.curvature;
  const double clear = std::min(face.clear_radius_mm, opening);
  op.clear_radius2 = clear * clear;
  // Backwards the ray comes from the medium behind the face.
  op.index_before = face.index_after;
  op.index_after = index_before;
  op.index_ratio = face.index_after / index_before;
  if (face.is_sphere()) return op;
  op.kind = Op::asphere;
  op.conic_plus_1 = 1 + face.conic;
  const double radius = face.clear_radius_mm, radius2 = radius * radius;
  op.shape_radius = radius;
  op.per_shape_radius2 = 1 / radius2;
  op.lowest = bounds.lowest;
  op.highest = bounds.highest;
  op.steepest = bounds.steepest;
  op.most_bent = bounds.most_bent;
  op.near_vertex = bounds.near_vertex;
  op.near_curvature = face.is_conic() ? face.curvature : bounds.near_curvature;
  op.near_conic_plus_1 = face.is_conic() ? 1 + face.conic : bounds.near_conic_plus_1;
  op.rings = bounds.rings.get();
  op.over_root = face.over_root.empty() ? 0 : 1;
  // Faces with Q_bfs terms have no even terms: prescriptions reject the combination.
  const std::vector<double>& even = op.over_root ? face.over_root : face.even_asphere;
  double scale = radius2;
  if (!op.over_root) {
    op.even[0] = face.r2_term * scale;
    op.even_terms = face.r2_term != 0 ? 1 : 0;
    scale *= radius2;
  }
  for (std::size_t i = 0; i < even.size(); ++i, scale *= radius2) op.even[i + (op.over_root ? 0 : 1)] = even[i] * scale;
  if (!even.empty()) op.even_terms = static_cast<std::int32_t>(even.size()) + (op.over_root ? 0 : 1);
  scale = radius2 * radius;
  for (std::size_t i = 0; i < face.odd_asphere.size(); ++i, scale *= radius2) op.odd[i] = face.odd_asphere[i] * scale;
  op.odd_terms = static_cast<std::int32_t>(face.odd_asphere.size());
  return op;
}
static_assert(kEvenTerms == kMaxEvenTerms + 1 && kOddTerms == kMaxOddTerms);

// At normal incidence.
double highest_transmittance(double index_before, double index_after) {
  constexpr double kSteepest = 3.7;
  const double ratio = std::max(index_before, index_after) / std::min(index_before, index_after);
  return ratio < kSteepest ? 4 * ratio / ((ratio + 1) * (ratio + 1)) : 1;
}

ExactOp stop_op(Op::Kind kind, double radius) {
  ExactOp op{};
  op.kind = kind;
  op.clear_radius2 = radius * radius;
  return op;
}

Op rounded(const ExactOp& exact) {
  const auto round = [](double value) { return static_cast<float>(value); };
  Op op{};
  op.kind = exact.kind;
  std::transform(exact.rotation, exact.rotation + 9, op.rotation, round);
  std::transform(exact.translation, exact.translation + 3, op.translation, round);
  op.vertex_z = round(exact.vertex_z);
  op.curvature = round(exact.curvature);
  op.index_before = round(exact.index_before);
  op.index_after = round(exact.index_after);
  op.index_ratio = round(exact.index_ratio);
  op.clear_radius2 = round(exact.clear_radius2);
  op.conic_plus_1 = round(exact.conic_plus_1);
  op.shape_radius = round(exact.shape_radius);
  op.per_shape_radius2 = round(exact.per_shape_radius2);
  op.even_terms = exact.even_terms;
  op.odd_terms = exact.odd_terms;
  op.over_root = exact.over_root;
  std::transform(exact.even, exact.even + kEvenTerms, op.even, round);
  std::transform(exact.odd, exact.odd + kOddTerms, op.odd, round);
  op.lowest = round(exact.lowest);
  op.highest = round(exact.highest);
  op.steepest = round(exact.steepest);
  op.most_bent = round(exact.most_bent);
  op.near_vertex = round(exact.near_vertex);
  op.near_curvature = round(exact.near_curvature);
  op.near_conic_plus_1 = round(exact.near_conic_plus_1);
  op.rings = exact.rings;
  return op;
}

// Builds the list. Keeps the current frame as a motion "frame -> lens", so that consecutive frames become one operation
// and shifts along the axis are part of the next face.
class Builder {
 public:
  explicit Builder(std::vector<ExactOp>& ops) : ops_(ops) {}

  // Changes to the frame of `part` with its origin at (0, 0, z). The first call defines the start.
  void enter(const Motion& part, double z, ExactOp op) {
    const Motion origin{kIdentityRotation, {0, 0, z}};
    const Motion frame = after(part, origin);
    if (!started_) {
      started_ = true;
      first_ = frame;
      op.vertex_z = 0;
    } else if (part.rotation == part_.rotation && part.translation.x == part_.translation.x &&
               part.translation.y == part_.translation.y && part.translation.z == part_.translation.z) {
      op.vertex_z = z - z_;
    } else {
      ops_.push_back(frame_op(after(inverse(frame), frame_)));
      op.vertex_z = 0;
    }
    ops_.push_back(op);
    part_ = part;
    z_ = z;
    frame_ = frame;
  }
  // Appends an operation at z of the current part that moves neither rays nor frame.
  void check_at(double z, ExactOp op) {
    op.vertex_z = z - z_;
    ops_.push_back(op);
  }
  PlaceOnPath place() const { return {ops_.size(), frame_}; }
  const Motion& first() const { return first_; }
  const Motion& current() const { return frame_; }
  void start_at(const Motion& part, double z) {
    started_ = true;
    part_ = part;
    z_ = z;
    frame_ = after(part, {kIdentityRotation, {0, 0, z}});
    first_ = frame_;
  }

 private:
  std::vector<ExactOp>& ops_;
  bool started_ = false;
  Motion first_, frame_, part_;
  double z_ = 0;
};

}  // namespace

void set_backward_path(BackwardPath& path, const Assembly& assembly, const Motion& lens_to_world) {
  const Prescription& lens = assembly.lens();
  path.exact_ops.clear();
  path.rings.clear();
  path.into_element.resize(lens.elements.size());
  path.out_of_element.resize(lens.elements.size());
  path.through_aperture = 0;
  path.highest_transmittance = 1;
  Builder builder(path.exact_ops);
  const Motion unmoved;
  if (lens.barrel) {
    builder.start_at(unmoved, lens.barrel->to_z_mm);
    builder.check_at(lens.barrel->to_z_mm, stop_op(Op::bore, lens.barrel->bore_radius_mm));
  }
  std::size_t number = lens.face_count();  // faces in front of the current gap
  std::vector<const Stop*>& here = path.stops_in_place;
  const auto pass_stops_before = [&](std::size_t face) {
    here.clear();
    for (const Stop& stop : lens.stops)
      if (!stop.on_face && lens.faces_before(stop) == face) here.push_back(&stop);
    std::sort(here.begin(), here.end(), [](const Stop* a, const Stop* b) { return a->z_mm > b->z_mm; });
    for (const Stop* stop : here) {
      builder.enter(unmoved, stop->z_mm, stop_op(Op::stop, stop->opening_radius_mm));
      if (stop->aperture) path.through_aperture = path.exact_ops.size();
    }
  };
  pass_stops_before(number);
  for (std::size_t e = lens.elements.size(); e-- > 0;) {
    const Element& element = lens.elements[e];
    path.into_element[e] = builder.place();
    for (std::size_t f = element.faces.size(); f-- > 0;) {
      const double index_before = f == 0 ? 1.0 : element.faces[f - 1].index_after;
      --number;
      double opening = 1e300;
      bool is_aperture = false;
      for (const Stop& stop : lens.stops)
        if (stop.on_face && *stop.before_face == number) {
          opening = std::min(opening, stop.opening_radius_mm);
          is_aperture = is_aperture || stop.aperture;
        }
      const FaceBounds& bounds = assembly.bounds(e, f, Apertures::mesh);
      if (bounds.rings) path.rings.push_back(bounds.rings);
      builder.enter(assembly.placement(e), element.faces[f].z_mm,
                    face_op(element.faces[f], bounds, index_before, opening));
      if (is_aperture) path.through_aperture = path.exact_ops.size();
      path.highest_transmittance *= highest_transmittance(index_before, element.faces[f].index_after);
      if (f == 0) path.out_of_element[e] = builder.place();
      pass_stops_before(number);
    }
  }
  for (PlaceOnPath& place : path.into_element)
    if (place.before == 0) place.to_lens = builder.first();  // not known before the first operation
  path.ops.clear();
  std::transform(path.exact_ops.begin(), path.exact_ops.end(), std::back_inserter(path.ops), rounded);
  // Rounding of float products, which grows with the number of faces.
  const double rounding = std::max(1e-5, 1e-6 * static_cast<double>(lens.face_count()) / 3);
  path.highest_transmittance = std::min(1.0, path.highest_transmittance * (1 + rounding));
  path.into_first_frame = inverse(after(lens_to_world, builder.first()));
  path.world_of_last_frame = after(lens_to_world, builder.current());
}

BackwardPath backward_path(const Assembly& assembly, const Motion& lens_to_world) {
  BackwardPath path;
  set_backward_path(path, assembly, lens_to_world);
  return path;
}

Op last_frame_to_world(const BackwardPath& path, const std::optional<Motion>& then) {
  return rounded(frame_op(then ? after(*then, path.world_of_last_frame) : path.world_of_last_frame));
}

void put_ray(RayBlock& block, int i, const Vec3& start, const Vec3& direction) {
  block.x[i] = static_cast<float>(start.x);
  block.y[i] = static_cast<float>(start.y);
  block.z[i] = static_cast<float>(start.z);
  block.lx[i] = static_cast<float>(direction.x);
  block.ly[i] = static_cast<float>(direction.y);
  block.lz[i] = static_cast<float>(direction.z);
  block.above[i] = block.below[i] = block.margin[i] = 1;
}

void aim_rays(RayBlock& block, const BackwardPath& path, const Vec3& place, const Vec3& from, const double* x,
              const double* y, const double* z, int count) {
  double rotation[9];
  std::copy(path.into_first_frame.rotation.begin(), path.into_first_frame.rotation.end(), rotation);
  const Vec3 start = path.into_first_frame.point(place);
  block_kernels().aim(block, rotation, {start.x, start.y, start.z}, {from.x, from.y, from.z}, x, y, z, count);
}

}  // namespace relign::optics
