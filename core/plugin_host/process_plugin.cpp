#include "plugin_host/process_plugin.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "base/files.h"
#include "base/text.h"
#include "plugin_host/process_manifest.h"

namespace relign::plugin_host {
namespace fs = std::filesystem;

namespace {

constexpr int kProtocol = 1;

double seconds_from_environment(const char* name, double otherwise) {
  const char* text = std::getenv(name);
  const double value = text ? std::atof(text) : 0;
  return value > 0 ? value : otherwise;
}

std::string environment_value(const char* name) {
  const char* text = std::getenv(name);
  return text ? text : "";
}

// Where relign_bench lies: ../share/relign-bench/python beside the program's own folder, in a build as
// after an installation. Empty: nowhere.
fs::path python_folder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return {};
  const fs::path folder = program.parent_path().parent_path() / "share" / "relign-bench" / "python";
  return fs::exists(folder / "relign_bench" / "plugin", error) ? folder : fs::path();
}

// What was received, short enough for a sentence.
std::string excerpt(const std::string& line) {
  constexpr std::size_t kLongest = 80;
  std::string shown;
  for (const char letter : line.substr(0, kLongest)) shown += letter >= ' ' && letter <= '~' ? letter : '?';
  return "'" + shown + (line.size() > kLongest ? "...' (" + std::to_string(line.size()) + " bytes)" : "'");
}

const std::string* text_member(const Json& message, const char* name) {
  const auto found = message.find(name);
  return found != message.end() && found->is_string() ? found->get_ptr<const std::string*>() : nullptr;
}

}  // namespace

ProcessPatience ProcessPatience::from_environment() {
  ProcessPatience patience;
  patience.handshake_seconds = seconds_from_environment("RELIGN_HANDSHAKE_SECONDS", patience.handshake_seconds);
  patience.stop_seconds = seconds_from_environment("RELIGN_STOP_SECONDS", patience.stop_seconds);
  return patience;
}

std::vector<std::string> process_environment() {
  std::vector<std::string> environment;
  const std::string users_path = environment_value("PYTHONPATH");
  if (const fs::path folder = python_folder(); !folder.empty())
    environment.push_back("PYTHONPATH=" + folder.string() + (users_path.empty() ? "" : ":" + users_path));
  // Sets of texts keep their order from run to run.
  if (environment_value("PYTHONHASHSEED").empty()) environment.push_back("PYTHONHASHSEED=0");
  // Our folder may not be writable, and a plugin's folder should not change.
  if (const fs::path cache = cache_folder(); !cache.empty() && environment_value("PYTHONPYCACHEPREFIX").empty())
    environment.push_back("PYTHONPYCACHEPREFIX=" + (cache / "python").string());
  return environment;
}

std::string got_text(ChildProcess::Got got, const std::string& what_is_late) {
  switch (got) {
    case ChildProcess::Got::line:
      return "";
    case ChildProcess::Got::end:
      return "its process closed the conversation";
    case ChildProcess::Got::end_within_line:
      return "its process closed the conversation in the middle of a message";
    case ChildProcess::Got::late:
      return what_is_late;
    case ChildProcess::Got::late_within_line:
      return "it sent half a message and then nothing more";
    case ChildProcess::Got::too_long:
      return "it sent more than a million bytes without the end of a line";
  }
  return "";
}

std::string ending_text(const ChildProcess& child) {
  std::string text = ". Its process " + child.how_it_ended();
  if (child.last_output().empty()) return text + " and had printed nothing";
  text += "; the end of its output:";
  for (const std::string& line : child.last_output()) text += "\n  " + line;
  return text;
}

