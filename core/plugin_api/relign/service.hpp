// relign/service.hpp: what the classes of a trial's services share (relign/services.hpp, relign/trial.hpp).
#ifndef RELIGN_SERVICE_HPP
#define RELIGN_SERVICE_HPP

#include <relign/plugin.h>

#include <cstddef>
#include <cstdint>
#include <relign/basics.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace relign::border {

// Collects what the host writes.
class Collector {
 public:
  Collector() {
    sink_.struct_size = sizeof sink_;
    sink_.context = this;
    sink_.write = [](void* context, relign_text text) {
      auto* self = static_cast<Collector*>(context);
      try {
        self->text_.assign(text.data ? text.data : "", static_cast<std::size_t>(text.size));
      } catch (...) {
        self->text_.clear();  // the host's frames are in between: nothing may be thrown
      }
    };
  }
  Collector(const Collector&) = delete;
  Collector& operator=(const Collector&) = delete;
  const relign_text_sink* sink() const { return &sink_; }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
  relign_text_sink sink_{};
};

// The host's table of a trial, and its services as tables.
class TrialTable {
 public:
  explicit TrialTable(const relign_trial* trial) : trial_(trial) {}

  std::size_t axes() const { return trial_->task->axes; }
  bool observes(std::uint32_t bits) const { return (trial_->task->observes & bits) == bits; }
  // Any service by its id; null when the host does not offer it.
  const void* service(std::string_view id) const {
    return trial_->get_service ? trial_->get_service(trial_->context, to_text(id)) : nullptr;
  }

 protected:
  // Throws std::logic_error when the host does not offer the service, which needs `bits`, `word` under "observes".
  template <class Table>
  const Table* offered(const char* id, std::uint32_t bits, const char* word) const {
    if (const void* table = service(id)) return static_cast<const Table*>(table);
    const std::string who = std::string("the service ") + id;
    if (!observes(bits))
      throw std::logic_error(who + " is not granted: declare \"" + word + "\" under \"observes\" in the manifest");
    throw std::logic_error(who + " is not offered by this host or scene");
  }
  // False for RELIGN_UNSUPPORTED. Other failures of a service's function `what` are thrown with the host's message.
  bool done(relign_status status, const char* what) const {
    if (status == RELIGN_OK) return true;
    if (status == RELIGN_UNSUPPORTED) return false;
    check(status, what);
    return false;
  }
  void check(relign_status status, const char* what) const {
    if (status == RELIGN_OK) return;
    if (status == RELIGN_STOP) throw Stopped();
    Collector reason;
    trial_->why(trial_->context, reason.sink());
    const std::string text = std::string(what) + ": " + (reason.text().empty() ? "refused" : reason.text());
    if (status == RELIGN_BAD_ARGUMENT) throw std::invalid_argument(text);
    throw std::runtime_error(text);
  }
  template <class List>
  static std::uint32_t count_of(const List& list) {
    return static_cast<std::uint32_t>(list.size());
  }
  // A rectangle is four numbers in the interface.
  static std::vector<std::uint32_t> to_numbers(const std::vector<Region>& regions) {
    std::vector<std::uint32_t> numbers;
    for (const Region& region : regions)
      numbers.insert(numbers.end(), {region.column, region.row, region.columns, region.rows});
    return numbers;
  }
  // A struct for the host to fill.
  template <class Struct>
  static Struct empty() {
    Struct made{};
    made.struct_size = sizeof made;
    return made;
  }

  const relign_trial* trial_;
};

template <class Table>
class Service : protected TrialTable {
 public:
  Service(const TrialTable& trial, const Table* table) : TrialTable(trial), table_(table) {}

 protected:
  const Table* table_;
};

}  // namespace relign::border

#endif  // RELIGN_SERVICE_HPP
