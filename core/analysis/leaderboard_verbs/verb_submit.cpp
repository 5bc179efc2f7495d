// relign-bench submit pack: makes the archive of a submission.
#include <cstdio>
#include <memory>

#include "base/error.h"
#include "base/hash.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/interrupt.h"
#include "leaderboard_verbs/submission_run.h"
#include "plugin_host/process_plugin.h"
#include "submissions/archive.h"
#include "submissions/evaluation_suite.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct PackArguments {
  std::string folder, out;
};

// A sandbox if this machine allows one; the evaluation has one in any case.
void use_sandbox_if_possible(Context& context) {
  const std::string& problem = plugin_host::sandbox_problem();
  context.sandboxed = problem.empty();
  if (!problem.empty()) print_warning("the self-test runs without a sandbox: " + problem);
  context.start_sandbox("");
}

int pack(Context& context, const PackArguments& arguments) {
  watch_for_stop();
  plugin_host::adopt_orphans();
  if (!submissions::is_archive_name(arguments.out))
    throw Error(ErrorKind::bad_input,
                "--out: found '" + arguments.out + "'; expected a file name that ends in .tar.zst, .tar.gz or .tar");
  const fs::path folder = fs::absolute(arguments.folder).lexically_normal();
  const submissions::Submission submission = submissions::read_submission(folder);
  const std::vector<std::string> files = submissions::files_to_pack(folder, arguments.out);
  use_sandbox_if_possible(context);
  check_environment(submission, folder);

  // The files that the archive will have, and no others.
  const TemporaryFolder scratch;
  submissions::pack_archive(folder, files, scratch.path() / "packed.tar");
  const fs::path unpacked = scratch.path() / "unpacked";
  submissions::unpack_archive(scratch.path() / "packed.tar", unpacked);
  const Json entry = submissions::submitted_entry(submission, unpacked, unpacked.string(), context.catalog());
  run_self_test(context, submission, entry);
  submissions::pack_archive(folder, files, arguments.out);

  const std::string hash = sha256_file(arguments.out);
  const std::uintmax_t bytes = fs::file_size(arguments.out);
  if (context.json) {
    print_result(Json{{"archive", arguments.out},
                      {"sha256", hash},
                      {"bytes", bytes},
                      {"files", files},
                      {"name", submission.name},
                      {"version", submission.version},
                      {"sandbox", context.sandboxed}}
                     .dump(2) +
                 "\n");
  } else {
    print_text("archive  " + arguments.out + "\nsha256   " + hash + "\nfiles    " + std::to_string(files.size()) +
               ", " + std::to_string(bytes) + " bytes packed: " + join(files, ", ") + "\n");
  }
  std::fprintf(stderr, "The self-test passed. Next: %s\n",
               own_command("submit evaluate " + shell_quoted(arguments.out) + " --suite SUITE -o DIR").c_str());
  return kDone;
}

void add_pack(CLI::App& submit, Context& context) {
  CLI::App& verb =
      add_verb(submit, {"pack", "Pack a folder with submission.json into an archive, after a short self-test.",
                        "relign-bench submit pack my_submission -o my_search-1.0.tar.zst",
                        "submit evaluate, plugin check, try"});
  PackArguments& arguments = add_action(verb, context, pack, "Stopped; nothing was written.");
  verb.add_option("DIR", arguments.folder, "folder with submission.json, the plugin or model, and all of their files")
      ->required()
      ->type_name("DIR");
  verb.add_option("-o,--out", arguments.out, "archive to write: NAME.tar.zst, NAME.tar.gz or NAME.tar")
      ->required()
      ->type_name("FILE");
}

}  // namespace

void add_submit(CLI::App& app, Context& context) {
  CLI::App& submit =
      add_verb(app, {"submit", "Pack a method for a comparison, or evaluate a packed one.",
                     "relign-bench submit pack my_submission -o my_search-1.0.tar.zst", "run, merge, verify, seal"});
  submit.require_subcommand(1);
  add_pack(submit, context);
  add_submit_evaluate(submit, context);
}

}  // namespace relign::cli
