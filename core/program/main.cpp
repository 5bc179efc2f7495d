// The program, made of the components that are built: core/CMakeLists.txt.
#include "cli/app.h"
#if RELIGN_HAS_SIMULATOR
#include "lens_verbs/extensions.h"
#endif
#if RELIGN_HAS_TRAINING
#include "network_plugin/network_plugin.h"
#endif

namespace relign::cli {
namespace {

// In the order of the help.
void add_verbs(CLI::App& app, Context& context) {
  add_run(app, context);
  add_try(app, context);
  add_validate(app, context);
  add_list(app, context);
  add_describe(app, context);
  add_render(app, context);
  add_report(app, context);
  add_compare(app, context);
#if RELIGN_HAS_LEADERBOARD
  add_leaderboard(app, context);
#endif
  add_plan(app, context);
  add_merge(app, context);
#if RELIGN_HAS_CLUSTER
  add_slurm(app, context);
#endif
  add_verify(app, context);
  add_seal(app, context);
  add_unseal(app, context);
#if RELIGN_HAS_LEADERBOARD
  add_submit(app, context);
#endif
#if RELIGN_HAS_SIMULATOR
  add_lens(app, context);
  extend_harness(context.extensions);
#endif
#if RELIGN_HAS_TRAINING
  context.extensions.write_network_plugin = write_network_plugin;
#endif
  add_scene(app, context);
#if RELIGN_HAS_SIMULATOR
  add_scene_new(*app.get_subcommand("scene"), context);
#endif
  add_plugin(app, context);
  add_doctor(app, context);
  add_explain(app, context);
  add_completion(app, context);
  add_worker(app, context);
}

}  // namespace
}  // namespace relign::cli

int main(int argc, char** argv) { return relign::cli::run_program(argc, argv, relign::cli::add_verbs); }
