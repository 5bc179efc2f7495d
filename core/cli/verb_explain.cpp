// relign-bench explain: exit codes of the program and ends of trials.
#include <algorithm>
#include <csignal>
#include <cstring>
#include <span>

#include "base/error.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/help.h"
#include "records/trial_ends.h"

namespace relign::cli {
namespace {

struct CodeKind {
  const char *name, *plural;
  std::span<const Explanation> entries;
};
const CodeKind kCodeKinds[] = {{"exit code", "Exit codes", kExitCodes},
                               {"end of a trial", "Ends of trials", records::kTrialEnds}};

std::vector<std::string> all_codes() {
  std::vector<std::string> codes;
  for (const CodeKind& kind : kCodeKinds)
    for (const Explanation& entry : kind.entries) codes.emplace_back(entry.code);
  return codes;
}

// The table's code for one that a user has seen: "crashed" for "crashed(SIGSEGV)", "128+N" for "139".
std::string table_code(const std::string& seen) {
  const std::vector<std::string> codes = all_codes();
  const bool number = seen.size() == 3 && seen.find_first_not_of("0123456789") == std::string::npos;
  if (std::find(codes.begin(), codes.end(), seen) != codes.end()) return seen;
  return number && std::stoi(seen) > kFirstSignalCode && std::stoi(seen) <= kFirstSignalCode + SIGRTMAX
             ? "128+N"
             : seen.substr(0, seen.find('('));
}

Json entry_json(const CodeKind& kind, const Explanation& entry) {
  return {{"code", entry.code},
          {"kind", kind.name},
          {"meaning", entry.meaning},
          {"causes", entry.causes},
          {"next", entry.next}};
}

// The meaning of a code that a user has seen: of 137, "ended by signal 9 (Killed)".
std::string meaning_of(const Explanation& entry, const std::string& seen) {
  if (entry.code != "128+N" || seen == entry.code) return std::string(entry.meaning);
  const int signal = std::stoi(seen) - kFirstSignalCode;
  return "ended by signal " + std::to_string(signal) + " (" + strsignal(signal) + ")";
}

std::string entry_text(const CodeKind& kind, const Explanation& entry, const std::string& seen) {
  std::string text = wrapped(seen + " (" + kind.name + "): " + meaning_of(entry, seen), 0) + "\n";
  if (!entry.causes.empty()) text += "\nUsual causes:\n  " + wrapped(std::string(entry.causes), 2) + "\n";
  if (!entry.next.empty()) text += "\nNext:\n  " + wrapped(std::string(entry.next), 2) + "\n";
  return text;
}

int list_codes(const Context& context) {
  Json array = Json::array();
  std::string text;
  for (const CodeKind& kind : kCodeKinds) {
    text += std::string(kind.plural) + ":\n";
    for (const Explanation& entry : kind.entries) {
      array.push_back(entry_json(kind, entry));
      add_row(text, std::string(entry.code), std::string(entry.meaning));
    }
    text += "\n";
  }
  print_result(context.json ? array.dump(2) + "\n" : text + "Causes, and what to do next: relign-bench explain CODE\n");
  return kDone;
}

int explain_code(Context& context, const std::string& seen) {
  if (seen.empty()) return list_codes(context);
  for (const CodeKind& kind : kCodeKinds)
    for (const Explanation& entry : kind.entries) {
      if (entry.code != table_code(seen)) continue;
      print_result(context.json ? Json::array({entry_json(kind, entry)}).dump(2) + "\n"
                                : entry_text(kind, entry, printable(seen)));
      return kDone;
    }
  const bool number = seen.find_first_not_of("0123456789") == std::string::npos;  // near in writing, not in meaning
  const std::string nearest = number ? "" : nearest_name(seen, all_codes());
  throw Error(ErrorKind::bad_input, "unknown code '" + seen + "'" +
                                        (nearest.empty() ? "" : "; did you mean '" + nearest + "'?") +
                                        "\nallowed: " + join(all_codes(), ", "));
}

}  // namespace

void add_explain(CLI::App& app, Context& context) {
  CLI::App& verb = add_verb(app, {"explain", "Explain an exit code or the end of a trial: causes, and what to do next.",
                                  "relign-bench explain\n"
                                  "relign-bench explain 4\n"
                                  "relign-bench explain 'crashed(SIGSEGV)'",
                                  "run, doctor, plugin"});
  std::string& code = add_action(verb, context, explain_code);
  verb.add_option("CODE", code, "exit code, or the end of a trial as in records and warnings [default: list all]")
      ->type_name("CODE:{" + join(all_codes(), ",") + "}");
}

}  // namespace relign::cli
