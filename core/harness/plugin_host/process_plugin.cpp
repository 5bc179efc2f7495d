#include "plugin_host/process_plugin.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <limits>

#include "base/files.h"
#include "base/text.h"
#include "plugin_host/confinement.h"
#include "plugin_host/process_manifest.h"
#include "plugin_host/process_session.h"

namespace relign::plugin_host {
namespace fs = std::filesystem;

namespace {

constexpr int kProtocol = 1;
constexpr int kMaxNesting = 100;

double seconds_from_environment(const char* name, double otherwise) {
  const char* text = std::getenv(name);
  const double value = text ? std::atof(text) : 0;
  return value > 0 ? value : otherwise;
}

std::string environment_value(const char* name) {
  const char* text = std::getenv(name);
  return text ? text : "";
}

// A received line, shortened for a message.
std::string excerpt(const std::string& line) {
  constexpr std::size_t kMaxLength = 80;
  std::string shown;
  for (const char letter : line.substr(0, kMaxLength)) shown += letter >= ' ' && letter <= '~' ? letter : '?';
  return "'" + shown + (line.size() > kMaxLength ? "...' (" + std::to_string(line.size()) + " bytes)" : "'");
}

// With its lines after the first set off from the lines of others.
std::string indented(const std::string& text) {
  std::string shown;
  for (const char letter : text) shown += letter == '\n' ? "\n  " : std::string(1, letter);
  return shown;
}

// Nesting depth of lists and objects; limits the recursion of code that walks over a message.
int nesting(const std::string& line) {
  int depth = 0, deepest = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char letter = line[i];
    if (letter == '"') in_text = !in_text;
    if (in_text && letter == '\\') ++i;
    if (in_text) continue;
    if (letter == '[' || letter == '{') deepest = std::max(deepest, ++depth);
    if (letter == ']' || letter == '}') --depth;
  }
  return deepest;
}

std::string line_of(const Json& message) {
  // Strings come from users' files and may contain invalid UTF-8.
  return message.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

int level_of(const std::string& line) {
  for (const int level : {RELIGN_LOG_WARNING, RELIGN_LOG_DEBUG})
    if (line.rfind(log_prefix(level), 0) == 0) return level;
  return RELIGN_LOG_INFO;
}

bool is_number_or_null(const Json& value) { return value.is_number() || value.is_null(); }

double number_or_nan(const Json& value) {
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

const std::string* text_member(const Json& message, const char* name) {
  const auto found = message.find(name);
  return found != message.end() && found->is_string() ? found->get_ptr<const std::string*>() : nullptr;
}

}  // namespace

ProcessTimeouts ProcessTimeouts::from_environment() {
  ProcessTimeouts timeouts;
  timeouts.handshake_seconds = seconds_from_environment("RELIGN_HANDSHAKE_SECONDS", timeouts.handshake_seconds);
  timeouts.stop_seconds = seconds_from_environment("RELIGN_STOP_SECONDS", timeouts.stop_seconds);
  timeouts.call_seconds = seconds_from_environment("RELIGN_CALL_SECONDS", timeouts.call_seconds);
  return timeouts;
}

fs::path python_folder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return {};
  const fs::path folder = program.parent_path().parent_path() / "share" / "relign-bench" / "python";
  return fs::exists(folder / "relign_bench" / "plugin", error) ? folder : fs::path();
}

std::vector<std::string> process_environment() {
  std::vector<std::string> environment;
  const std::string users_path = environment_value("PYTHONPATH");
  if (const fs::path folder = python_folder(); !folder.empty())
    environment.push_back("PYTHONPATH=" + folder.string() + (users_path.empty() ? "" : ":" + users_path));
  // Makes the order of sets of strings repeatable.
  if (environment_value("PYTHONHASHSEED").empty()) environment.push_back("PYTHONHASHSEED=0");
  // Keeps bytecode out of our folder, which may be read-only, and out of a plugin's folder. Not if Python writes no
  // bytecode: then another folder would only hide that of the standard library, which every start would compile again.
  if (const fs::path cache = cache_folder(); !cache.empty() && environment_value("PYTHONPYCACHEPREFIX").empty() &&
                                             environment_value("PYTHONDONTWRITEBYTECODE").empty())
    environment.push_back("PYTHONPYCACHEPREFIX=" + (cache / "python").string());
  return environment;
}

std::string got_text(ChildProcess::Got got, const std::string& what_is_late) {
  switch (got) {
    case ChildProcess::Got::line:
      return "";
    case ChildProcess::Got::end:
      return "its process closed the connection";
    case ChildProcess::Got::end_within_line:
      return "its process closed the connection in the middle of a message";
    case ChildProcess::Got::late:
      return what_is_late;
    case ChildProcess::Got::late_within_line:
      return "it sent an incomplete message and then nothing more";
    case ChildProcess::Got::too_long:
      return "it sent more than a million bytes without a newline";
  }
  return "";
}

std::string ending_text(const ChildProcess& child) {
  std::string text = "; its process " + child.how_it_ended();
  if (child.last_output().empty()) return text + " and had printed nothing";
  text += "; its last output:";
  for (const std::string& line : child.last_output()) text += "\n  " + line;
  return text;
}

ProcessPlugin::ProcessPlugin(const Choice& choice, const HostServices& services)
    : plugin_id_(choice.plugin->id),
      timeouts_(ProcessTimeouts::from_environment()),
      ready_by_(in_seconds(timeouts_.handshake_seconds)) {
  const Manifest& manifest = *choice.plugin;
  ChildProcess::Options options;
  options.command = manifest.command.empty() ? library_command(manifest) : manifest.command;
  options.folder = manifest.folder;
  options.environment = process_environment();
  options.seconds_for_a_line = timeouts_.stop_seconds;
  options.stop = services.stop;
  options.seconds_after_stop = timeouts_.stop_seconds;
  if (services.log)
    options.on_output = [log = services.log, library = manifest.command.empty()](const std::string& line) {
      const int level = library ? level_of(line) : RELIGN_LOG_INFO;
      log(level, level == RELIGN_LOG_INFO ? line : line.substr(log_prefix(level).size()));
    };
  try {
    if (services.sandbox && is_algorithm(manifest.kind)) {
      std::vector<fs::path> files = files_of(choice);
      if (manifest.command.empty()) files.emplace_back(options.command.front());
      confine(options, files, *services.sandbox);
      options.reads_pixels_only = !services.saves;
    }
    child_.emplace(std::move(options));
  } catch (const Error& error) {
    throw Error(error.kind(), "plugin '" + plugin_id_ + "' (" + manifest.folder.string() + "): " + error.what());
  }
  shake_hands(manifest);
  create(choice, services);
}

ProcessPlugin::~ProcessPlugin() {
  const bool healthy = failure_.empty();
  if (healthy) child_->send("{\"message\":\"bye\"}\n", in_seconds(kSecondsToExit));
  child_->end(healthy ? kSecondsToExit : 0);
}

void ProcessPlugin::shake_hands(const Manifest& manifest) {
  const char* during = "the handshake";
  send({{"message", "hello"},
        {"protocols", Json::array({kProtocol})},
        {"id", manifest.id},
        {"needs", Json::array()},
        {"host", "relign-bench"}},
       during);
  const Json answer = expect("hello", during, ready_by_);
  if (!answer.contains("protocol") || answer["protocol"] != kProtocol)
    fail(during, "unsupported protocol version; expected \"protocol\": " + std::to_string(kProtocol));
  const std::string* id = text_member(answer, "id");
  if (!id || normalised_name(*id) != normalised_name(manifest.id))
    fail(during,
         "found " + (id ? "the id '" + *id + "'" : "no id") + "; expected '" + manifest.id + "' as in the manifest");
  if (const auto sent = answer.find("manifest"); sent != answer.end() && sent->is_object())
    if (const std::string difference = manifest_difference(manifest, *sent); !difference.empty())
      fail(during, difference);
  if (const auto needs = answer.find("needs"); needs != answer.end() && !(needs->is_array() && needs->empty()))
    fail(during, "it needs abilities that this host lacks: " + needs->dump());
}

void ProcessPlugin::create(const Choice& choice, const HostServices& services) {
  send({{"message", "create"},
        {"parameters", choice.parameters},
        {"threads", std::max(1u, services.threads)},
        {"plugin_folder", choice.plugin->folder.string()},
        {"cache_folder", services.sandbox ? "" : services.cache_folder.string()}},
       "create");
  expect("created", "create", ready_by_);
}

void ProcessPlugin::send_line(std::string_view line, const char* during) {
  if (!failure_.empty()) throw PluginEnded(failure_, outcome_);
  if (child_->send(line, in_seconds(timeouts_.call_seconds))) return;
  fail(during, "it stopped reading messages", Cause::ended);
}

void ProcessPlugin::send(const Json& message, const char* during) { send_line(line_of(message), during); }

Json ProcessPlugin::receive(const char* during, Deadline deadline, const char* what_is_late) {
  std::string line;
  const ChildProcess::Got got = child_->receive(line, deadline);
  const bool late = got == ChildProcess::Got::late || got == ChildProcess::Got::late_within_line;
  if (late) child_->terminate(kSecondsToExit);
  if (got != ChildProcess::Got::line) {
    const bool ended = got == ChildProcess::Got::end || got == ChildProcess::Got::end_within_line;
    const std::string stopped =
        "the program was told to stop, and it did not answer within " + shortest(timeouts_.stop_seconds) + " s of that";
    fail(during, got_text(got, late && child_->was_stopped() ? stopped : what_is_late),
         late    ? Cause::timeout
         : ended ? Cause::ended
                 : Cause::malformed_message);
  }
  const auto malformed = [&](const char* why) { fail(during, "malformed message " + excerpt(line) + ": " + why); };
  if (nesting(line) > kMaxNesting) malformed("nested too deep");
  Json message = parsed_json(line);
  if (message.is_discarded()) malformed("invalid JSON");
  const std::string* name = message.is_object() ? text_member(message, "message") : nullptr;
  if (!name) malformed("expected an object with a string 'message'");
  if (*name == "failed") {
    const std::string* text = text_member(message, "text");
    fail(during, text && !text->empty() ? *text : "it reported a failure without a reason", Cause::reported);
  }
  return message;
}

Json ProcessPlugin::expect(const char* name, const char* during, Deadline deadline) {
  return checked(receive(during, deadline, "it did not answer in time"), name, nullptr, during);
}

Json ProcessPlugin::ask_line(std::string_view line, const char* name, const char* during, const char* otherwise) {
  send_line(line, during);
  const std::string late = "it did not answer within " + shortest(timeouts_.call_seconds) + " s";
  return checked(receive(during, in_seconds(timeouts_.call_seconds), late.c_str()), name, otherwise, during);
}

Json ProcessPlugin::ask(const Json& request, const char* name, const char* during) {
  return ask_line(line_of(request), name, during);
}

Json ProcessPlugin::checked(Json message, const char* name, const char* otherwise, const char* during) {
  const std::string& found = *text_member(message, "message");
  if (found != name && (!otherwise || found != otherwise))
    fail(during, "expected the message '" + std::string(name) + "', found " + excerpt(message.dump()));
  return message;
}

// ---- members of messages ----------------------------------------------------------------------

template <class Fits>
const Json& ProcessPlugin::member(const Json& message, const char* name, const char* during, const char* what,
                                  Fits&& fits) {
  const auto found = message.find(name);
  if (found == message.end() || !fits(*found))
    fail(during, "malformed message '" + *text_member(message, "message") + "': expected " + what + " '" + name + "'");
  return *found;
}

const Json& ProcessPlugin::object(const Json& message, const char* name, const char* during) {
  return member(message, name, during, "an object", [](const Json& value) { return value.is_object(); });
}

double ProcessPlugin::number(const Json& message, const char* name, const char* during) {
  return number_or_nan(member(message, name, during, "a number", is_number_or_null));
}

std::uint64_t ProcessPlugin::bits(const Json& message, const char* name, const char* during) {
  const char* what = "an integer from 0 to 2^64 - 1";
  return member(message, name, during, what, [](const Json& value) { return value.is_number_unsigned(); })
      .get<std::uint64_t>();
}

std::vector<double> ProcessPlugin::numbers(const Json& message, const char* name, const char* during) {
  const Json& list = member(message, name, during, "a list of numbers", [](const Json& value) {
    return value.is_array() && std::all_of(value.begin(), value.end(), is_number_or_null);
  });
  std::vector<double> values;
  for (const Json& value : list) values.push_back(number_or_nan(value));
  return values;
}

void ProcessPlugin::fail(const char* during, const std::string& message, Cause cause) {
  // A process that has just closed the connection is about to end by itself: wait for its exit status.
  // In a sandbox the kernel ends all others first, which may be thousands.
  constexpr double kSecondsToEnd = 1, kSecondsToEndAll = 10;
  const std::string failed = "plugin '" + plugin_id_ + "' failed in " + during + ": ";
  failure_ = failed + indented(message);
  child_->end(cause == Cause::ended && child_->is_confined() ? kSecondsToEndAll : kSecondsToEnd);
  const std::deque<std::string>& output = child_->last_output();
  const std::string missing = missing_module(cause == Cause::ended && !output.empty() ? output.back() : message);
  failure_ = missing.empty() ? failure_ + ending_text(*child_) : failed + missing;
  outcome_ = cause == Cause::reported ? "failed" : cause == Cause::timeout ? "timeout" : "protocol_error";
  if (cause == Cause::ended && !child_->crash().empty()) outcome_ = child_->crash();
  throw PluginEnded(failure_, outcome_);
}

}  // namespace relign::plugin_host
