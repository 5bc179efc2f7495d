#include "plugin_host/library.h"

#include <dlfcn.h>
#include <elf.h>

#include <cstring>
#include <map>
#include <mutex>
#include <type_traits>

#include "base/error.h"
#include "base/files.h"
#include "plugin_host/guard.h"

namespace relign::plugin_host {
namespace {

std::string abi_text(std::uint32_t major, std::uint32_t minor) {
  return "plugin interface " + std::to_string(major) + "." + std::to_string(minor);
}

const std::string kSupported = abi_text(RELIGN_ABI_MAJOR, RELIGN_ABI_MINOR);

[[noreturn]] void reject_library(const Manifest& manifest, const std::string& why, const std::string& built_for,
                                 const std::string& what_to_do, const std::string& supported = kSupported) {
  throw Error(ErrorKind::plugin_rejected,
              "plugin '" + manifest.id + "' refused: " + why + "\n  library:    " + manifest.library.string() +
                  "\n  built for:  " + built_for + "\n  supported:  " + supported + "\n  what to do: " + what_to_do);
}

std::string build_text(const relign_plugin_description& entry) {
  std::string text = abi_text(entry.abi_major, entry.abi_minor);
  if (RELIGN_HAS_MEMBER(&entry, build_info) && entry.build_info) text += ", " + std::string(entry.build_info);
  return text;
}

// Checks a plugin's description, in an order that never reads beyond struct_size.
void check_description(const Manifest& manifest, const relign_plugin_description& entry) {
  if (!RELIGN_HAS_MEMBER(&entry, abi_minor))
    reject_library(manifest, "its description has only " + std::to_string(entry.struct_size) + " bytes", "unknown",
                   "rebuild it with relign_add_plugin and RELIGN_PLUGIN");
  if (entry.abi_major != RELIGN_ABI_MAJOR)
    reject_library(manifest, "it was built for another version of the plugin interface", build_text(entry),
                   entry.abi_major > RELIGN_ABI_MAJOR
                       ? "update relign-bench, or rebuild the plugin with the relign/plugin.h of this version"
                       : "rebuild the plugin with the relign/plugin.h of this version");
  if (!RELIGN_HAS_MEMBER(&entry, get_interface) || !entry.manifest_json || !entry.get_interface)
    reject_library(manifest, "its description is incomplete (" + std::to_string(entry.struct_size) + " bytes)",
                   build_text(entry), "rebuild it with relign_add_plugin and RELIGN_PLUGIN");
  if (manifest.text != entry.manifest_json)
    reject_library(manifest, "the manifest in " + manifest.folder.string() + " differs from the one inside the library",
                   build_text(entry),
                   "build the plugin again: relign_add_plugin embeds the manifest and copies it beside",
                   kSupported + ", with both manifests equal byte for byte");
}

const relign_plugin_description* open_library(const Manifest& manifest, const std::filesystem::path& file) {
  if (const std::string problem = check_shared_library(file); !problem.empty())
    reject_library(manifest, problem, "unknown", "build or copy the library again",
                   "shared libraries (ELF) for this machine's processor");
  void* library = nullptr;
  {
    const FloatingPointGuard guard(manifest.id);  // loading a library linked with -ffast-math changes the state
    library = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  }
  if (!library) {
    const char* reason = ::dlerror();
    const std::string text = reason ? reason : "no reason given";
    const bool symbol = text.find("undefined symbol") != std::string::npos;
    reject_library(manifest, "the system cannot load the library: " + text, "unknown",
                   symbol ? "link the library that defines the symbol into the plugin (LIBRARIES of relign_add_plugin)"
                          : "install the library it needs, or build the plugin again on this machine");
  }
  // Never closed, even if refused: code of the library may still be referenced.
  const void* symbol = ::dlsym(library, RELIGN_PLUGIN_ENTRY_SYMBOL);
  if (!symbol)
    reject_library(manifest, "the library does not export " RELIGN_PLUGIN_ENTRY_SYMBOL, "unknown",
                   "end its main file with RELIGN_PLUGIN(YourClass) and build it with relign_add_plugin");
  return static_cast<const relign_plugin_description*>(symbol);
}

}  // namespace

const relign_plugin_description& load_library(const Manifest& manifest) {
  static std::mutex mutex;
  static auto* loaded =
      new std::map<std::filesystem::path, const relign_plugin_description*>;  // as long as the process
  std::error_code error;
  const std::filesystem::path file = std::filesystem::canonical(manifest.library, error);
  if (error)
    reject_library(manifest, "cannot find its library (" + error.message() + ")", "unknown",
                   "build the plugin, or correct 'library' in its manifest");
  const std::lock_guard<std::mutex> lock(mutex);
  const auto known = loaded->find(file);
  const relign_plugin_description* entry = known != loaded->end() ? known->second : open_library(manifest, file);
  (*loaded)[file] = entry;
  check_description(manifest, *entry);
  return *entry;
}

const void* plugin_interface(const Manifest& manifest, const char* interface_id, std::size_t required_size) {
  const relign_plugin_description& entry = load_library(manifest);
  const void* table = nullptr;
  {
    const FloatingPointGuard guard(manifest.id);
    try {
      table = entry.get_interface({interface_id, std::strlen(interface_id)});
    } catch (...) {  // reported below as a missing table
    }
  }
  if (!table)
    reject_library(manifest,
                   std::string("the manifest has the kind ") + kind_name(manifest.kind) +
                       ", but the library offers no " + interface_id,
                   build_text(entry), "derive the class in RELIGN_PLUGIN from the base of its kind, or correct 'kind'",
                   interface_id);
  std::uint32_t size = 0;
  std::memcpy(&size, table, sizeof size);
  if (size < required_size)
    reject_library(manifest,
                   std::string("its table ") + interface_id + " has " + std::to_string(size) +
                       " bytes; expected at least " + std::to_string(required_size),
                   build_text(entry), "rebuild the plugin with the relign/plugin.h of this version");
  return table;
}

void require_function(const Manifest& manifest, const char* interface_id, const char* name, bool present) {
  if (present) return;
  reject_library(manifest, std::string("its table ") + interface_id + " has no function '" + name + "'",
                 build_text(load_library(manifest)), "set every function that plugin.h does not mark as optional");
}

std::string check_shared_library(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return "its library is not a file";
  std::string bytes;
  try {
    bytes = read_file(file);
  } catch (const Error& problem) {
    return problem.what();
  }
  Elf64_Ehdr header;
  if (bytes.size() < sizeof header || std::memcmp(bytes.data(), ELFMAG, SELFMAG) != 0)
    return "its library is not a shared library";
  std::memcpy(&header, bytes.data(), sizeof header);
#if defined(__x86_64__)
  const unsigned machine = EM_X86_64;
#elif defined(__aarch64__)
  const unsigned machine = EM_AARCH64;
#else
  const unsigned machine = header.e_machine;
#endif
  if (header.e_ident[EI_CLASS] != ELFCLASS64 || header.e_machine != machine)
    return "its library was built for another kind of processor";
  if (header.e_type != ET_DYN) return "its library is not a shared library";
  const std::uint64_t size = bytes.size();
  const auto inside = [size](std::uint64_t offset, std::uint64_t length) {
    return offset <= size && length <= size - offset;
  };
  const std::string truncated = "its library is truncated or corrupt";
  const std::uint64_t program_bytes = std::uint64_t{header.e_phnum} * header.e_phentsize;
  const std::uint64_t section_bytes = std::uint64_t{header.e_shnum} * header.e_shentsize;
  if (header.e_phnum == 0 || header.e_phentsize != sizeof(Elf64_Phdr) || !inside(header.e_phoff, program_bytes) ||
      !inside(header.e_shoff, section_bytes))
    return truncated;
  for (unsigned index = 0; index < header.e_phnum; ++index) {
    Elf64_Phdr segment;
    std::memcpy(&segment, bytes.data() + header.e_phoff + index * sizeof segment, sizeof segment);
    if (segment.p_type != PT_NULL && !inside(segment.p_offset, segment.p_filesz)) return truncated;
  }
  return "";
}

}  // namespace relign::plugin_host
