#include "plugin_host/guard.h"

#include <algorithm>
#include <new>
#include <vector>

#include "base/machine.h"
#include "base/text.h"

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace relign::plugin_host {
namespace {

thread_local FloatingPointChanges thread_changes;

// What plugin.hpp reports when memory runs out; it used to report the exception's own text.
bool is_out_of_memory(const std::string& message) {
  return message == "out of memory" || message == std::bad_alloc().what();
}

std::string to_string(relign_text text) {
  return text.data && text.size > 0 ? std::string(text.data, static_cast<std::size_t>(text.size)) : std::string();
}

#if defined(__x86_64__)
constexpr std::uint32_t kStickyFlags = 0x003f;
constexpr std::uint32_t kSubnormalsAreZero = 0x0040;
constexpr std::uint32_t kExceptionMasks = 0x1f80;
constexpr std::uint32_t kRounding = 0x6000;
constexpr std::uint32_t kFlushToZero = 0x8000;
#endif

}  // namespace

FloatingPointState FloatingPointState::current() {
  FloatingPointState state;
#if defined(__x86_64__)
  state.mxcsr_ = _mm_getcsr();
  __asm__ volatile("fnstcw %0" : "=m"(state.x87_));
#else
  std::fegetenv(&state.environment_);
#endif
  state.rounding_ = std::fegetround();
  return state;
}

void FloatingPointState::apply() const {
#if defined(__x86_64__)
  _mm_setcsr(mxcsr_);
  __asm__ volatile("fldcw %0" : : "m"(x87_));
#else
  std::fesetenv(&environment_);
#endif
}

bool FloatingPointState::same_mode(const FloatingPointState& other) const {
#if defined(__x86_64__)
  return (mxcsr_ | kStickyFlags) == (other.mxcsr_ | kStickyFlags) && x87_ == other.x87_;
#else
  return rounding_ == other.rounding_;
#endif
}

std::string FloatingPointState::changes_to(const FloatingPointState& later) const {
  std::vector<std::string> parts;
#if defined(__x86_64__)
  const std::uint32_t changed = mxcsr_ ^ later.mxcsr_;
  if (changed & kFlushToZero)
    parts.push_back(std::string("flush-to-zero was switched ") + (later.mxcsr_ & kFlushToZero ? "on" : "off"));
  if (changed & kSubnormalsAreZero)
    parts.push_back(std::string("subnormals-are-zero was switched ") +
                    (later.mxcsr_ & kSubnormalsAreZero ? "on" : "off"));
  if (changed & kExceptionMasks) parts.push_back("floating-point exceptions were masked differently");
  if (changed & kRounding) parts.push_back("the rounding mode was changed");
  if (x87_ != later.x87_) parts.push_back("the x87 control word was changed");
#else
  if (rounding_ != later.rounding_) parts.push_back("the rounding mode was changed");
#endif
  return join(parts, ", ");
}

FloatingPointGuard::~FloatingPointGuard() {
  const FloatingPointState after = FloatingPointState::current();
  before_.apply();
  if (before_.same_mode(after)) return;
  try {
    ++thread_changes.count;
    thread_changes.last =
        "the floating-point mode was changed by '" + plugin_id_ + "' (" + before_.changes_to(after) + ")";
  } catch (...) {  // no memory for the message; the state itself is restored
  }
}

const FloatingPointChanges& floating_point_changes() { return thread_changes; }

ObjectHost::ObjectHost(const Manifest& manifest, const HostServices& services)
    : plugin_id_(manifest.id),
      folder_(manifest.folder.string()),
      cache_(services.cache_folder.string()),
      log_(services.log) {
  host_.struct_size = sizeof host_;
  host_.abi_major = RELIGN_ABI_MAJOR;
  host_.abi_minor = RELIGN_ABI_MINOR;
  host_.threads = std::max(1u, services.threads);
  host_.context = this;
  host_.plugin_folder = {folder_.data(), folder_.size()};
  host_.cache_folder = {cache_.data(), cache_.size()};
  // The plugin calls the three functions below: no exception may unwind through it.
  host_.fail = [](void* context, relign_text message) {
    auto* self = static_cast<ObjectHost*>(context);
    try {
      const std::lock_guard<std::mutex> lock(self->mutex_);
      self->failures_[std::this_thread::get_id()] = to_string(message);
    } catch (...) {
    }
  };
  host_.log = [](void* context, std::int32_t level, relign_text message) {
    auto* self = static_cast<ObjectHost*>(context);
    try {
      if (self->log_) self->log_(level, to_string(message));
    } catch (...) {
    }
  };
  host_.get_extension = [](void*, relign_text) -> const void* { return nullptr; };
}

void ObjectHost::forget_failure() {
  const std::lock_guard<std::mutex> lock(mutex_);
  failures_.erase(std::this_thread::get_id());
}

std::string ObjectHost::failure_text(relign_status status) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    // A plugin may report from another thread: then any message is better than none.
    auto found = failures_.find(std::this_thread::get_id());
    if (found == failures_.end()) found = failures_.begin();
    if (found != failures_.end()) {
      std::string message = found->second;
      failures_.erase(found);
      if (!message.empty()) return message;
    }
  }
  if (status == RELIGN_BAD_ARGUMENT) return "it refused the host's arguments without a reason";
  if (status == RELIGN_FAILED) return "it reported a failure without a reason";
  return "it returned the unknown status " + std::to_string(status);
}

