// What the design says about a chart: how marks move, how the focus of a field changes with the pose, and curves.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <relign/plugin.hpp>
#include <string>
#include <utility>
#include <vector>

#include "focus_curves.hpp"
#include "marks.hpp"

namespace field_focus {

// The axis order of all scenes: two lateral axes, focus, two tilts, rotation.
constexpr std::size_t kFocusAxis = 2, kFirstTilt = 3, kTurn = 5;
using Shift = Eigen::Vector3d;  // of the image: columns, rows, rotation in radians

// What the design says about a chart: how marks move and how the focus of a field changes with the pose.
struct Design {
  std::vector<Mark> marks;                 // as the reference shows them
  double half_width = 0, half_height = 0;  // of the image, pixels
  double limit = 0;                        // how far a mark may be from its place, pixels
  Eigen::MatrixXd motion;                  // Shift x axes, per share of the travel
  std::vector<Eigen::Vector2d> slopes;     // by mark: share of the focus axis per share of the tilts; none: no chart
  double centred = 0.12;                   // of a mark's side: shift up to which its edges are measured
  std::vector<Eigen::Vector2d> channel_slopes;  // by channel, from rays; none without curves
  std::vector<DesignCurve> curves;              // by mark: upright edges, level edges; about the plane of best focus
  double edges_above = 0;  // by edges the plane is higher by this than by rays, share of the focus axis

  std::vector<Channel> channels() const {
    std::vector<Channel> all;
    for (std::size_t i = 0; i < 2 * slopes.size(); ++i)
      all.push_back({channel_slopes.empty() ? slopes[i / 2] : channel_slopes[i], {}});
    return all;
  }
};

// A measure of an image by name and arguments.
using Measure = std::function<double(const char*, const std::string&)>;

// Adds the MTF of an image's edges at this pose, at the middle of each mark, without the pixels' part, as criteria by
// field measure it; only where all edges of a mark that are inside the image are measurable.
void sample(std::vector<Channel>& channels, const Design& design, const std::vector<Mark>& marks, const Focus& pose,
            double doubt, double frequency, const Measure& measure);

// Mean shift and rotation against the reference, from the marks that both images show. Nothing with fewer than two.
std::optional<Shift> shift_of(const Design& design, const std::vector<Mark>& marks);

// Of the designed lens, with the axes of `nominal`. Without slopes if the reference image shows no chart. `curves`:
// with curves at this frequency (cycles per pixel); throws std::runtime_error if the scene cannot give them.
Design study_design(const relign::Model& model, const Eigen::VectorXd& nominal, double stride,
                    const std::vector<float>& reference, std::optional<double> curves);

}  // namespace field_focus
