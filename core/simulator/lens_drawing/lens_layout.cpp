#include "lens_drawing/lens_layout.h"

#include <algorithm>
#include <cmath>

#include "drawing/scales.h"
#include "optics/face_shape.h"

namespace relign::drawing {
namespace {

constexpr double kHeading = 92;        // px
constexpr double kFoot = 30;           // px: the scale bar
constexpr double kNarrowest = 560;     // px: room for the heading
constexpr double kLongest = 960;       // px along the axis
constexpr double kWidest = 620;        // px across
constexpr double kLead = 0.22;         // of the lens's length, in front of it
constexpr double kBarrelShare = 0.03;  // of the lens's length: drawn thickness of the barrel
constexpr double kStopRim = 1.1;       // of the opening
constexpr double kLabelSize = 12;
constexpr double kLabelStep = 17;  // px between rows of labels
constexpr double kLabelGap = 14;   // px between picture and labels
constexpr double kSideRoom = 110;  // px for labels beside an upright drawing
constexpr double kBarShare = 0.2;  // of the visible length

using optics::Vec3;

}  // namespace

LensLayout::LensLayout(const LensPicture& picture) : assembly_(picture.assembly), vertical_(picture.vertical) {
  const optics::Assembly& assembly = *assembly_;
  const optics::Prescription& lens = assembly.lens();
  measure(picture);

  std::vector<Mark> elements, others;
  for (std::size_t e = 0; e < lens.elements.size(); ++e) {
    const std::vector<optics::Face>& faces = lens.elements[e].faces;
    double radius = 0;
    for (const optics::Face& face : faces) radius = std::max(radius, face.clear_radius_mm);
    // The label points into the glass, near but not at its rim, where it can be a sliver.
    const double middle_z = (faces.front().z_mm + faces.back().z_mm) / 2;
    const double inside = 0.85 * std::min(faces.front().clear_radius_mm, faces.back().clear_radius_mm);
    const Vec3 place = assembly.placement(e).point(
        {0, inside, middle_z + (optics::sag(faces.front(), inside) + optics::sag(faces.back(), inside)) / 2});
    elements.push_back({place.z, place.y, lens.elements[e].name});
  }
  for (const optics::Stop& stop : lens.stops) others.push_back({stop.z_mm, -stop_outer_radius(stop), stop.name});
  others.push_back({lens.image_z_mm, image_low_mm, picture.sensor_low_mm ? "sensor" : "image"});

  const double along = pixels_per_mm * (high_z_mm - low_z_mm);
  const double label_room = vertical_ ? kSideRoom : kLabelGap + 2.5 * kLabelStep;
  const double upper = std::max(pixels_per_mm * high_y_mm, pixels_per_mm * glass_y_mm + label_room);
  const double lower = std::max(-pixels_per_mm * low_y_mm, pixels_per_mm * glass_y_mm + label_room);
  if (vertical_) {
    width = std::max(2 * kMargin + upper + lower, kNarrowest);
    height = kHeading + along + kFoot + 2 * kMargin;
    origin_ = {kMargin + lower, kHeading - low_z_mm * pixels_per_mm};
  } else {
    width = std::max(2 * kMargin + along, kNarrowest);
    height = kHeading + upper + lower + kFoot + kMargin;
    origin_ = {kMargin - low_z_mm * pixels_per_mm, kHeading + upper};
  }
  bar_mm = round_step(kBarShare * (high_z_mm - low_z_mm));
  add_labels(elements, true, false);
  add_labels(others, false, true);
}

void LensLayout::measure(const LensPicture& picture) {
  const optics::Prescription& lens = assembly_->lens();
  double first = std::min(0.0, lens.image_z_mm), last = std::max(0.0, lens.image_z_mm);
  const auto include = [&](const Vec3& place) {
    first = std::min(first, place.z);
    last = std::max(last, place.z);
    glass_y_mm = std::max(glass_y_mm, std::fabs(place.y));
  };
  for (std::size_t e = 0; e < lens.elements.size(); ++e)
    for (const optics::Face& face : lens.elements[e].faces) {
      for (const Vec3& place : face_section(face, assembly_->placement(e), 9)) include(place);
      widest_ = std::max(widest_, face.clear_radius_mm);
    }
  const double length = last - first;
  if (lens.barrel) {
    barrel_radius_mm = lens.barrel->bore_radius_mm + kBarrelShare * length;
    include({0, barrel_radius_mm, lens.barrel->from_z_mm});
    include({0, barrel_radius_mm, lens.barrel->to_z_mm});
  }
  for (const optics::Stop& stop : lens.stops) include({0, stop_outer_radius(stop), stop.z_mm});
  ray_z_mm = first - kLead * length;
  low_z_mm = ray_z_mm;
  high_z_mm = last + 0.03 * length;

  image_low_mm = picture.sensor_low_mm.value_or(0);
  image_high_mm = picture.sensor_high_mm.value_or(0);
  for (const DrawnFan& fan : picture.fans)
    for (const optics::FanRay& ray : fan.rays) {
      for (const double y : {drawn_start(ray).y, ray.traced.image.y}) {
        low_y_mm = std::min(low_y_mm, y);
        high_y_mm = std::max(high_y_mm, y);
      }
      if (picture.sensor_low_mm) continue;
      image_low_mm = std::min(image_low_mm, ray.traced.image.y);
      image_high_mm = std::max(image_high_mm, ray.traced.image.y);
    }
  if (!picture.sensor_low_mm) {
    // Slightly more than the rays, symmetric; without rays half of the largest semi-diameter.
    double high = 1.1 * std::max(-image_low_mm, image_high_mm);
    if (high < 0.05 * widest_) high = widest_ / 2;
    image_low_mm = -high;
    image_high_mm = high;
  }
  glass_y_mm = std::max({glass_y_mm, -image_low_mm, image_high_mm});
  low_y_mm = std::min(low_y_mm, -glass_y_mm);
  high_y_mm = std::max(high_y_mm, glass_y_mm);
  pixels_per_mm = std::min(kLongest / (high_z_mm - low_z_mm), kWidest / (high_y_mm - low_y_mm));
}

double LensLayout::stop_outer_radius(const optics::Stop& stop) const {
  const double shortest = kStopRim * stop.opening_radius_mm;
  // A stop within the depth of a concave face: its rim must not cut the glass around it.
  for (const optics::Element& element : assembly_->lens().elements)
    for (const optics::Face& face : element.faces) {
      const double edge_z = face_section(face, {}, 2).back().z;
      if (stop.z_mm > std::min(face.z_mm, edge_z) && stop.z_mm < std::max(face.z_mm, edge_z)) return shortest;
    }
  const std::optional<optics::Barrel>& barrel = assembly_->lens().barrel;
  return std::max(barrel ? barrel->bore_radius_mm : kStopRim * widest_, shortest);
}

Point LensLayout::at(double z_mm, double y_mm) const {
  if (vertical_) return {origin_.x + y_mm * pixels_per_mm, origin_.y + z_mm * pixels_per_mm};
  return {origin_.x + z_mm * pixels_per_mm, origin_.y - y_mm * pixels_per_mm};
}

Vec3 LensLayout::drawn_start(const optics::FanRay& ray) const {
  const optics::Ray& start = ray.start;
  if (start.start.z >= ray_z_mm) return start.start;
  return start.start + ((ray_z_mm - start.start.z) / start.direction.z) * start.direction;
}

void LensLayout::add_labels(const std::vector<Mark>& marks, bool above, bool quiet) {
  const double edge = (above ? 1 : -1) * glass_y_mm;
  if (vertical_) {
    double next = 0;  // labels at similar positions on the axis move downwards
    for (const Mark& mark : marks) {
      const Point from = at(mark.z_mm, mark.y_mm);
      Point to = {at(mark.z_mm, edge).x + (above ? kLabelGap : -kLabelGap), std::max(from.y, next)};
      next = to.y + kLabelStep;
      labels.push_back(
          {from, to, {to.x + (above ? 4 : -4), to.y + 4}, mark.text, above ? Anchor::start : Anchor::end, quiet});
    }
    return;
  }
  std::vector<double> taken;  // the right end of each row of labels
  for (const Mark& mark : marks) {
    const double half = text_width(mark.text, kLabelSize) / 2;
    const Point from = at(mark.z_mm, mark.y_mm);
    const double x = std::clamp(from.x, kMargin / 2 + half, width - kMargin / 2 - half);
    std::size_t row = 0;
    while (row < taken.size() && x - half < taken[row] + 6) ++row;
    if (row == taken.size()) taken.push_back(0);
    taken[row] = x + half;
    const double away = kLabelGap + kLabelStep * static_cast<double>(row);
    const double y = at(mark.z_mm, edge).y + (above ? -away : away);
    labels.push_back({from, {x, y}, {x, above ? y - 4 : y + 12}, mark.text, Anchor::middle, quiet});
  }
}

}  // namespace relign::drawing
