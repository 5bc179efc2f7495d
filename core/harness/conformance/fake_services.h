// The services of a fake trial (RELIGN_SERVICE_*): real measures, a synthetic scene (synthetic.h), and a short walk in
// place of any inner algorithm. As strict as the host's services (trials/services.h), and null unless the manifest
// declares what they need.
#pragma once

#include <list>
#include <string>
#include <string_view>
#include <vector>

#include "conformance/fake_trial.h"
#include "plugin_host/catalog.h"
#include "trials/measure_table.h"
#include "trials/scene_facts.h"

namespace relign::conformance {

class FakeServices {
 public:
  // Installs itself in `trial` for its lifetime. Both arguments must outlive it.
  FakeServices(const plugin_host::Choice& choice, FakeTrial& trial);
  ~FakeServices();
  FakeServices(const FakeServices&) = delete;
  FakeServices& operator=(const FakeServices&) = delete;

 private:
  struct Lens {
    double blur;  // of its offsets
  };

  static FakeServices& self(void* context) { return *static_cast<FakeServices*>(context); }
  template <class Body>
  relign_status answer(Body&& body);
  relign_status refuse(const std::string& reason);
  static relign_status tell_why(void* context, const relign_text_sink* sentence);

  const void* get(std::string_view id);
  const void* reference();
  const void* measures();
  const void* prior();
  const void* history();
  const void* run();
  const void* model();
  const void* prepared();

  void look();  // takes the first capture, unless there is one
  std::string draw(std::uint64_t number) const;
  relign_status walk(relign_text parameter, relign_text parameters_json, std::uint32_t most_steps,
                     relign_run_outcome* outcome);
  relign_status picture(relign_model_lens* lens, const double* true_pose, std::uint32_t axes, float* pixels);

  const plugin_host::Choice& choice_;
  FakeTrial& trial_;
  trials::SceneFacts scene_;
  std::string why_;

  std::vector<float> reference_pixels_;
  relign_image reference_image_{};
  relign_reference_service reference_{};
  relign_measures_service measures_{};
  trials::FieldMeasures fields_;
  relign_prior_service prior_{};
  relign_history_service history_{};
  relign_run_service run_{};
  relign_model_service model_{};
  relign_pretraining_service prepared_{};
  std::list<Lens> lenses_;  // a list, because the addresses are the handles
  // What the last outcome points to.
  relign_observation last_{};
  relign_observation best_{};
  Pose best_pose_;
  Pose recommendation_;
};

}  // namespace relign::conformance
