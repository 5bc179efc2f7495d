// The services of a trial whose host is another process.
#pragma once

#include <relign/plugin.h>

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sandbox/connection.h"

namespace relign::sandbox {

// The status that an answer of the host stands for.
relign_status status_of(const Json& answer);
std::vector<double> numbers(const Json& list);  // null is NaN
// As JSON that reads back as the same doubles: the sign of zero, too. null for what is not finite.
void add_exact(std::string& line, const double* values, std::size_t count);

// An observation from a message, with the memory that it needs.
class RemoteObservation {
 public:
  void take(const Json& message, const relign_image* image);
  void write(relign_observation* seen) const;  // up to its struct_size
  const relign_observation* get() const { return &observation_; }

 private:
  relign_observation observation_{};
  std::vector<double> pose_;
};

class RemoteServices {
 public:
  RemoteServices(Connection& connection, const Json& task);
  RemoteServices(const RemoteServices&) = delete;
  RemoteServices& operator=(const RemoteServices&) = delete;

  const void* get(std::string_view id);  // null when the host does not offer it
  const relign_image* latest_image();    // null when the algorithm observes no images

 private:
  static RemoteServices& self(void* context) { return *static_cast<RemoteServices*>(context); }
  // Sends a request of a service, and keeps the text of a failure for why().
  Json ask(const char* service, const char* call, Json arguments = Json::object());
  bool offers(const char* service, const char* call);
  relign_status run(relign_text parameter, relign_text changes, std::uint32_t steps, relign_run_outcome* outcome);
  relign_status measure_fields(relign_text arguments, relign_field_measures* measured);
  relign_status model_pixels(const char* call, relign_model_lens* lens, const double* pose, std::uint32_t axes,
                             const std::uint64_t* seed, float* pixels);
  relign_status load(const relign_text_sink* sink);
  relign_status save(relign_text data);
  const void* reference();
  const void* history();
  void fill_tables();
  relign_image image_at(std::size_t offset);

  Connection& connection_;
  std::uint32_t width_ = 0, height_ = 0;  // of the trial's images; 0: none
  std::string why_;
  relign_image latest_{}, reference_{};
  relign_reference_service reference_table_{};
  relign_measures_service measures_{};
  relign_regions_service regions_{};
  relign_prior_service prior_{};
  relign_run_service run_{};
  relign_model_service model_{};
  relign_pretraining_service prepared_{};
  relign_history_service history_{};
  std::vector<std::vector<double>> cure_shifts_;  // newest first
  std::string scene_json_;
  std::size_t model_offset_ = 0;
  struct Fields {
    std::vector<std::string> name_texts;
    std::vector<relign_text> names;
    std::vector<double> mark_x_px, mark_y_px, tangential, sagittal;
  } fields_;
  RemoteObservation run_last_, run_best_;
  std::vector<double> run_recommendation_;
};

}  // namespace relign::sandbox
