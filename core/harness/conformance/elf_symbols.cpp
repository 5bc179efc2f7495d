#include "conformance/elf_symbols.h"

#include <elf.h>

#include <algorithm>
#include <cstring>

#include "base/error.h"
#include "base/files.h"
#include "plugin_host/library.h"

namespace relign::conformance {
namespace {

// Reads a struct at an offset of the file's bytes.
template <class Struct>
Struct at(const std::string& bytes, std::uint64_t offset) {
  if (offset > bytes.size() || sizeof(Struct) > bytes.size() - offset)
    throw Error(ErrorKind::plugin_rejected, "its symbol table is outside the file");
  Struct value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

bool is_exported(const Elf64_Sym& symbol) {
  const unsigned binding = ELF64_ST_BIND(symbol.st_info);
  const unsigned visibility = ELF64_ST_VISIBILITY(symbol.st_other);
  return symbol.st_shndx != SHN_UNDEF && symbol.st_name != 0 && binding != STB_LOCAL &&
         (visibility == STV_DEFAULT || visibility == STV_PROTECTED);
}

}  // namespace

std::vector<std::string> exported_symbols(const std::filesystem::path& library) {
  if (const std::string problem = plugin_host::check_shared_library(library); !problem.empty())
    throw Error(ErrorKind::plugin_rejected, problem);
  const std::string bytes = read_file(library);
  const auto header = at<Elf64_Ehdr>(bytes, 0);
  std::vector<std::string> names;
  bool found = false;
  for (unsigned index = 0; index < header.e_shnum; ++index) {
    const auto table = at<Elf64_Shdr>(bytes, header.e_shoff + std::uint64_t{index} * header.e_shentsize);
    if (table.sh_type != SHT_DYNSYM || table.sh_entsize < sizeof(Elf64_Sym)) continue;
    found = true;
    const auto strings = at<Elf64_Shdr>(bytes, header.e_shoff + std::uint64_t{table.sh_link} * header.e_shentsize);
    for (std::uint64_t entry = 0; entry + table.sh_entsize <= table.sh_size; entry += table.sh_entsize) {
      const auto symbol = at<Elf64_Sym>(bytes, table.sh_offset + entry);
      if (!is_exported(symbol)) continue;
      const std::uint64_t name = strings.sh_offset + symbol.st_name;
      if (name >= bytes.size()) throw Error(ErrorKind::plugin_rejected, "its symbol names are outside the file");
      names.emplace_back(bytes.data() + name, ::strnlen(bytes.data() + name, bytes.size() - name));
    }
  }
  if (!found) throw Error(ErrorKind::plugin_rejected, "it has no table of exported symbols");
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

}  // namespace relign::conformance
