#include "base/own_command.h"

#include <filesystem>

#include "base/shell_words.h"

namespace relign {
namespace {

std::string& own_program() {
  static std::string program = "relign-bench";
  return program;
}

std::string command(const std::string& program, std::string_view arguments) {
  return shell_quoted(program) + " " + std::string(arguments);
}

}  // namespace

void set_own_program(std::string typed) { own_program() = std::move(typed); }

std::string own_command(std::string_view arguments) { return command(own_program(), arguments); }

std::string own_command_elsewhere(std::string_view arguments) {
  // Without a slash the shell found it on the PATH.
  const bool is_path = own_program().find('/') != std::string::npos;
  return command(is_path ? std::filesystem::absolute(own_program()).lexically_normal().string() : own_program(),
                 arguments);
}

}  // namespace relign
