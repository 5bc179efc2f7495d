// First-order data under the names that lens files give published values.
#pragma once

#include <map>
#include <string>

#include "optics/first_order.h"

namespace relign::optics {

inline std::map<std::string, double> named_values(const FirstOrder& data) {
  return {{"focal_length", data.focal_length},
          {"back_focal_length", data.back_focal_length},
          {"front_focal_length", data.front_focal_length},
          {"f_number", data.f_number},
          {"image_distance", data.image_distance},
          {"overall_length", data.overall_length},
          {"paraxial_image_height", data.paraxial_image_height},
          {"entrance_pupil_diameter", data.entrance_pupil_diameter},
          {"entrance_pupil_z", data.entrance_pupil_z},
          {"exit_pupil_diameter", data.exit_pupil_diameter},
          {"exit_pupil_from_last", data.exit_pupil_from_last}};
}

}  // namespace relign::optics
