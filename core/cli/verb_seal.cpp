// relign-bench seal and unseal: secrets of sealed suites, whose instances are unknown before the run.
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "base/commitment.h"
#include "base/error.h"
#include "base/files.h"
#include "base/json_members.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "cli/app.h"
#include "cli/secrets.h"
#include "records/manifest_check.h"
#include "records/results_folder.h"
#include "suites/secret.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

// Readable by its owner alone, and never over another file: a lost secret is lost results.
void write_secret(const std::string& file, const std::string& secret) {
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (descriptor < 0)
    throw Error(errno == EEXIST ? ErrorKind::bad_input : ErrorKind::io,
                "--out: cannot create '" + file + "': " + std::strerror(errno) +
                    (errno == EEXIST ? "; choose another file, for a secret that is overwritten is lost" : ""));
  const std::string text = secret + "\n";
  const bool written = write(descriptor, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (close(descriptor) != 0 || !written) {
    unlink(file.c_str());
    throw Error(ErrorKind::io, "--out: cannot write '" + file + "'");
  }
}

int make_secret(const Context& context, const std::string& out) {
  const std::string secret = suites::new_secret();
  write_secret(out, secret);
  const std::string commitment = commitment_to(secret);
  if (context.json)
    print_result(Json({{"secret", out}, {"commitment", commitment}}).dump(2) + "\n");
  else
    print_result("secret      " + out + "\ncommitment  " + commitment + "\n");
  std::fprintf(stderr,
               "Next: write \"commitment\": \"%s\" into the suite and publish it; keep the file to yourself, and run\n"
               "  %s\n",
               commitment.c_str(), own_command("run SUITE --secret " + shell_quoted(out)).c_str());
  return kDone;
}

int publish_secret(const Context& context, const fs::path& results, const std::string& file) {
  records::require_results(results);
  records::Manifest manifest = records::manifest_of(results);
  const std::string commitment = manifest.commitment;
  if (!manifest.sealed())
    throw Error(ErrorKind::bad_input, "'" + results.string() + "' is not sealed: its suite has no \"commitment\"");
  const std::string secret = given_secret(file).value_or("");
  if (secret.empty()) throw Error(ErrorKind::bad_input, missing_secret("'" + results.string() + "'"));
  suites::check_secret(secret, commitment, "'" + results.string() + "'");
  manifest.secret = secret;
  records::ResultsWriter(results).write_manifest(manifest);
  if (context.json)
    print_result(Json({{"results", results.string()}, {"commitment", commitment}, {"secret", secret}}).dump(2) + "\n");
  else
    print_result("unsealed    " + results.string() + "\ncommitment  " + commitment + "\n");
  std::fprintf(stderr, "Next: anybody can check the results now: %s%s\n",
               own_command("verify " + shell_quoted(results.string())).c_str(),
               manifest.ran_in_sandbox() ? " --sandbox" : "");
  return kDone;
}

}  // namespace

void add_seal(CLI::App& app, Context& context) {
  CLI::App& verb = add_verb(app, {"seal", "Make the secret of a sealed suite, and print the commitment for the suite.",
                                  "relign-bench seal -o secret.txt", "unseal, run, verify"});
  auto out = std::make_shared<std::string>();
  verb.add_option("-o,--out", *out, "new file for the secret")->required()->type_name("FILE");
  verb.callback([&context, out] { context.action = [&context, out] { return make_secret(context, *out); }; });
}

void add_unseal(CLI::App& app, Context& context) {
  CLI::App& verb =
      add_verb(app, {"unseal", "Publish the secret of a sealed suite in its results, so that anyone can verify them.",
                     "relign-bench unseal results/sealed --secret secret.txt", "seal, verify"});
  auto results = std::make_shared<std::string>(), secret = std::make_shared<std::string>();
  verb.add_option("DIR", *results, "results folder of a sealed suite")->required()->type_name("DIR");
  add_secret_option(verb, *secret);
  verb.callback([&context, results, secret] {
    context.action = [&context, results, secret] { return publish_secret(context, *results, *secret); };
  });
}

}  // namespace relign::cli
