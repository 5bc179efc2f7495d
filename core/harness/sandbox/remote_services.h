// The services of a trial whose host is another process.
#pragma once

#include <relign/plugin.h>

#include <list>
#include <map>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "plugin_host/service_tables.h"
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

// The columns of a list of objects.
class Columns {
 public:
  void clear() { *this = {}; }
  const double* numbers(const Json& list, const char* name);
  const relign_text* texts(const Json& list, const char* name);

 private:
  std::list<std::vector<double>> numbers_;
  std::list<std::vector<std::string>> strings_;
  std::list<std::vector<relign_text>> texts_;
};

class RemoteServices {
 public:
  RemoteServices(Connection& connection, const Json& task);
  RemoteServices(const RemoteServices&) = delete;
  RemoteServices& operator=(const RemoteServices&) = delete;

  const void* get(std::string_view id);            // null when the host does not offer it
  const relign_image* latest_image();              // null when the algorithm observes no images
  const std::string& why() const { return why_; }  // the last request failed
  plugin_host::ServiceTables tables;
  Columns columns;  // of the last list

  // For the functions of each table, whose context is this object.
  static RemoteServices& self(void* context) { return *static_cast<RemoteServices*>(context); }
  // Sends a request of a service, and keeps the text of a failure for why(). Refused in another thread than run's.
  Json ask(const char* service, const char* call, Json::initializer_list_t arguments);
  bool has_axes(std::uint32_t axes);
  relign_status put(relign_text data);  // where the host reads it
  relign_text keep(const std::string& name, std::string text);
  void take(const Json& list, double* values, std::uint32_t axes);
  void take(const Json& place, float* pixels, std::uint64_t count);
  std::string bytes(const Json& place);
  const relign_reference_service* reference(relign_reference_service& table);
  relign_status run(relign_text parameter, relign_text changes, std::uint32_t steps, relign_run_outcome* outcome);

 private:
  relign_image image_at(std::size_t offset);

  Connection& connection_;
  std::uint32_t width_ = 0, height_ = 0;  // of the trial's images; 0: none
  std::size_t axes_;
  const std::thread::id thread_ = std::this_thread::get_id();
  std::string why_;
  relign_image latest_{}, reference_{};
  std::map<std::string, std::string> kept_;
  RemoteObservation run_last_, run_best_;
  std::vector<double> run_recommendation_;
};

}  // namespace relign::sandbox