ProcessPlugin::ProcessPlugin(const Manifest& manifest, const HostServices& services)
    : plugin_id_(manifest.id),
      patience_(ProcessPatience::from_environment()),
      ready_by_(in_seconds(patience_.handshake_seconds)) {
  ChildProcess::Options options;
  options.command = manifest.command;
  options.folder = manifest.folder;
  options.environment = process_environment();
  options.seconds_for_a_line = patience_.stop_seconds;
  options.stop = services.stop;
  options.seconds_after_stop = patience_.stop_seconds;
  if (services.log) options.on_output = [log = services.log](const std::string& line) { log(RELIGN_LOG_INFO, line); };
  try {
    child_.emplace(std::move(options));
  } catch (const Error& error) {
    throw Error(error.kind(), "plugin '" + plugin_id_ + "' (" + manifest.folder.string() + "): " + error.what());
  }
  shake_hands(manifest);
}

ProcessPlugin::~ProcessPlugin() {
  constexpr double kSecondsToLeave = 2;
  if (sound_) child_->send("{\"message\":\"bye\"}\n", in_seconds(kSecondsToLeave));
  child_->end(sound_ ? kSecondsToLeave : 0);
}

void ProcessPlugin::shake_hands(const Manifest& manifest) {
  const char* during = "its handshake";
  send({{"message", "hello"},
        {"protocols", Json::array({kProtocol})},
        {"id", manifest.id},
        {"needs", Json::array()},
        {"host", "relign-bench"}},
       during);
  const Json answer = expect("hello", during, ready_by_);
  if (!answer.contains("protocol") || answer["protocol"] != kProtocol)
    fail(during, "it did not choose a protocol version of the host's (" + std::to_string(kProtocol) + ")");
  const std::string* id = text_member(answer, "id");
  if (!id || normalised_name(*id) != normalised_name(manifest.id))
    fail(during,
         "it says that it is " + (id ? "'" + *id + "'" : "nobody") + "; the manifest says '" + manifest.id + "'");
  if (const auto said = answer.find("manifest"); said != answer.end() && said->is_object())
    if (const std::string difference = manifest_difference(manifest, *said); !difference.empty())
      fail(during, difference);
  if (const auto needs = answer.find("needs"); needs != answer.end() && !(needs->is_array() && needs->empty()))
    fail(during, "it needs abilities that this host does not have: " + needs->dump());
}

void ProcessPlugin::send_line(std::string_view line, const char* during) {
  if (child_->send(line, in_seconds(patience_.handshake_seconds))) return;
  fail(during, "it reads no more messages");
}

void ProcessPlugin::send(const Json& message, const char* during) {
  // Texts come from users' files: what is no UTF-8 must not stop us.
  send_line(message.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n", during);
}

Json ProcessPlugin::receive(const char* during, Deadline deadline, const char* what_is_late) {
  std::string line;
  const ChildProcess::Got got = child_->receive(line, deadline);
  if (got == ChildProcess::Got::late || got == ChildProcess::Got::late_within_line) child_->end(0);  // it hangs
  if (got != ChildProcess::Got::line) fail(during, got_text(got, what_is_late));
  Json message = Json::parse(line, nullptr, false);
  if (message.is_discarded()) fail(during, "it sent " + excerpt(line) + ", which is no JSON");
  const std::string* name = message.is_object() ? text_member(message, "message") : nullptr;
  if (!name) fail(during, "it sent " + excerpt(line) + ", which is no message");
  if (*name == "failed") {
    const std::string* text = text_member(message, "text");
    fail(during, text && !text->empty() ? *text : "it reports a failure and gives no reason");
  }
  return message;
}

Json ProcessPlugin::expect(const char* name, const char* during, Deadline deadline) {
  Json message = receive(during, deadline, "it did not answer in time");
  if (*text_member(message, "message") != name)
    fail(during, "expected the message \"" + std::string(name) + "\", found " + excerpt(message.dump()));
  return message;
}

void ProcessPlugin::fail(const char* during, const std::string& sentence) {
  // A process that has just closed the conversation is about to end by itself, and how it does is worth knowing.
  constexpr double kSecondsToDie = 1;
  sound_ = false;
  child_->end(kSecondsToDie);
  throw Error(ErrorKind::plugin_failed,
              "plugin '" + plugin_id_ + "' failed in " + during + ": " + sentence + ending_text(*child_));
}

}  // namespace relign::plugin_host
