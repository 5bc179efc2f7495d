#include <locale.h>

#include <clocale>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <locale>

#include "plugin_host/guard.h"
#include "plugin_host/objects.h"

namespace relign::plugin_host {

struct EnvironmentWatch::Snapshot {
  std::filesystem::path folder;
  std::string locale;
  std::locale cpp_locale;
  locale_t thread_locale{};
  std::vector<struct sigaction> handlers;  // by signal number
  FloatingPointState floating_point = FloatingPointState::current();
  std::uint64_t floating_point_count = 0;
};

namespace {

std::string process_locale() {
  const char* name = std::setlocale(LC_ALL, nullptr);
  return name ? name : "C";
}

bool can_be_handled(int number) { return number != SIGKILL && number != SIGSTOP; }

bool same_handler(const struct sigaction& a, const struct sigaction& b) {
  return a.sa_flags == b.sa_flags && a.sa_handler == b.sa_handler;
}

std::vector<struct sigaction> current_handlers() {
  std::vector<struct sigaction> handlers(static_cast<std::size_t>(SIGRTMAX) + 1);
  for (int number = 1; number <= SIGRTMAX; ++number)
    if (can_be_handled(number)) ::sigaction(number, nullptr, &handlers[static_cast<std::size_t>(number)]);
  return handlers;
}

std::string signal_name(int number) {
  const char* name = ::sigabbrev_np(number);
  return name ? std::string("SIG") + name : "signal " + std::to_string(number);
}

}  // namespace

EnvironmentWatch::EnvironmentWatch() : before_(std::make_unique<Snapshot>()) {
  std::error_code error;
  before_->folder = std::filesystem::current_path(error);
  before_->locale = process_locale();
  before_->thread_locale = ::uselocale(nullptr);
  before_->handlers = current_handlers();
  before_->floating_point_count = floating_point_changes().count;
}

EnvironmentWatch::~EnvironmentWatch() = default;

std::vector<std::string> EnvironmentWatch::changes() {
  std::vector<std::string> messages;
  std::error_code error;

  const std::filesystem::path folder = std::filesystem::current_path(error);
  if (folder != before_->folder && !before_->folder.empty()) {
    messages.push_back("the working directory was changed to " + folder.string());
    std::filesystem::current_path(before_->folder, error);
    if (error) messages.back() += " (and could not be restored: " + error.message() + ")";
  }

  if (const std::string locale = process_locale(); locale != before_->locale) {
    messages.push_back("the locale was changed from " + before_->locale + " to " + locale);
    std::setlocale(LC_ALL, before_->locale.c_str());
  }
  if (::uselocale(nullptr) != before_->thread_locale) {
    messages.push_back("the locale of the thread was changed");
    ::uselocale(before_->thread_locale);
  }
  if (!(std::locale() == before_->cpp_locale)) {
    messages.push_back("the global C++ locale was changed to " + std::locale().name());
    std::locale::global(before_->cpp_locale);
    std::setlocale(LC_ALL, before_->locale.c_str());  // std::locale::global sets it as well
  }

  const std::vector<struct sigaction> handlers = current_handlers();
  for (int number = 1; number <= SIGRTMAX; ++number) {
    const auto index = static_cast<std::size_t>(number);
    if (!can_be_handled(number) || same_handler(handlers[index], before_->handlers[index])) continue;
    messages.push_back("the handler of " + signal_name(number) + " was changed");
    ::sigaction(number, &before_->handlers[index], nullptr);
  }

  // The guards of calls into plugins have restored the state and counted the changes.
  const FloatingPointState now = FloatingPointState::current();
  if (floating_point_changes().count != before_->floating_point_count) {
    messages.push_back(floating_point_changes().last);
    before_->floating_point_count = floating_point_changes().count;
  } else if (!now.same_mode(before_->floating_point)) {
    messages.push_back("the floating-point mode was changed (" + before_->floating_point.changes_to(now) + ")");
  }
  before_->floating_point.apply();
  return messages;
}

}  // namespace relign::plugin_host