void ObjectHost::throw_failure(const char* what, const std::string& message) const {
  const std::string start = "plugin '" + plugin_id_ + "' failed in " + what + ": ";
  if (!is_out_of_memory(message)) throw Error(ErrorKind::plugin_failed, start + message);
  throw Error(ErrorKind::plugin_failed,
              start + "out of memory: it may use " + memory_words() +
                  "; raise the limit, or let it do less: fewer pixels, wavelengths or workers");
}

TextSink::TextSink() {
  sink_.struct_size = sizeof sink_;
  sink_.context = &text_;
  sink_.write = [](void* context, relign_text text) {
    try {
      *static_cast<std::string*>(context) = to_string(text);
    } catch (...) {  // no memory: the text stays empty, and its reader reports that
    }
  };
}

namespace {

// The value of a parameter of one of the given types, or null.
const Json* value_of(void* context, relign_text name, std::initializer_list<ParameterType> types) {
  const auto* choice = static_cast<const Choice*>(context);
  const Parameter* parameter = choice->plugin->parameter(to_string(name));
  if (!parameter || std::find(types.begin(), types.end(), parameter->type) == types.end()) return nullptr;
  const auto found = choice->parameters.find(parameter->name);
  return found == choice->parameters.end() ? nullptr : &*found;
}

// The plugin calls the getters: std::bad_alloc must not unwind through it.
template <class Body>
relign_status shielded(Body&& body) noexcept {
  try {
    return body();
  } catch (...) {
    return RELIGN_FAILED;
  }
}

}  // namespace

ParameterTable::ParameterTable(const Choice& choice) : choice_(choice), json_(canonical_json(choice.parameters)) {
  table_.struct_size = sizeof table_;
  table_.context = const_cast<Choice*>(&choice_);  // the getters do not modify it
  table_.json = {json_.data(), json_.size()};
  table_.number = [](void* context, relign_text name, double* value) {
    return shielded([&]() -> relign_status {
      const Json* found = value_of(context, name, {ParameterType::number});
      if (!found || !found->is_number()) return RELIGN_BAD_ARGUMENT;
      *value = found->get<double>();
      return RELIGN_OK;
    });
  };
  table_.integer = [](void* context, relign_text name, std::int64_t* value) {
    return shielded([&]() -> relign_status {
      const Json* found = value_of(context, name, {ParameterType::integer});
      if (!found || !found->is_number_integer()) return RELIGN_BAD_ARGUMENT;
      *value = found->get<std::int64_t>();
      return RELIGN_OK;
    });
  };
  table_.boolean = [](void* context, relign_text name, std::int32_t* value) {
    return shielded([&]() -> relign_status {
      const Json* found = value_of(context, name, {ParameterType::boolean});
      if (!found || !found->is_boolean()) return RELIGN_BAD_ARGUMENT;
      *value = found->get<bool>() ? 1 : 0;
      return RELIGN_OK;
    });
  };
  table_.text = [](void* context, relign_text name, relign_text* value) {
    return shielded([&]() -> relign_status {
      const Json* found = value_of(context, name, {ParameterType::text, ParameterType::file, ParameterType::algorithm});
      if (found && found->is_object() && found->contains("use")) found = &found->at("use");  // of type algorithm
      if (!found || !found->is_string()) return RELIGN_BAD_ARGUMENT;
      const auto& text = found->get_ref<const std::string&>();
      *value = {text.data(), text.size()};
      return RELIGN_OK;
    });
  };
}

}  // namespace relign::plugin_host
